// Asks how the turntable's film shall be, and makes it.
#pragma once

#include "turntable.h"

#include <QDialog>
#include <QSettings>
#include <memory>

class QComboBox;
class QDoubleSpinBox;
class QLabel;
class QLineEdit;
class QProgressBar;
class QPushButton;
class QSpinBox;

namespace relief::studio {

/// The frames are drawn on a worker, from the model as it was when that began: work on it may go on. Cancel, Esc and
/// closing end it and leave no file.
class TurntableDialog : public QDialog {
  Q_OBJECT
 public:
  /// `first`: how the view is now. `stem`: what the files are called at first.
  TurntableDialog(QSettings& settings, SnapshotPtr model, Frame first, const QString& stem, QWidget* parent = nullptr);
  ~TurntableDialog() override;
  [[nodiscard]] bool working() const { return cancel_ != nullptr; }

 signals:
  void finished_film(const QString& folder, int frames);
  void failed(const QString& why);

 public slots:
  void reject() override;

 private:
  [[nodiscard]] Turntable film() const;
  void say_rate();
  void start();
  void done_with(const Status& status, const Turntable& film);
  void set_working(bool working);

  QSettings& settings_;
  SnapshotPtr model_;
  Frame first_;
  QSpinBox* frames_;
  QDoubleSpinBox *degrees_, *seconds_;
  QComboBox* size_;
  QLineEdit *folder_, *stem_;
  QLabel* rate_;
  QPushButton *choose_, *start_, *cancel_button_;
  QProgressBar* progress_;
  std::shared_ptr<std::atomic<bool>> cancel_;  ///< of the film that is being made; null: none is
};

}  // namespace relief::studio
