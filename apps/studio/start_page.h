// What one sees before a model is open.
#pragma once

#include "shelf.h"

#include <QScrollArea>
#include <functional>

class QVBoxLayout;

namespace relief::studio {

/// A place to drop a scan, recent models with pictures, samples, what can be done here, and what a crash has left.
class StartPage : public QScrollArea {
  Q_OBJECT
 public:
  explicit StartPage(Shelf& shelf, QWidget* parent = nullptr);
  /// A question that is asked below the drop area; `make` gives nothing once it is answered. Call again then.
  void set_question(std::function<QWidget*(QWidget* parent)> make);

 signals:
  void openAsked();
  void fileAsked(const QString& file);
  void sampleAsked(const QString& name);

 protected:
  void dragEnterEvent(QDragEnterEvent* event) override;
  void dropEvent(QDropEvent* event) override;

 private:
  void build();
  void add_recovery(QVBoxLayout& into);
  void add_drop(QVBoxLayout& into);
  void add_samples(QVBoxLayout& into);
  void add_recent(QVBoxLayout& into);
  void add_hints(QVBoxLayout& into);

  Shelf& shelf_;
  std::function<QWidget*(QWidget*)> question_;
};

}  // namespace relief::studio
