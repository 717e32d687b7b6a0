// The panels at the right of the window: one under the other where there is room, else as tabs.
#pragma once

#include <QObject>
#include <QTimer>
#include <map>
#include <vector>

class QDockWidget;
class QMainWindow;
class QSettings;

namespace relief::studio {

/// What one of several panels needs, in pixels, and for how many it counts where not all get what they need.
struct PanelNeed {
  int height = 0;
  int weight = 1;
};
/// Heights for panels that share `total` pixels. Whoever needs less than a fair share gets what it needs; the others
/// share the rest by their weights. What nobody needs is the last one's.
[[nodiscard]] std::vector<int> shared_heights(const std::vector<PanelNeed>& needs, int total);

/// Docks of a window, in its right area. UI thread. Windows smaller than 1280x800 pixels, at 100 % text, have tabs.
/// What people have dragged or moved stays so, also in the next window; what they have closed, in this one.
class Docks : public QObject {
  Q_OBJECT
 public:
  Docks(QMainWindow& window, QSettings& settings);

  /// The window's from now on. `title`: on its tab and in menus; `name`: for assistive tools; `heading`: above it.
  QDockWidget* add(const QString& id, const QString& title, const QString& name, const QString& heading,
                   QWidget* content);
  /// Under another one.
  void put_under(QDockWidget& upper, QDockWidget& lower);
  [[nodiscard]] const std::vector<QDockWidget*>& all() const { return docks_; }
  void set_heading(const QDockWidget& dock, const QString& heading) const;
  /// Where several need more than there is, it counts twice; among tabs it is the one in front.
  void favour(QDockWidget* dock);

  /// Whether there is anything that panels are for. Those that people have closed stay closed.
  void set_shown(bool shown);
  /// Closes all that are open; the next call opens these again.
  void close_or_open_all();
  /// Once what happens now has been laid out: contents have become higher or lower.
  void share_soon() { soon_.start(0); }

 protected:
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  void arrange();
  void share();
  void keep_heights();
  void refresh();
  void give_titles();
  void raise_first();
  /// Those that stand one under the other.
  [[nodiscard]] std::vector<QDockWidget*> column() const;

  QMainWindow& window_;
  QSettings& settings_;
  std::vector<QDockWidget*> docks_, closed_, closed_together_;
  struct Titles {
    QString tab, name;
  };
  std::map<QDockWidget*, Titles> titles_;
  QDockWidget* favoured_ = nullptr;
  bool shown_ = false, tabs_ = false, dragging_ = false;
  bool raise_ = false;  ///< when all is laid out
  QTimer soon_;
};

}  // namespace relief::studio
