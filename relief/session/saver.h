// Writes a document's strokes into its file, on a thread of its own.
#pragma once

#include <relief/base/error.h>
#include <relief/core/model.h>
#include <relief/file/model_file.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

namespace relief::detail {

/// Keeps a file at what the document has done, in order. After an error what failed is tried again every
/// `retry_after`, and when more is asked for. Called by one thread, but where it is said.
class Saver {
 public:
  /// A state of the history, to be written into a file that has none of it.
  struct Kept {
    std::uint64_t serial = 0;
    SnapshotPtr snapshot;
    std::string label, text;
  };

  // What it tells.
  struct Saved {
    std::uint64_t serial = 0;
  };
  /// Holds what was to be written was not; `unsaved` strokes wait.
  struct Failed {
    Error error;
    std::uint64_t unsaved = 0;
  };
  /// It goes on in another file: a copy, or one that has only what was kept.
  struct Elsewhere {
    std::filesystem::path file;
    bool copied = true;
  };
  /// There is no other file, and, where there was none, none at all.
  struct NotElsewhere {
    Error error;
    std::uint64_t unsaved = 0;
    bool has_file = false;
  };
  struct Progressed {
    std::string phase;
    double share = 0;
  };
  using Notice = std::variant<Saved, Failed, Elsewhere, NotElsewhere, Progressed>;

  /// `tell` is called by the saver's thread and must not wait for it.
  Saver(ModelInfo info, std::filesystem::path place, std::optional<ModelFile> file,
        std::chrono::milliseconds retry_after, std::function<void(Notice)> tell);
  Saver(const Saver&) = delete;
  Saver& operator=(const Saver&) = delete;
  ~Saver();

  /// The state after the one at which the document was.
  void commit(std::uint64_t serial, SnapshotPtr state, StrokeRecord record);
  /// The document has gone to state `number`.
  void go_to(std::uint64_t number, SnapshotPtr state);
  /// To another file: a copy of the one that there is, with its whole history; if it cannot be read, or there is none,
  /// a new one with what is kept: states `first`, first + 1, ..., at `position`.
  /// `cancel`, where given, ends it before the new file stands.
  /// `first_state` is that of the first kept one, if the file does not know better.
  void elsewhere(std::filesystem::path file, std::shared_ptr<const std::atomic<bool>> cancel, std::uint64_t first,
                 std::uint64_t position, std::vector<Kept> kept, FirstState first_state);

  /// State `number` from the file, near one that the file has, too (or null). Waits for what is being written now.
  [[nodiscard]] Result<SnapshotPtr> read(std::uint64_t number, std::uint64_t near_number, const SnapshotPtr& near);
  /// The state that made the slabs of state `number`; null where no file has it. Any thread; waits likewise, until the
  /// flag is set. Errors: Io, Cancelled.
  [[nodiscard]] Result<SnapshotPtr> read_as_made(std::uint64_t number, const std::atomic<bool>* cancel);
  /// Strokes that are not in the file.
  [[nodiscard]] std::uint64_t unsaved() const;
  /// Writes what is left, and ends. Error: why not all is in the file.
  [[nodiscard]] Status close();

 private:
  struct Commit {
    std::uint64_t serial = 0;
    SnapshotPtr state;
    StrokeRecord record;
  };
  struct Place {
    std::uint64_t number = 0;
    SnapshotPtr state;
  };
  using Job = std::variant<Commit, Place>;
  struct Move {
    std::filesystem::path file;
    std::shared_ptr<const std::atomic<bool>> cancel;
    std::uint64_t first = 0, position = 0;
    std::vector<Kept> kept;
    FirstState first_state = FirstState::Sculpted;
    std::uint64_t after = 0;  ///< jobs that came before it, which `kept` has done
  };
  struct Read {
    std::function<Result<SnapshotPtr>()> read;  ///< on the saver's thread
    const std::atomic<bool>* cancel = nullptr;
    std::optional<Result<SnapshotPtr>> result{};
  };

  void push(Job job);
  [[nodiscard]] Result<SnapshotPtr> wait_for(Read read);
  void run();
  void answer(std::unique_lock<std::mutex>& lock);
  void write_next(std::unique_lock<std::mutex>& lock);
  void move(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] Status write(Job& job);
  [[nodiscard]] Result<Elsewhere> copy_to(const Move& move);
  [[nodiscard]] Result<Elsewhere> make_at(const Move& move);
  [[nodiscard]] std::uint64_t unsaved_now() const;
  [[nodiscard]] Progress progress(const std::atomic<bool>* cancel = nullptr) const;

  // The saver's thread alone.
  ModelInfo info_;
  std::filesystem::path place_;
  std::optional<ModelFile> file_;
  std::uint64_t offset_ = 0;  ///< a state's number less its number in the file
  std::function<void(Notice)> tell_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, answered_;
  std::deque<Job> jobs_;
  std::uint64_t pushed_ = 0, popped_ = 0;
  std::deque<Move> moves_;
  std::deque<Read*> reads_;
  std::chrono::milliseconds retry_after_;
  bool retrying_ = false;  ///< what is written now failed before, and that was told
  bool stalled_ = false;   ///< the first job failed, and nobody has asked for more since
  bool closing_ = false, ended_ = false;
  Status status_;  ///< of the last job
  std::thread thread_;
};

}  // namespace relief::detail
