// Says what could not be done, why, and what can be done now.
#pragma once

#include <QDialog>
#include <functional>

class QHBoxLayout;

namespace relief::studio {

/// Deletes itself when it is closed.
class FailureDialog : public QDialog {
  Q_OBJECT
 public:
  /// `title`: what could not be done; `why`: one sentence.
  FailureDialog(const QString& title, const QString& why, const QString& file, QWidget* parent);
  /// A button that closes the dialog and does something about it.
  void add_remedy(const QString& words, std::function<void()> call);

 private:
  QHBoxLayout* buttons_;
};

}  // namespace relief::studio
