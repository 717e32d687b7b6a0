// Writes what a servo did into a recording, off the servo's thread.
#pragma once

#include <relief/base/error.h>
#include <relief/core/snapshot.h>
#include <relief/haptics/servo_thread.h>
#include <relief/session/document.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace relief {

/// Says where a recording comes from, as its head says it.
struct RecordingOrigin {
  std::string program = {};          ///< name, version and commit
  std::filesystem::path model = {};  ///< the model's file
  std::uint64_t model_strokes = 0;   ///< finished strokes in it
  std::string model_unit = {};       ///< what one model unit is: "mm", "cm" or "m"
};

/// Takes ticks and edits in the order in which they happened; a thread of its own packs and writes them. The ticks must
/// begin with a servo's first.
class Recorder {
 public:
  /// The file has its name at once, and what is in it survives the death of the process. Live: no call waits for the
  /// disk; the file grows four times a second; ticks for which the disk is too slow for minutes are left out, which
  /// shows. Path: calls wait for the disk.
  enum class Pace : std::uint8_t { Live, Path };
  /// `model` and `settings` are those that the servo starts with. An existing file is replaced. Error: Io.
  [[nodiscard]] static Result<Recorder> create(const std::filesystem::path& file, Pace pace,
                                               const RecordingOrigin& origin, const SnapshotPtr& model,
                                               const ServoSettings& settings, const DeviceInfo& device);
  /// Takes over; the other one may only be destroyed or assigned to.
  Recorder(Recorder&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  Recorder& operator=(Recorder&&) noexcept;
  ~Recorder();

  /// One thread. The tick's model must be the first one, or a head that was noted before.
  void tick(const ServoTick& tick);
  /// What a document tells who watches it. Another thread, perhaps.
  void note(const EditNote& note);
  /// The next settings that ServoThread::set() took. Any thread.
  void set(const ServoSettings& settings);

  /// Writes what is left and closes the file; `times` are those of the servo's thread, if it had one. Error: what went
  /// wrong first, Io.
  [[nodiscard]] Status finish(const ServoTimes* times);
  /// Ticks that are in the file; after finish(), whatever that returned.
  [[nodiscard]] std::uint64_t kept() const noexcept;

 private:
  struct State;
  explicit Recorder(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace relief
