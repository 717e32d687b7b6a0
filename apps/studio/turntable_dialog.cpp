#include "turntable_dialog.h"

#include "background.h"
#include "preferences.h"
#include "text.h"
#include "widgets/theme.h"

#include <QComboBox>
#include <QDir>
#include <QDoubleSpinBox>
#include <QFileDialog>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QLineEdit>
#include <QLocale>
#include <QProgressBar>
#include <QPushButton>
#include <QSpinBox>
#include <QVBoxLayout>
#include <array>

namespace relief::studio {

namespace {

/// Sizes that films have; the first is that of the view, made even, as most film formats want it.
constexpr std::array<std::array<int, 2>, 4> kSizes = {{{1280, 720}, {1920, 1080}, {2560, 1440}, {3840, 2160}}};

}  // namespace

TurntableDialog::TurntableDialog(QSettings& settings, SnapshotPtr model, Frame first, const QString& stem,
                                 QWidget* parent)
    : QDialog(parent), settings_(settings), model_(std::move(model)), first_(std::move(first)) {
  setObjectName(QStringLiteral("turntable"));
  setWindowTitle(tr("Save a turntable"));
  auto* column = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  column->addLayout(form);
  const auto named = [](QWidget* control, const QString& id, const QString& name) {
    control->setObjectName(id);
    control->setAccessibleName(name);
  };
  frames_ = new QSpinBox(this);
  frames_->setRange(1, 9999);
  frames_->setValue(settings.value("turntable/frames", 72).toInt());
  named(frames_, QStringLiteral("turntable-frames"), tr("Pictures"));
  form->addRow(tr("Pictures"), frames_);
  seconds_ = new QDoubleSpinBox(this);
  seconds_->setRange(0.1, 3600);
  seconds_->setDecimals(1);
  seconds_->setSuffix(QStringLiteral(" s"));
  seconds_->setValue(settings.value("turntable/seconds", 3).toDouble());
  named(seconds_, QStringLiteral("turntable-seconds"), tr("Length"));
  rate_ = new QLabel(this);
  rate_->setProperty("role", QStringLiteral("dim"));
  auto* length = new QHBoxLayout;
  length->addWidget(seconds_);
  length->addWidget(rate_, 1);
  form->addRow(tr("Length"), length);
  degrees_ = new QDoubleSpinBox(this);
  degrees_->setRange(-3600, 3600);
  degrees_->setDecimals(0);
  degrees_->setSuffix(QStringLiteral("°"));
  degrees_->setValue(settings.value("turntable/degrees", 360).toDouble());
  named(degrees_, QStringLiteral("turntable-degrees"), tr("Turn"));
  form->addRow(tr("Turn"), degrees_);
  size_ = new QComboBox(this);
  size_->addItem(tr("As the view: %1 × %2").arg(first_.width & ~1).arg(first_.height & ~1),
                 QSize(first_.width & ~1, first_.height & ~1));
  for (const auto& [width, height] : kSizes)
    size_->addItem(QStringLiteral("%1 × %2").arg(width).arg(height), QSize(width, height));
  size_->setCurrentIndex(std::clamp(settings.value("turntable/size", 2).toInt(), 0, size_->count() - 1));
  named(size_, QStringLiteral("turntable-size"), tr("Size"));
  form->addRow(tr("Size"), size_);
  stem_ = new QLineEdit(stem, this);
  named(stem_, QStringLiteral("turntable-stem"), tr("Name"));
  form->addRow(tr("Name"), stem_);
  folder_ = new QLineEdit(chosen(settings, "folders/pictures").toString() + QLatin1Char('/') + stem, this);
  folder_->setMinimumWidth(scaled(300));
  named(folder_, QStringLiteral("turntable-folder"), tr("Folder"));
  choose_ = new QPushButton(tr("Choose …"), this);
  choose_->setAutoDefault(false);
  auto* place = new QHBoxLayout;
  place->addWidget(folder_, 1);
  place->addWidget(choose_);
  form->addRow(tr("Folder"), place);
  progress_ = new QProgressBar(this);
  progress_->setObjectName(QStringLiteral("turntable-progress"));
  progress_->setAccessibleName(tr("Pictures drawn"));
  progress_->setVisible(false);
  column->addWidget(progress_);
  column->addStretch(1);
  auto* buttons = new QHBoxLayout;
  buttons->addStretch(1);
  cancel_button_ = new QPushButton(this);
  cancel_button_->setObjectName(QStringLiteral("turntable-cancel"));
  cancel_button_->setAutoDefault(false);
  start_ = new QPushButton(tr("Save"), this);
  start_->setObjectName(QStringLiteral("turntable-save"));
  start_->setProperty("role", QStringLiteral("primary"));
  start_->setDefault(true);
  buttons->addWidget(cancel_button_);
  buttons->addWidget(start_);
  column->addLayout(buttons);
  connect(frames_, &QSpinBox::valueChanged, this, &TurntableDialog::say_rate);
  connect(seconds_, &QDoubleSpinBox::valueChanged, this, &TurntableDialog::say_rate);
  connect(choose_, &QPushButton::clicked, this, [this] {
    const QString chosen = QFileDialog::getExistingDirectory(this, tr("Folder"), folder_->text());
    if (!chosen.isEmpty()) folder_->setText(chosen);
  });
  connect(start_, &QPushButton::clicked, this, &TurntableDialog::start);
  connect(cancel_button_, &QPushButton::clicked, this, &TurntableDialog::reject);
  say_rate();
  set_working(false);
}

TurntableDialog::~TurntableDialog() {
  if (cancel_) *cancel_ = true;
}

Turntable TurntableDialog::film() const {
  const QSize size = size_->currentData().toSize();
  QString stem = stem_->text().trimmed().replace(QLatin1Char('/'), QLatin1Char('-'));
  if (stem.isEmpty()) stem = QStringLiteral("turntable");
  return {.folder = QDir::cleanPath(folder_->text()),
          .stem = stem,
          .frames = frames_->value(),
          .degrees = degrees_->value(),
          .seconds = seconds_->value(),
          .width = std::max(2, size.width()),
          .height = std::max(2, size.height())};
}

void TurntableDialog::say_rate() {
  rate_->setText(tr("%1 pictures a second").arg(QLocale().toString(frames_->value() / seconds_->value(), 'f', 1)));
}

void TurntableDialog::set_working(bool working) {
  for (QWidget* each :
       std::initializer_list<QWidget*>{frames_, seconds_, degrees_, size_, stem_, folder_, choose_, start_})
    each->setEnabled(!working);
  progress_->setVisible(working);
  cancel_button_->setText(working ? tr("Cancel") : tr("Close"));
}

void TurntableDialog::start() {
  const Turntable asked = film();
  if (!QDir().mkpath(asked.folder)) {
    emit failed(tr("The folder %1 cannot be made. Choose another one.").arg(asked.folder));
    return;
  }
  settings_.setValue("turntable/frames", asked.frames);
  settings_.setValue("turntable/seconds", asked.seconds);
  settings_.setValue("turntable/degrees", asked.degrees);
  settings_.setValue("turntable/size", size_->currentIndex());
  progress_->setRange(0, asked.frames);
  progress_->setValue(0);
  set_working(true);
  cancel_ = std::make_shared<std::atomic<bool>>(false);
  const auto told = [guard = QPointer(progress_)](int done) {
    QMetaObject::invokeMethod(
        QCoreApplication::instance(),
        [guard, done] {
          if (guard) guard->setValue(done);
        },
        Qt::QueuedConnection);
  };
  in_background(
      this,
      [model = model_, first = first_, asked, told, cancel = cancel_] {
        return draw_turntable(*model, first, asked, told, *cancel);
      },
      [this, asked](const Status& status) { done_with(status, asked); });
}

void TurntableDialog::done_with(const Status& status, const Turntable& film) {
  cancel_.reset();
  set_working(false);
  if (status) {
    emit finished_film(film.folder, film.frames);
    QDialog::accept();
  } else if (status.error().code != Errc::Cancelled) {
    emit failed(error_text(status.error()));
  }
}

/// While a film is made: ends it, and stays open for another try. Else closes.
void TurntableDialog::reject() {
  if (cancel_)
    *cancel_ = true;
  else
    QDialog::reject();
}

}  // namespace relief::studio
