// Where files are dropped, with a button for those who do not drag.
#pragma once

#include <QStringList>
#include <QWidget>

class QLabel;
class QPushButton;

namespace relief::studio {

class DropArea : public QWidget {
  Q_OBJECT
 public:
  /// `suffixes`: of the names of files that are taken, without the dot, in small letters.
  DropArea(const QString& title, const QStringList& suffixes, QWidget* parent = nullptr);

  /// Those of the dropped addresses that are local files and have such a suffix, in any case.
  [[nodiscard]] QStringList taken(const QList<QUrl>& addresses) const;

  QSize minimumSizeHint() const override;

 signals:
  void dropped(const QStringList& files);
  void browseRequested();

 protected:
  void paintEvent(QPaintEvent* event) override;
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dragLeaveEvent(QDragLeaveEvent* event) override;
  void dropEvent(QDropEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  enum class Over { Nothing, Welcome, Unknown };
  void set_over(Over over);
  void show_icon();
  [[nodiscard]] QColor edge() const;

  QStringList suffixes_;
  Over over_ = Over::Nothing;
  QLabel *icon_, *title_, *hint_;
  QPushButton* browse_;
};

}  // namespace relief::studio
