// The window: what is around the picture, and how the parts hear of each other.
#pragma once

#include "bridge.h"
#include "file_desk.h"
#include "key_map.h"
#include "tool_state.h"
#include "viewport.h"

#include <relief/convert/refine.h>

#include <QActionGroup>
#include <QMainWindow>
#include <QPointer>
#include <QSettings>
#include <atomic>
#include <functional>
#include <map>
#include <memory>

class QLabel;
class QMenu;
class QFrame;
class QPushButton;
class QStackedWidget;
class QToolBar;
class QToolButton;

namespace relief::studio {

class Banner;
struct BannerAction;
class Card;
class ColourPalette;
class CommandPalette;
class ForceMeter;
class DevicePanel;
class Docks;
class Hand;
class HandOverlay;
class HistoryPanel;
class LayersPanel;
class PanicKeys;
class DesktopScheme;
class PreferencesDialog;
class ProgressStrip;
class SessionCounter;
class SplitView;
class StartPage;
class Toast;
class ToolPanel;
class ValueBar;
enum class Mood;

class MainWindow : public QMainWindow {
  Q_OBJECT
 public:
  MainWindow(QSettings& settings, const DesktopScheme& desktop);
  ~MainWindow() override;

  /// A model or a scan.
  void open(const QString& file, const std::optional<Camera>& camera = std::nullopt);
  /// Whether the window was closed only to be built anew, with which model.
  [[nodiscard]] bool wants_another() const { return wants_another_; }
  [[nodiscard]] const QString& last_file() const { return last_file_; }
  [[nodiscard]] Viewport& viewport() { return *viewport_; }
  /// What all of the window works on.
  [[nodiscard]] DocumentBridge& bridge() { return bridge_; }
  /// "simulated", "mouse", "replay:FILE" (Hand::choose()).
  void use_device(const QString& id);
  [[nodiscard]] QString device() const;

 protected:
  void closeEvent(QCloseEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  // main_window.cpp
  void build_bars();
  void build_docks();
  void refresh();
  void say(const QString& words);
  void say_in_status(const QString& words);
  /// What must not be missed: across the top, in the status line and in the log of events.
  void say_in_banner(Mood mood, const QString& words, const QString& subject, std::vector<BannerAction> actions);
  void fit_status();
  void say_state();
  void keep_picture();
  void place_over();
  void choose_colour(const QColor& colour);
  void keep_tools();

  // window_events.cpp
  void connect_document();
  void connect_files();
  void fit_tools(const Box3d& surface);
  void connect_view();
  void show_verdict(const std::optional<Verdict>& verdict, const QString& doubt);
  void show_failure(const QString& title, const QString& why, const QString& file, bool damaged);

  // actions.cpp
  void build_actions();
  QAction* add(const QString& id, const QString& title, const QKeySequence& key, std::function<void()> call);
  void add_words();
  void build_menus();
  void use_look(const Look& look);
  void refine_model(const QString& title, RefineWhere where);

  // preference_actions.cpp
  void build_preferences();
  void show_preferences(const QString& page = {});
  void use_preference(const QString& key);
  void keep_look();
  void ask_for_navigation();
  void build_anew();

  // hand_actions.cpp
  void build_hand();
  void build_hand_actions();
  void connect_hand();
  void play_recording(const QString& file);
  void recentre_hand();
  void record_hand(bool on);
  void show_hand();
  void show_forces_off();
  void show_hand_state();
  void show_hand_tick();

  // film_actions.cpp
  void build_film_actions();
  void fill_analysis_menu(QMenu& menu);
  void ask_turntable();
  void ask_report();
  void save_report(const QString& file);

  // file_actions.cpp
  void ask_open();
  [[nodiscard]] QString ask_where(const QString& title, const QString& key, const QString& otherwise,
                                  const QString& extension, const QString& filter);
  void ask_save_as();
  void ask_export();
  void export_to(const QString& file, std::function<Status(const Progress&)> work);
  void ask_picture();
  void ask_salvage(const QString& file);
  /// Long work beside the desk's has the strip of progress as long as nothing is opened. Returns what cancels it.
  std::shared_ptr<std::atomic<bool>> begin_aside(const QString& title);
  void tell_aside(const std::shared_ptr<std::atomic<bool>>& cancel, const QString& title, double share);
  void end_aside(const std::shared_ptr<std::atomic<bool>>& cancel);
  /// Such work on another thread; `done` comes on this one. Of cancelled work there is only a toast.
  void work_aside(const QString& title, std::function<Status(const Progress&)> work,
                  std::function<void(const Status&)> done);
  void save_picture(const QString& file);

  QSettings& settings_;
  const DesktopScheme& desktop_;
  KeyMap keys_;
  QPointer<PreferencesDialog> preferences_;
  bool wants_another_ = false;
  QString last_file_;
  std::optional<Camera> camera_;  ///< of the next model that is opened
  Camera camera_before_;          ///< as the model was seen that made room for the one that is being opened
  DocumentBridge bridge_;
  ToolState tools_;
  FileDesk desk_;
  std::map<QString, QAction*> actions_;
  QActionGroup* tool_group_ = nullptr;

  QStackedWidget* pages_ = nullptr;
  StartPage* start_ = nullptr;
  SplitView* views_ = nullptr;
  Viewport* viewport_ = nullptr;  ///< the first of views_
  SessionCounter* session_ = nullptr;
  QActionGroup* analysis_group_ = nullptr;
  QToolBar *top_ = nullptr, *column_ = nullptr;
  ValueBar *radius_ = nullptr, *strength_ = nullptr;
  QToolButton* device_ = nullptr;
  Hand* hand_ = nullptr;
  std::unique_ptr<HandOverlay> hand_overlay_;
  DevicePanel* device_panel_ = nullptr;
  QMenu* devices_ = nullptr;
  PanicKeys* panic_ = nullptr;
  ForceMeter* meter_ = nullptr;
  bool forces_off_shown_ = false;
  QDockWidget* device_dock_ = nullptr;
  ToolPanel* tool_panel_ = nullptr;
  LayersPanel* layers_ = nullptr;
  HistoryPanel* history_ = nullptr;
  CommandPalette* palette_ = nullptr;
  Docks* docks_ = nullptr;
  ColourPalette* colours_ = nullptr;
  QFrame* opening_ = nullptr;
  ProgressStrip* convert_ = nullptr;
  std::shared_ptr<std::atomic<bool>> aside_;   ///< cancels the work aside that the strip shows; else null
  std::shared_ptr<std::atomic<bool>> saving_;  ///< cancels a saving elsewhere; null where none goes on
  Banner* banner_ = nullptr;
  Card* card_ = nullptr;
  QPushButton* anew_ = nullptr;
  Toast* toast_ = nullptr;
  QLabel *status_ = nullptr, *facts_ = nullptr, *drawing_ = nullptr;
  std::optional<Verdict> verdict_;
  Unit unit_ = Unit::Millimetre;
  double across_ = 0;           // the model's diagonal, its units; 0: not known
  bool lean_told_ = false;      ///< in the open model: fibres lean in many places of some
  bool bar_told_ = false;       ///< what the running stroke runs into was said
  bool room_told_ = false;      ///< that room is being made under the running stroke was said
  bool making_room_ = false;    ///< the document does, under a stroke of the pointer that has not ended
  bool changing_cage_ = false;  ///< the document works on other slabs
};

}  // namespace relief::studio
