#include <relief/base/try.h>
#include <relief/session/saver.h>

#include <algorithm>
#include <utility>

namespace relief::detail {

Saver::Saver(ModelInfo info, std::filesystem::path place, std::optional<ModelFile> file,
             std::chrono::milliseconds retry_after, std::function<void(Notice)> tell)
    : info_(std::move(info)),
      place_(std::move(place)),
      file_(std::move(file)),
      tell_(std::move(tell)),
      retry_after_(retry_after),
      thread_([this] { run(); }) {}

Saver::~Saver() { static_cast<void>(close()); }

// ---- The document's side

void Saver::push(Job job) {
  const std::scoped_lock lock(mutex_);
  jobs_.push_back(std::move(job));
  ++pushed_;
  stalled_ = false;
  wake_.notify_one();
}

void Saver::commit(std::uint64_t serial, SnapshotPtr state, StrokeRecord record) {
  push(Commit{serial, std::move(state), std::move(record)});
}

void Saver::go_to(std::uint64_t number, SnapshotPtr state) { push(Place{number, std::move(state)}); }

void Saver::elsewhere(std::filesystem::path file, std::shared_ptr<const std::atomic<bool>> cancel, std::uint64_t first,
                      std::uint64_t position, std::vector<Kept> kept, FirstState first_state) {
  const std::scoped_lock lock(mutex_);
  moves_.push_back({std::move(file), std::move(cancel), first, position, std::move(kept), first_state, pushed_});
  stalled_ = false;
  wake_.notify_one();
}

Result<SnapshotPtr> Saver::read(std::uint64_t number, std::uint64_t near_number, const SnapshotPtr& near) {
  return wait_for({.read = [&]() -> Result<SnapshotPtr> {
    if (!file_.has_value()) return fail(Errc::NotFound, "there is no file that has this step");
    if (near) return file_->at(number - offset_, near, near_number - offset_, progress());
    return file_->at(number - offset_, progress());
  }});
}

Result<SnapshotPtr> Saver::read_as_made(std::uint64_t number, const std::atomic<bool>* cancel) {
  return wait_for({.read = [&]() -> Result<SnapshotPtr> {
                     // It may have gone on in a file that does not have so old a state.
                     if (!file_.has_value() || number < offset_) return SnapshotPtr();
                     return file_->as_made(number - offset_, progress(cancel));
                   },
                   .cancel = cancel});
}

Result<SnapshotPtr> Saver::wait_for(Read read) {
  constexpr std::chrono::milliseconds kSeen(50);  // after which people notice that a cancel was not heeded
  std::unique_lock lock(mutex_);
  if (ended_) return fail(Errc::Cancelled, "the document was closed");
  reads_.push_back(&read);
  wake_.notify_one();
  while (!answered_.wait_for(lock, kSeen, [&] { return read.result.has_value(); })) {
    // One that is being read looks at the flag itself.
    const bool cancelled = read.cancel != nullptr && read.cancel->load();
    if (cancelled && std::erase(reads_, &read) > 0) return fail(Errc::Cancelled, "cancelled");
  }
  return *std::move(read.result);
}

std::uint64_t Saver::unsaved_now() const {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(jobs_, [](const Job& job) { return std::holds_alternative<Commit>(job); }));
}

std::uint64_t Saver::unsaved() const {
  const std::scoped_lock lock(mutex_);
  return unsaved_now();
}

Status Saver::close() {
  if (thread_.joinable()) {
    {
      const std::scoped_lock lock(mutex_);
      closing_ = true;
      stalled_ = false;
      wake_.notify_one();
    }
    thread_.join();
    file_.reset();
  }
  return jobs_.empty() ? Status() : status_;
}

// ---- The saver's side

void Saver::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    const auto has_job = [&] { return !jobs_.empty() && !stalled_; };
    // What was done before it goes into the old file first, if that takes it.
    const auto moves_now = [&] { return !moves_.empty() && (!has_job() || popped_ >= moves_.front().after); };
    const auto has_work = [&] { return !reads_.empty() || !moves_.empty() || has_job() || closing_; };
    if (stalled_) {
      if (!wake_.wait_for(lock, retry_after_, has_work)) {
        stalled_ = false;
        retrying_ = true;
      }
    } else {
      wake_.wait(lock, has_work);
    }
    if (!reads_.empty()) {
      answer(lock);
    } else if (moves_now()) {
      move(lock);
    } else if (has_job()) {
      write_next(lock);
    } else {
      ended_ = true;
      return;
    }
  }
}

void Saver::answer(std::unique_lock<std::mutex>& lock) {
  // Its caller waits, so it stays as it is.
  Read& read = *reads_.front();
  reads_.pop_front();
  lock.unlock();
  Result<SnapshotPtr> found = read.read();
  lock.lock();
  read.result = std::move(found);
  answered_.notify_all();
}

void Saver::write_next(std::unique_lock<std::mutex>& lock) {
  Job& job = jobs_.front();  // a deque keeps its place when others come behind it
  lock.unlock();
  Status done = write(job);
  const auto* commit = std::get_if<Commit>(&job);
  const std::uint64_t serial = commit != nullptr ? commit->serial : 0;
  lock.lock();
  Job finished;  // releases its snapshot after the lock
  if (done) {
    finished = std::move(jobs_.front());
    jobs_.pop_front();
    ++popped_;
  }
  stalled_ = !done;
  status_ = done;
  const bool known = std::exchange(retrying_, false);
  const std::uint64_t unsaved = unsaved_now();
  lock.unlock();
  if (!done && !known)
    tell_(Failed{done.error(), unsaved});
  else if (done && serial != 0 && file_.has_value())
    tell_(Saved{serial});
  finished = {};
  lock.lock();
}

Status Saver::write(Job& job) {
  // Without a file there is nobody to write for: that another one could not be made was told.
  if (!file_.has_value()) return {};
  if (const auto* place = std::get_if<Place>(&job)) return file_->go_to(place->number - offset_, place->state);
  const auto& commit = std::get<Commit>(job);
  return file_->commit(commit.state, commit.record);
}

void Saver::move(std::unique_lock<std::mutex>& lock) {
  const Move move = std::move(moves_.front());
  moves_.pop_front();
  lock.unlock();
  Result<Elsewhere> done = file_.has_value() ? copy_to(move) : make_at(move);
  if (!done && file_.has_value() && done.error().code != Errc::Cancelled) done = make_at(move);
  lock.lock();
  if (done) stalled_ = false;  // another file takes at once what the old one did not
  std::deque<Job> obsolete;
  const std::uint64_t until = !file_.has_value() ? pushed_ : done && !done->copied ? move.after : popped_;
  for (; popped_ < until; ++popped_) {
    obsolete.push_back(std::move(jobs_.front()));
    jobs_.pop_front();
  }
  // To give up a move is no failure of the file that there is.
  if (!done && !(file_.has_value() && done.error().code == Errc::Cancelled))
    status_ = fail(done.error().code, done.error().message);
  const std::uint64_t unsaved = unsaved_now();
  lock.unlock();
  if (done)
    tell_(*std::move(done));
  else
    tell_(NotElsewhere{done.error(), unsaved, file_.has_value()});
  obsolete.clear();
  lock.lock();
}

Result<Saver::Elsewhere> Saver::copy_to(const Move& move) {
  RELIEF_CHECK(ModelFile::copy(place_, move.file, progress(move.cancel.get())));
  RELIEF_TRY(ModelFile copy, ModelFile::open(move.file, false, progress()));
  file_.emplace(std::move(copy));
  place_ = move.file;
  return Elsewhere{.file = move.file};
}

Result<Saver::Elsewhere> Saver::make_at(const Move& move) {
  const Model model = {info_, move.kept.front().snapshot};
  const bool has_first = file_.has_value() && move.first == offset_;
  RELIEF_TRY(ModelFile made, ModelFile::create(move.file, model, progress(move.cancel.get()),
                                               has_first ? file_->first_state() : move.first_state));
  // What the old file can still tell of the strokes that only it has the text of.
  std::vector<StrokeRecord> old;
  if (file_.has_value())
    if (auto told = file_->strokes()) old = *std::move(told);
  for (std::size_t k = 1; k < move.kept.size(); ++k) {
    const Kept& kept = move.kept[k];
    const std::size_t number = move.first + k - offset_;
    StrokeRecord record{.label = kept.label, .details = kept.text};
    if (record.details.empty() && number <= old.size()) record.details = old[number - 1].details;
    RELIEF_CHECK(made.commit(kept.snapshot, record, progress()));
  }
  RELIEF_CHECK(made.go_to(move.position - move.first, move.kept[move.position - move.first].snapshot));
  file_.emplace(std::move(made));
  place_ = move.file;
  offset_ = move.first;
  return Elsewhere{.file = move.file, .copied = false};
}

Progress Saver::progress(const std::atomic<bool>* cancel) const {
  return {.report = [this](std::string_view phase, double share) { tell_(Progressed{std::string(phase), share}); },
          .cancel = cancel};
}

}  // namespace relief::detail
