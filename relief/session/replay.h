// What can be done with a recording: check it bit for bit, compare other settings on the same motion, play it again.
#pragma once

#include <relief/base/error.h>
#include <relief/base/progress.h>
#include <relief/core/room.h>
#include <relief/core/snapshot.h>
#include <relief/file/model_file.h>
#include <relief/file/recording.h>
#include <relief/haptics/replay_device.h>
#include <relief/haptics/servo_thread.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace relief {

/// Columns of ticks in which the greatest number means that there is none, for exports.
inline constexpr std::array<std::string_view, 1> kSlabOrNone = {"slab"};

/// A tick as it was recorded.
struct RecordedTick {
  std::uint64_t clock_ns = 0;  ///< CLOCK_MONOTONIC at the wake-up; 0 along a path
  std::uint32_t settings = 0;  ///< how many changes of the settings had been taken over
  std::uint64_t model = 0;     ///< 0: the snapshot at the start; one more with each that followed
  DeviceState reading;         ///< what the device said
  ServoSample sample;          ///< what the servo made of it
};

/// An open recording whose head has been understood. One thread at a time.
class Replay {
 public:
  /// Errors: those of Recording::open(); Corrupt.
  [[nodiscard]] static Result<Replay> open(const std::filesystem::path& file);
  /// Takes over; the other one may only be destroyed or assigned to.
  Replay(Replay&&) noexcept;
  /// Takes over; the other one may only be destroyed or assigned to.
  Replay& operator=(Replay&&) noexcept;
  ~Replay();

  /// Returns the recording that is read.
  [[nodiscard]] Recording& recording() noexcept;
  /// Returns the recording that is read.
  [[nodiscard]] const Recording& recording() const noexcept;
  /// Returns the device that was recorded.
  [[nodiscard]] const DeviceInfo& device() const noexcept;
  /// Returns those at the start, then each change.
  [[nodiscard]] const std::vector<ServoSettings>& settings() const noexcept;
  /// Returns the version of the force law under which it was made (kContactLaw). Under another one the same readings
  /// give other forces.
  [[nodiscard]] int contact_law() const noexcept;
  /// Returns what the recording has that this program does not know, and would have to know to repeat it; empty if
  /// nothing.
  [[nodiscard]] const std::string& unknown() const noexcept;

  /// Returns the next tick; false at the end, and then from the start again. Of a recording that was cut short, the end
  /// is where what a tick needs (its settings) is missing. Error: Corrupt.
  [[nodiscard]] Result<bool> next(std::uint64_t& number, RecordedTick& tick);
  /// Begins again at the first tick.
  void rewind() noexcept;
  /// Returns what the device gave, for a ReplayDevice. Errors: Corrupt, Cancelled.
  [[nodiscard]] Result<std::vector<DeviceState>> readings(const Progress& progress = {});

  struct State;
  /// Returns what holds at the tick that was read last.
  [[nodiscard]] const State& state() const noexcept { return *state_; }

 private:
  explicit Replay(std::unique_ptr<State> state) noexcept;
  std::unique_ptr<State> state_;
};

/// What a device's name begins with where it is a recording; the file's name follows.
inline constexpr std::string_view kReplayDevice = "replay:";

/// A recording as a device.
struct PlayedDevice {
  Replay replay;                         ///< what it was made with
  std::unique_ptr<HapticDevice> device;  ///< the recording as a device
  /// Returns whether the recording was made with this model.
  [[nodiscard]] bool was_made_with(const Snapshot& model) const;
};
/// Errors: those of Replay::open(); Corrupt, Cancelled.
[[nodiscard]] Result<PlayedDevice> play_as_device(const std::filesystem::path& file, const Progress& progress = {});

/// Returns the model that was recorded: `instead` where given, else where the recording says, else the file of that
/// name beside the recording; as it was after the strokes that it had then. `opened` gets the file that was found, to
/// ask it for a doubt() perhaps. Errors: NotFound, InvalidArgument (another model), those of ModelFile::open() and of
/// `opened`.
[[nodiscard]] Result<SnapshotPtr> find_model(
    const Replay& replay, const std::filesystem::path& instead = {},
    const std::function<Status(const std::filesystem::path&, const ModelFile&)>& opened = {},
    const Progress& progress = {});

/// Holds what verify() found.
struct Verification {
  std::uint64_t ticks = 0;    ///< recorded
  std::uint64_t checked = 0;  ///< from the first on, all of them the same bit for bit
  /// The first number that differs: empty when all that could be checked is the same.
  struct Difference {
    std::uint64_t tick = 0;  ///< the first tick that differs
    double t = 0;            ///< its time, s
    std::string field;       ///< what differs
    /// the recorded value, and the one of now
    std::string recorded, now;
  };
  std::optional<Difference> difference;  ///< the first one, if there is one
  /// Why the ticks from `checked` on could not be checked; empty when all were.
  std::string stopped;
  /// Numbers that the recording lacks: outputs were not compared, inputs and settings are their defaults.
  std::vector<std::string> missing;
  int contact_law = kContactLaw;  ///< under which it was recorded; under another one, differences are expected
  /// Returns whether every tick is as it was recorded.
  [[nodiscard]] bool holds() const noexcept { return !difference && stopped.empty(); }
};

/// Runs a new servo over the recorded readings, with the recorded settings and edits, and compares all that it gives.
/// `make_room` is that of the recorded document (DocumentSettings::make_room); it is called where its strokes got room.
/// Errors: InvalidArgument (the recording needs what this program does not know, or a RoomMaker), Corrupt, Cancelled.
[[nodiscard]] Result<Verification> verify(Replay& replay, const SnapshotPtr& model, const RoomMaker& make_room = {},
                                          const Progress& progress = {});

/// The same motion with the recorded settings and with others. The hand does not answer: what it would have done under
/// the other force is not known.
struct Comparison {
  std::uint64_t ticks = 0;     ///< ticks that were compared
  double force_rms = 0;        ///< N, of the recorded settings' force, over the ticks where either force is not zero
  double error_rms = 0;        ///< N, of the difference of the forces, over the same ticks
  double error_max = 0;        ///< N
  std::uint64_t error_at = 0;  ///< the tick of error_max
  double direction_rms = 0;    ///< degrees between the forces, over the ticks where both are above 0.05 N
  double direction_max = 0;    ///< degrees
  std::uint64_t contact = 0;   ///< ticks in contact with the recorded settings
  std::uint64_t contact_differs = 0;  ///< ticks in which only one of the two touches
  /// thread CPU time of step()
  TimeHistogram cost, other_cost;
};
/// `change` is applied to all recorded settings. Where ticks were dropped it goes on. Errors as verify().
[[nodiscard]] Result<Comparison> compare(Replay& replay, const SnapshotPtr& model,
                                         const std::function<void(ServoSettings&)>& change,
                                         const RoomMaker& make_room = {}, const Progress& progress = {});

}  // namespace relief
