// Device, servo, editor and file at work together: touch and sculpt live.
#pragma once

#include <relief/core/snapshot_channel.h>
#include <relief/edit/editor.h>
#include <relief/file/model_file.h>
#include <relief/haptics/servo_thread.h>
#include <relief/session/recorder.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace relief {

/// What a session counted; taken after stop().
struct SessionStats {
  ServoTimes servo;
  std::uint64_t samples = 0;  ///< ticks with a reading that reached the edit thread
  std::uint64_t contact_samples = 0;
  std::uint64_t dabs = 0;
  std::uint64_t samples_edited = 0;
  std::uint64_t strokes = 0;
  TimeHistogram dab_time;             ///< thread CPU time of one dab with undo and publishing
  double force_max = 0;               ///< N
  double depth_max = 0;               ///< model units
  std::uint64_t flagged_samples = 0;  ///< with any fault bit
  std::uint32_t flags = 0;            ///< all fault bits that were set
};

/// How the hand's contact becomes dabs.
struct SculptSettings {
  double dabs_per_second = 250;  ///< of contact; the paper used 10
  double full_depth = 0;         ///< model units: penetration that counts as pressure 1
  double turn_time = 0.15;  ///< s: the tool's axis follows the surface normal with this time constant; 0 at once, as in
                            ///< the paper, where each dent that the tool makes turns it and cuts the next dent askew
  double light_depth = 0;   ///< up to this depth pressure is 0 (paper, Sec. 5)
};

/// Owns the servo thread and the edit thread. The caller's thread may draw what reader() sees meanwhile. While button 0
/// of the device is down and the tip touches, and the servo is not in its safe state, dabs are made with the brush; a
/// stroke lasts from press to release. With a file, each finished stroke is committed.
class Session {
 public:
  struct Settings {
    ServoSettings servo = {};
    SculptSettings sculpt = {};
    LossSettings loss = {};
    /// Called by the edit thread with each tick, in their order, also with those in which the device did not answer. It
    /// must not wait: strokes wait for it.
    std::function<void(const ServoTick&)> on_tick = {};
  };
  /// `device`, and `file` and `recorder` (may be null), must outlive the session. The recorder must have been made with
  /// the same head and settings; stop() finishes it.
  Session(HapticDevice& device, SnapshotPtr head, ModelFile* file, const Settings& settings,
          Recorder* recorder = nullptr);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  /// The brush of strokes that begin after the call. Any thread.
  void set_brush(const Brush& brush);
  /// Brush chosen by the buttons word of the reading at which a stroke begins: bits 8 and up are its number in this
  /// list.
  void set_brushes(std::vector<Brush> brushes);
  /// Takes effect within a tick or two. One thread. False when too many changes are waiting.
  bool set_servo(const ServoSettings& settings);
  /// For drawing meanwhile, on one other thread each. Readers must be gone before the session is.
  [[nodiscard]] SnapshotChannel::Reader reader();
  [[nodiscard]] bool running() const noexcept;
  /// When the device did not answer. Any thread.
  [[nodiscard]] std::vector<DeviceLoss> losses() const;
  /// Stops the servo, finishes an open stroke, joins both threads. What could not be saved
  /// meanwhile is tried once more; the error of the file, if it still fails, else that of the recording.
  [[nodiscard]] Status stop();
  /// How the recording ended: it and the file end each for itself. After stop().
  [[nodiscard]] const Status& recorded() const noexcept;
  [[nodiscard]] const SnapshotPtr& head() const noexcept;    ///< after stop()
  [[nodiscard]] const SessionStats& stats() const noexcept;  ///< after stop()

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relief
