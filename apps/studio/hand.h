// The hand in the studio: a device, its session on the open document, and what it feels.
#pragma once

#include "bridge.h"
#include "tool_state.h"

#include <relief/devices/open_device.h>
#include <relief/devices/pointer_device.h>
#include <relief/session/hand_control.h>
#include <relief/session/hand_monitor.h>

#include <QObject>
#include <QTimer>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace relief::studio {

class HandSound;

/// Owns the device, the session, its recorder and its monitor. The session runs while a device is chosen and a document
/// is open, and ends before the document closes. Its ticks are taken over 60 times a second; without a device no timer
/// runs. UI thread, but for forces_off().
class Hand : public QObject {
  Q_OBJECT
 public:
  Hand(DocumentBridge& bridge, ToolState& tools, QObject* parent = nullptr);
  ~Hand() override;

  /// A device that can be chosen.
  struct Choice {
    QString id, title, status;
  };
  /// "none", "mouse", "simulated", and those of open_device(), each with what is claimed of it.
  [[nodiscard]] static std::vector<Choice> choices();

  /// How choose() comes to a device; open_device() where nobody says otherwise.
  using Opener = std::function<Result<std::unique_ptr<HapticDevice>>(const std::string& name, HandScript script)>;
  void open_devices_with(Opener open) { open_ = std::move(open); }

  /// An id of choices(), or "replay:FILE". Where no document is open, the session begins with the next one. What went
  /// wrong, said() tells.
  void choose(const QString& id);
  [[nodiscard]] const QString& id() const { return id_; }
  [[nodiscard]] QString title() const { return title_of(id_); }
  [[nodiscard]] static QString title_of(const QString& id);
  /// A session runs.
  [[nodiscard]] bool active() const { return live_ != nullptr; }
  /// A person moves the device; not equations, a recording or the mouse.
  [[nodiscard]] bool held() const;
  [[nodiscard]] bool probes() const;  ///< the device is the mouse

  // What people set. All hold for the next session as well.
  /// At once, from any thread while no device is being chosen.
  void set_forces(bool on);
  [[nodiscard]] bool forces() const { return forces_; }
  void set_force_limit(double newton);
  [[nodiscard]] double force_limit() const;
  /// Share of a device's greatest force that the limit may be, for a kiosk.
  void set_force_cap(double share);
  [[nodiscard]] double most_force() const;
  /// How large the model is in the hand, beside how it fits.
  void set_scale(double factor);
  [[nodiscard]] double scale() const { return scale_; }
  void set_clutch(bool held);
  [[nodiscard]] bool clutched() const;
  /// Puts the tool in front of the place that a ray meets, or of the model's middle.
  void recentre(const Ray3d& view);
  void set_sound(bool on);
  [[nodiscard]] bool sound() const;
  /// Why there is no sound though it is switched on; empty where there is.
  [[nodiscard]] QString sound_trouble() const;

  /// Begins a recording, with a new session.
  void record(const QString& file);
  void stop_recording();
  [[nodiscard]] bool recording() const;
  [[nodiscard]] const QString& last_recording() const { return last_recording_; }

  // The mouse as a force probe.
  void point(const Ray3d& ray, bool pressed, double pressure);
  void leave();
  /// Notches of the wheel: how deep a press goes.
  void turn_depth(double notches);
  [[nodiscard]] double probe_depth() const { return depth_; }  ///< m at the hand

  [[nodiscard]] const HandMonitor& monitor() const { return monitor_; }
  [[nodiscard]] HandSafety safety() const { return monitor_.safety().now(); }
  /// m per model unit, of the session.
  [[nodiscard]] double metres_per_unit() const;

 signals:
  /// The device, forces, limits, clutch, recording or sound.
  void changed();
  /// So many new ticks are in monitor().
  void ticked(int count);
  void safetyChanged();
  /// Forces are off for a reason that people must know, or a device that was lost answers again: that is good.
  void alarm(const QString& sentence, bool good);
  void said(const QString& words);

 private:
  struct Live;

  [[nodiscard]] Result<std::unique_ptr<Live>> make_live(Document& document, const QString& recording);
  void start(const QString& recording = {});
  /// Of what is set and what the cap lets the device give, the less.
  void limit_force();
  /// Ends the session; what it did is in the document.
  void stop();
  void take_ticks();
  /// For tests, and for people who look for the cause of something.
  void log_state();
  void use_brush();
  void say(const Error& error);

  DocumentBridge& bridge_;
  ToolState& tools_;
  QString id_ = QStringLiteral("none"), last_recording_;
  bool forces_ = true;
  /// N; infinite: the device's.
  double limit_ = std::numeric_limits<double>::infinity();
  double cap_ = 1, scale_ = 1;
  double depth_;  ///< m
  Opener open_ = open_device;
  PickHint hint_;
  Ray3d ray_;
  bool has_ray_ = false;
  HandMonitor monitor_;
  HandSafety told_;
  std::uint64_t alarms_ = 0;      ///< told
  int since_log_ = 0, late_ = 0;  ///< late_: ticks since the session began
  TimeHistogram compute_;
  QTimer timer_;
  std::unique_ptr<HandSound> sound_;
  std::unique_ptr<Live> live_;
};

}  // namespace relief::studio
