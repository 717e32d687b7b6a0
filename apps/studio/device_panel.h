// The device: which one, how it is, what it feels, and what people set at it.
#pragma once

#include "hand.h"

#include <QWidget>
#include <optional>
#include <vector>

class QLabel;
class QMenu;
class QPushButton;
class QVBoxLayout;

namespace relief::studio {

class PlotView;
class ValueBar;

class DevicePanel : public QWidget {
  Q_OBJECT
 public:
  /// `devices`: the menu in which one is chosen.
  DevicePanel(Hand& hand, QMenu& devices, QWidget* parent = nullptr);
  void set_unit(Unit unit) { unit_ = unit; }

 signals:
  void recentreAsked();
  void recordAsked();
  void playAsked();

 private:
  void build_plots();
  void build_buttons();
  void lay_out_controls(QVBoxLayout& column);
  void refresh();
  void refresh_state();
  void take(int count);
  void freeze(bool on);
  void scrub(double time);
  void say_at_cursor(const QString& words);
  QPushButton* button(const QString& id, const QString& name, const QString& help, bool checkable);

  Hand& hand_;
  Unit unit_ = Unit::Millimetre;
  QPushButton* device_;
  QLabel *claim_, *state_, *at_cursor_;
  PlotView *force_ = nullptr, *depth_ = nullptr, *period_ = nullptr, *time_ = nullptr;
  QPushButton *freeze_ = nullptr, *forces_ = nullptr, *clutch_ = nullptr, *recentre_ = nullptr, *record_ = nullptr,
              *play_ = nullptr, *sound_ = nullptr;
  ValueBar *limit_ = nullptr, *scale_ = nullptr;
  QWidget* live_;  ///< what has a meaning only with a device
  std::vector<HandTick> frozen_;
  /// s, of the ticks since the session began: the longest time from one to the next, and the most that one took
  float longest_ = 0, worst_ = 0;
};

}  // namespace relief::studio
