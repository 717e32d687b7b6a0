// Keys that take the force away whatever has the focus.
#pragma once

#include <QObject>
#include <functional>

namespace relief::studio {

/// Calls `off` on Pause, and on Esc twice within kTwice, also under a modal dialog. Watches the whole program while it
/// is on; the keys go on to whom they were meant for.
class PanicKeys : public QObject {
 public:
  static constexpr int kTwice = 600;  ///< ms

  explicit PanicKeys(std::function<void()> off, QObject* parent = nullptr);
  void set_on(bool on);
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  std::function<void()> off_;
  bool on_ = false;
  quint64 escape_ = 0;  ///< ms, on the window system's clock; 0: none lately
};

}  // namespace relief::studio
