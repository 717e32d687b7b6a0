// The first page of a kiosk: what can be touched here.
#pragma once

#include "exhibits.h"

#include <QScrollArea>

class QLabel;
class QToolButton;
class QVBoxLayout;

namespace relief::studio {

/// A large picture with a title for each exhibit.
class KioskChoose : public QScrollArea {
  Q_OBJECT
 public:
  explicit KioskChoose(const std::vector<Exhibit>& exhibits, QWidget* parent = nullptr);
  /// Titles and words are in this language from now on.
  void set_language(const QString& language);
  void set_picture(std::size_t exhibit, const QImage& picture);
  /// It is shown no more.
  void take_away(std::size_t exhibit);
  /// Pixels of a picture, at a ratio of 1.
  [[nodiscard]] QSize picture_size() const;

 signals:
  void chosen(int exhibit);
  /// A visitor's own language, from now on.
  void languageChosen(const QString& language);

 private:
  void add_languages(QVBoxLayout& into);

  const std::vector<Exhibit>& exhibits_;
  QLabel *heading_, *nothing_;
  std::vector<QToolButton*> cards_;
};

}  // namespace relief::studio
