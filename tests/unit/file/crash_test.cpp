// The process dies in the middle: what was finished is there, and nothing else stands in the way.
#include <sqlite3.h>
#include <support/killed_child.h>
#include <sys/wait.h>
#include <unit/file/file_support.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <set>

namespace relief {
namespace {

using testing::ball;
using testing::Folder;
using testing::read_file;
using testing::saved_hash;
using testing::stroke;
using testing::with_cut;
using testing::write_file;

/// What the child tells: a state that the file is about to have, or has.
struct Report {
  std::uint64_t done, strokes, hash;
};

/// Commits and undoes without end, telling before and after each change. Never returns.
[[noreturn]] void work(const std::filesystem::path& path, int pipe) {
  auto file = ModelFile::open(path);
  if (!file) ::_exit(1);
  SnapshotPtr head = file->model().head;
  std::vector<SnapshotPtr> history = {head};
  const auto tell = [&](std::uint64_t done, std::uint64_t strokes) {
    const Report report{done, strokes, head->content_hash()};
    if (::write(pipe, &report, sizeof report) != sizeof report) ::_exit(2);
  };
  for (std::uint64_t k = 1;; ++k) {
    const std::uint64_t count = file->stroke_count();
    if (k % 7 == 0 && history.size() > 2) {
      history.resize(history.size() - 2);
      head = history.back();
      tell(0, count - 2);
      if (!file->undo(2)) ::_exit(3);
      tell(1, count - 2);
      if (file->model().head->content_hash() != head->content_hash()) ::_exit(4);
    } else {
      const auto slab = static_cast<SlabId>((count * 17 + k) % head->slab_mesh().slab_count());
      // Every third cuts, too.
      if (k % 3 == 0 && head->slab_mesh().level(slab) < 2) head = with_cut(head, slab);
      head = stroke(head, count * 31 + k);
      history.push_back(head);
      tell(0, count + 1);
      if (!file->commit(head, {.label = "k"})) ::_exit(5);
      tell(1, count + 1);
    }
  }
}

TEST(KilledProcess, LosesNoFinishedStroke) {
  const bool soak = std::getenv("RELIEF_SOAK") != nullptr;  // as ./dev soak sets it
  const int rounds = soak ? 1000 : 30;
  const Folder folder;
  const auto path = folder / "a.relief";
  std::uint64_t changes = 0, in_between = 0;
  for (int round = 0; round < rounds; ++round) {
    if (round % 50 == 0) {
      ASSERT_TRUE(ModelFile::create(path, ball(2, 8)).has_value());
    }
    // Killed at a random moment after it began.
    const auto reports = testing::told_by_killed_child<Report>(
        [&](int pipe) { work(path, pipe); }, [](const std::vector<Report>& so_far) { return !so_far.empty(); },
        static_cast<unsigned>(round * 7919 % 20000));
    ASSERT_FALSE(reports.empty());

    const auto last_done = std::find_if(reports.rbegin(), reports.rend(), [](const Report& r) { return r.done == 1; });
    const Report& last = reports.back();
    RELIEF_MUST(file, ModelFile::open(path, round % 2 == 0));
    const std::uint64_t hash = file.model().head->content_hash();
    if (last_done != reports.rend() && file.stroke_count() == last_done->strokes && hash == last_done->hash) {
      changes += reports.size() / 2;
      continue;
    }
    // Else the change that was under way is there as a whole; before the first one there is nothing to compare with.
    if (last_done != reports.rend() || file.stroke_count() == last.strokes) {
      EXPECT_EQ(file.stroke_count(), last.strokes);
      EXPECT_EQ(hash, last.hash);
      ++in_between;
    }
    EXPECT_TRUE(file.strokes().has_value());
  }
  EXPECT_GT(changes, static_cast<std::uint64_t>(rounds)) << "the children hardly got to work";
  RecordProperty("changes", static_cast<int>(changes));
  RecordProperty("seen_whole_before_it_was_told", static_cast<int>(in_between));
  for (const std::string& name : folder.names()) EXPECT_TRUE(name == "a.relief" || name == "a.relief-journal") << name;
}

TEST(KilledProcess, WhileItMadeAFileTheOldOneStays) {
  const Folder folder;
  const auto path = folder / "a.relief";
  const Model first = ball(1, 4), second = ball(3, 8);
  for (int round = 0; round < 12; ++round) {
    ASSERT_TRUE(ModelFile::create(path, first).has_value());
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      for (;;) static_cast<void>(ModelFile::create(path, second));
    }
    ::usleep(static_cast<useconds_t>((round * 1237) % 30000));
    ::kill(child, SIGKILL);
    ASSERT_EQ(::waitpid(child, nullptr, 0), child);
    RELIEF_MUST(file, ModelFile::open(path));
    const std::uint64_t hash = file.model().head->content_hash();
    EXPECT_TRUE(hash == first.head->content_hash() || hash == second.head->content_hash());
  }
}

/// Leaves `name` and its journal as a process does that dies while it changes the file.
void leave_half_done(const Folder& folder, const char* name, const Model& model) {
  ASSERT_TRUE(ModelFile::create(folder / "whole.relief", model).has_value());
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open((folder / "whole.relief").c_str(), &handle), SQLITE_OK);
  // A small cache makes SQLite write into the file before the end of the transaction.
  ASSERT_EQ(
      sqlite3_exec(handle,
                   "PRAGMA cache_size = 1; PRAGMA cache_spill = 1; BEGIN; UPDATE pages SET data = zeroblob(9000); "
                   "UPDATE cage SET data = zeroblob(9000); UPDATE meta SET value = 'broken'",
                   nullptr, nullptr, nullptr),
      SQLITE_OK);
  std::filesystem::copy_file(folder / "whole.relief", folder / name);
  std::filesystem::copy_file(folder / "whole.relief-journal", (folder / name).string() + "-journal");
  sqlite3_close(handle);
  std::filesystem::remove(folder / "whole.relief");
  std::filesystem::remove(folder / "whole.relief-journal");
}

TEST(KilledProcess, HalfAChangeIsUndoneAtOpening) {
  const Model model = ball(2, 8);
  for (const bool read_only : {false, true}) {
    const Folder folder;
    leave_half_done(folder, "a.relief", model);
    {
      // Without its journal the file is broken, so the test would notice if the journal were not used.
      std::filesystem::copy_file(folder / "a.relief", folder / "alone.relief");
      EXPECT_FALSE(ModelFile::open(folder / "alone.relief").has_value());
      std::filesystem::remove(folder / "alone.relief");
    }
    RELIEF_MUST(file, ModelFile::open(folder / "a.relief", read_only));
    EXPECT_EQ(file.model().head->content_hash(), model.head->content_hash());
    EXPECT_EQ(folder.names(), std::vector<std::string>{"a.relief"});
  }
}

TEST(KilledProcess, ItsJournalIsNotAppliedToANewFile) {
  const Model old_model = ball(2, 8), new_model = ball(2, 7);
  const Folder folder;
  leave_half_done(folder, "a.relief", old_model);
  ASSERT_TRUE(ModelFile::create(folder / "a.relief", new_model).has_value());
  EXPECT_EQ(saved_hash(folder / "a.relief"), new_model.head->content_hash());

  const Folder other;  // the journal alone
  leave_half_done(other, "a.relief", old_model);
  std::filesystem::remove(other / "a.relief");
  ASSERT_TRUE(ModelFile::create(other / "a.relief", new_model).has_value());
  EXPECT_EQ(saved_hash(other / "a.relief"), new_model.head->content_hash());
  EXPECT_EQ(other.names(), std::vector<std::string>{"a.relief"});

  const Folder copied;  // the source of a copy is half changed, and so is what it replaces
  leave_half_done(copied, "a.relief", old_model);
  leave_half_done(copied, "b.relief", new_model);
  EXPECT_OK(ModelFile::copy(copied / "a.relief", copied / "b.relief"));
  EXPECT_EQ(saved_hash(copied / "b.relief"), old_model.head->content_hash());
  EXPECT_EQ(copied.names(), (std::vector<std::string>{"a.relief", "b.relief"}));
}

}  // namespace
}  // namespace relief
