// The window: what is around the picture, and how the parts hear of each other.
#pragma once

#include "bridge.h"
#include "file_desk.h"
#include "tool_state.h"
#include "viewport.h"

#include <QActionGroup>
#include <QMainWindow>
#include <QSettings>

#include <map>
#include <memory>

class QLabel;
class QStackedWidget;
class QToolBar;
class QToolButton;
class QProgressBar;

namespace relief::studio {

class Banner;
class CommandPalette;
class ForceMeter;
class DevicePanel;
class Hand;
class HandOverlay;
class HistoryPanel;
class LayersPanel;
class PanicKeys;
class StartPage;
class ToolPanel;
class ValueBar;

class MainWindow : public QMainWindow {
  Q_OBJECT
 public:
  explicit MainWindow(QSettings& settings);
  ~MainWindow() override;

  /// A model or a scan.
  void open(const QString& file);
  [[nodiscard]] Viewport& viewport() { return *viewport_; }
  /// "simulated", "mouse", "replay:FILE" (Hand::choose()).
  void use_device(const QString& id);

 protected:
  void closeEvent(QCloseEvent* event) override;
  void changeEvent(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  // main_window.cpp
  void build_bars();
  void build_docks();
  void connect_document();
  void connect_files();
  void connect_view();
  void show_verdict(const std::optional<Verdict>& verdict, const QString& doubt);
  void show_failure(const QString& title, const QString& why, const QString& file, bool damaged);
  void refresh();
  void say(const QString& words);
  void say_state();
  /// What must not be missed: across the top until somebody has read it.
  void warn(const QString& sentence);
  void keep_picture();
  QDockWidget* add_dock(const QString& id, const QString& title, QWidget* content);

  // actions.cpp
  void build_actions();
  QAction* add(const QString& id, const QString& title, const QKeySequence& key, std::function<void()> call);
  void build_menus();
  void use_look(const Look& look);
  void use_theme();

  // hand_actions.cpp
  void build_hand();
  void build_hand_actions();
  void connect_hand();
  void recentre_hand();
  void record_hand(bool on);
  void show_hand();
  void show_forces_off();
  void show_hand_state();
  void show_hand_tick();

  // file_actions.cpp
  void ask_open();
  void ask_save_as();
  void ask_export();
  void ask_picture();
  void save_picture(const QString& file);

  QSettings& settings_;
  DocumentBridge bridge_;
  ToolState tools_;
  FileDesk desk_;
  std::map<QString, QAction*> actions_;
  QActionGroup* tool_group_ = nullptr;

  QStackedWidget* pages_ = nullptr;
  StartPage* start_ = nullptr;
  Viewport* viewport_ = nullptr;
  QToolBar *top_ = nullptr, *column_ = nullptr;
  ValueBar *radius_ = nullptr, *strength_ = nullptr;
  QToolButton* device_ = nullptr;
  Hand* hand_ = nullptr;
  std::unique_ptr<HandOverlay> hand_overlay_;
  DevicePanel* device_panel_ = nullptr;
  QMenu* devices_ = nullptr;
  PanicKeys* panic_ = nullptr;
  Banner* banner_ = nullptr;
  ForceMeter* meter_ = nullptr;
  bool forces_off_shown_ = false;
  ToolPanel* tool_panel_ = nullptr;
  LayersPanel* layers_ = nullptr;
  HistoryPanel* history_ = nullptr;
  CommandPalette* palette_ = nullptr;
  std::vector<QDockWidget*> docks_;
  QWidget* convert_ = nullptr;
  QLabel *status_ = nullptr, *facts_ = nullptr, *drawing_ = nullptr;
  std::optional<Verdict> verdict_;
  Unit unit_ = Unit::Millimetre;
  bool limit_told_ = false;
};

}  // namespace relief::studio
