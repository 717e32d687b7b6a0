// A device's servo at work on a document: touch and sculpt live.
#pragma once

#include <relief/haptics/servo_thread.h>
#include <relief/session/document.h>
#include <relief/session/recorder.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

namespace relief {

/// Holds what a session has counted; what its strokes did, the document's statistics say.
struct SessionStats {
  ServoTimes servo;                   ///< after stop()
  std::uint64_t samples = 0;          ///< ticks with a reading that reached the session's thread
  std::uint64_t contact_samples = 0;  ///< ticks in contact
  std::uint64_t strokes = 0;          ///< begun
  std::uint64_t points = 0;           ///< of them
  double force_max = 0;               ///< N
  double depth_max = 0;               ///< model units
  std::uint64_t flagged_samples = 0;  ///< with any fault bit
  std::uint32_t flags = 0;            ///< all fault bits that were set
  ServoSample last = {};              ///< the newest tick's
};

/// Says how the hand's contact becomes strokes.
struct SculptSettings {
  double points_per_second = 250;  ///< of contact; the paper's dabs came 10 times a second
  double full_depth = 0;           ///< model units: penetration that counts as pressure 1
  double light_depth = 0;          ///< up to this depth pressure is 0 (paper, Sec. 5)
  StrokeSource source = 1;         ///< whose strokes the hand's are
};

/// Owns a servo thread, and a thread that makes commands for a document of what it felt. While button 0 of the device
/// is down and the tip touches, and the servo is not in its safe state, the cursor's way is a stroke of the brush, as
/// that of a tool's tip. It lasts until the button is released, or the tip has been away from the surface for 50 ms, or
/// the servo goes into its safe state: in it the hand feels nothing, so it must not cut anything either.
class Session {
 public:
  /// Holds what a session can be told at its start.
  struct Settings {
    ServoSettings servo = {};    ///< for the servo
    SculptSettings sculpt = {};  ///< for the strokes
    LossSettings loss = {};      ///< for a device that drops out
    /// Called by the session's thread with each tick, in their order, also with those in which the device did not
    /// answer. It must not wait: strokes wait for it.
    std::function<void(const ServoTick&)> on_tick = {};
  };
  /// `device`, `document` and `recorder` (may be null) must outlive the session. The recorder must have been made with
  /// the document's head and the same settings, and watches the document; stop() finishes it.
  Session(HapticDevice& device, Document& document, const Settings& settings, Recorder* recorder = nullptr);
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
  /// False: no force from the next tick on, and an open stroke ends; true again: forces come back once the hand has
  /// lifted off (ServoThread::set_forces). Any thread, wait-free.
  void set_forces(bool on) noexcept;
  /// Returns whether the hand is read.
  [[nodiscard]] bool running() const noexcept;
  /// When the device did not answer. Any thread.
  [[nodiscard]] std::vector<DeviceLoss> losses() const;
  /// Any thread.
  [[nodiscard]] SessionStats stats() const;
  /// Stops the servo, ends an open stroke, joins both threads; the strokes are then in the document, which saves them.
  /// Error: that of the recording.
  [[nodiscard]] Status stop();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace relief
