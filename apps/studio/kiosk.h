// Relief for visitors of an exhibition: models to touch, and no way to anything else.
#pragma once

#include "bridge.h"
#include "exhibits.h"
#include "hand.h"
#include "idle_watch.h"
#include "kiosk_log.h"
#include "tool_state.h"

#include <QPointF>
#include <QSettings>
#include <QTimer>
#include <QWidget>
#include <atomic>
#include <memory>
#include <optional>
#include <set>

class QApplication;
class QFrame;
class QLabel;
class QLineEdit;
class QStackedWidget;

namespace relief::studio {

class KioskChoose;
class KioskStage;

/// Full screen. Visitors work on a private copy of each model, without its history; the original is only read. When
/// nobody is there for the exhibit's patience, the copy is given up, and the models turn slowly until somebody comes.
/// Nothing closes the window but the keys and the code for it (docs/how-to/kiosk.md).
class Kiosk : public QWidget {
  Q_OBJECT
 public:
  /// `language` is the one that each visit begins with; `device` as in Hand::choose(), or empty. UI thread.
  Kiosk(std::vector<Exhibit> exhibits, const QSettings& settings, QString language, const QString& device = {});
  ~Kiosk() override;

  /// What visitors see now.
  enum class Page : std::uint8_t { Choose, Loading, Model, Attract };
  [[nodiscard]] Page page() const { return page_; }
  [[nodiscard]] IdleWatch& watch() { return watch_; }
  [[nodiscard]] DocumentBridge& bridge() { return bridge_; }
  [[nodiscard]] Hand& hand() { return hand_; }
  [[nodiscard]] const Exhibit& exhibit() const { return exhibits_[current_]; }
  void open(std::size_t exhibit);

 public slots:
  /// Somebody is there: for input that does not come through Qt.
  void activity();
  /// Where the tip of the device is, m: somebody holds it when it is more than 2 mm from where it last moved to.
  void hand_at(relief::Vec3d at);

 signals:
  void pageChanged();

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;
  void closeEvent(QCloseEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;

 private:
  struct Loaded;
  void build_covers();
  void show_page(Page page);
  void speak(const QString& language);
  void say_words();
  void load(std::size_t exhibit, Page then);
  void tell_load(quint64 serial, double share);
  void loaded(std::size_t exhibit, Loaded& made, Page then);
  void drop(std::size_t exhibit, const QString& why);
  void close_copy();
  void attract_next();
  void turn();
  void count(int seconds_left);
  void expired();
  void draw_pictures();
  void ask_code();
  void check_code();
  void log(const QString& page, const QString& words);
  [[nodiscard]] bool is_input(const QEvent& event);

  std::vector<Exhibit> exhibits_;
  std::set<std::size_t> broken_;
  QString code_, first_language_, language_, folder_;
  double most_force_;  ///< of the preferences, as a share of what the device can give
  KioskLog log_;
  DocumentBridge bridge_;
  ToolState tools_;
  Hand hand_{bridge_, tools_};
  IdleWatch watch_;
  Page page_ = Page::Choose;
  std::size_t current_ = 0;
  quint64 serial_ = 0;                            ///< of the last load: what an older one brings is not wanted any more
  std::shared_ptr<std::atomic<bool>> stop_load_;  ///< of the last load
  QString copy_;                                  ///< the private file that is open
  QTimer turn_timer_, next_timer_, code_timer_;
  QPointF last_pointer_;
  std::optional<Vec3d> last_hand_;
  bool leaving_ = false;

  QStackedWidget* pages_;
  KioskChoose* choose_;
  KioskStage* stage_;
  QWidget* cover_;
  QLabel *cover_title_, *cover_words_;
  QFrame *count_, *code_frame_;
  QLabel* count_words_;
  QLineEdit* code_line_;
};

/// Reads the exhibits, shows them until somebody leaves with the code, and returns the exit status: 1 with one sentence
/// on standard error, before any window, where a model or caption is bad.
int run_kiosk(QApplication& application, const QStringList& models_or_folders, const QSettings& settings,
              const QString& language, const QString& device);

}  // namespace relief::studio
