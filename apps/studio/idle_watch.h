// Notices that nobody is there any more.
#pragma once

#include <QObject>
#include <QTimer>

namespace relief::studio {

/// Counts seconds without input. After `patience` of them it counts down from ten aloud, and expires at zero; any
/// input before that begins anew.
class IdleWatch : public QObject {
  Q_OBJECT
 public:
  explicit IdleWatch(QObject* parent = nullptr);
  static constexpr int kCountdown = 10;  ///< s

  /// Begins to count, with this patience in seconds.
  void start(int patience);
  void stop();
  /// How long a second of it lasts, for tests that count themselves; 1000 ms otherwise.
  void set_second(int ms) { timer_.setInterval(ms); }
  [[nodiscard]] bool counting_down() const { return idle_ >= patience_ && timer_.isActive(); }

 public slots:
  /// Somebody is there.
  void activity();
  /// A second has gone by; the watch's own timer calls it.
  void tick();

 signals:
  void countdown(int seconds_left);
  /// Somebody came back in time.
  void resumed();
  void expired();

 private:
  QTimer timer_;
  int patience_ = 0, idle_ = 0;
};

}  // namespace relief::studio
