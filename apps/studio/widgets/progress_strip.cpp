#include "progress_strip.h"

#include "accessible.h"
#include "theme.h"

#include <QGridLayout>
#include <QLabel>
#include <QProgressBar>
#include <QPushButton>
#include <algorithm>
#include <chrono>
#include <cmath>

namespace relief::studio {

namespace {

constexpr int kSteps = 1000;  // of the bar

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ProgressStrip::ProgressStrip(QWidget* parent, Clock clock)
    : QWidget(parent),
      clock_(clock ? std::move(clock) : steady_seconds),
      phase_(new QLabel),
      left_(new QLabel),
      bar_(new QProgressBar),
      cancel_(new QPushButton(tr("Cancel"))) {
  setObjectName(QStringLiteral("progress_strip"));
  phase_->setObjectName(QStringLiteral("progress_strip.phase"));
  left_->setObjectName(QStringLiteral("progress_strip.left"));
  left_->setProperty("role", QStringLiteral("dim"));
  bar_->setObjectName(QStringLiteral("progress_strip.bar"));
  bar_->setAccessibleName(tr("Convert progress"));
  bar_->setRange(0, kSteps);
  bar_->setTextVisible(false);
  cancel_->setObjectName(QStringLiteral("progress_strip.cancel"));
  cancel_->setAccessibleName(tr("Cancel"));
  cancel_->setAccessibleDescription(tr("Stops the work and leaves everything as it was before."));
  cancel_->setToolTip(cancel_->accessibleDescription());
  connect(cancel_, &QPushButton::clicked, this, &ProgressStrip::cancel);
  auto* layout = new QGridLayout(this);
  layout->setContentsMargins(12, 8, 12, 8);
  layout->setVerticalSpacing(4);
  layout->addWidget(phase_, 0, 0);
  layout->addWidget(left_, 0, 1, Qt::AlignTrailing);
  layout->addWidget(bar_, 1, 0, 1, 2);
  layout->addWidget(cancel_, 0, 2, 2, 1);
  layout->setColumnStretch(0, 1);
  hide();
}

void ProgressStrip::start(const QString& phase) {
  began_ = clock_();
  fraction_ = 0;
  cancelled_ = false;
  cancel_->setEnabled(true);
  phase_->setText(phase);
  show_state();
  show();
}

void ProgressStrip::set_progress(const QString& phase, double fraction) {
  if (cancelled_) return;
  fraction_ = std::clamp(fraction, fraction_, 1.0);
  phase_->setText(phase);
  show_state();
}

void ProgressStrip::finish() { hide(); }

QString ProgressStrip::time_left() const {
  const double elapsed = clock_() - began_;
  if (elapsed < kShowTimeAfter || fraction_ <= 0 || cancelled_) return {};
  const double left = elapsed * (1 - fraction_) / fraction_;
  const int minutes = static_cast<int>(std::ceil(left / 60));
  if (left > 90) return tr("About %1 min left").arg(minutes);
  // In steps of five, so that it does not flicker from second to second.
  return tr("About %1 s left").arg(std::max(5, 5 * static_cast<int>(std::ceil(left / 5))));
}

void ProgressStrip::show_state() {
  bar_->setValue(static_cast<int>(std::lround(kSteps * fraction_)));
  const QString left = time_left();
  left_->setText(left);
  const QString share = tr("%1 %").arg(static_cast<int>(std::floor(100 * fraction_)));
  describe(bar_, QStringList{phase_->text(), share, left}.join(QStringLiteral(", ")));
}

void ProgressStrip::cancel() {
  cancelled_ = true;
  cancel_->setEnabled(false);
  phase_->setText(tr("Stopping …"));
  show_state();
  emit cancelRequested();
}

}  // namespace relief::studio
