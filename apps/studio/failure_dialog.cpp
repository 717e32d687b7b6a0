#include "failure_dialog.h"

#include "widgets/icons.h"
#include "widgets/theme.h"

#include <QApplication>
#include <QClipboard>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QVBoxLayout>

namespace relief::studio {

FailureDialog::FailureDialog(const QString& title, const QString& why, const QString& file, QWidget* parent)
    : QDialog(parent) {
  setObjectName(QStringLiteral("failure"));
  setWindowTitle(title);
  setAccessibleName(title);
  setAccessibleDescription(why);
  setAttribute(Qt::WA_DeleteOnClose);
  auto* whole = new QVBoxLayout(this);
  whole->setContentsMargins(scaled(20), scaled(18), scaled(20), scaled(16));
  auto* top = new QHBoxLayout;
  auto* sign = new QLabel(this);
  sign->setPixmap(icon_pixmap(u"warning", scaled(28), current_theme().warn, devicePixelRatioF()));
  top->addWidget(sign, 0, Qt::AlignTop);
  auto* words = new QVBoxLayout;
  auto* heading = new QLabel(title, this);
  heading->setFont(ui_font(12, QFont::DemiBold));
  heading->setWordWrap(true);
  heading->setMinimumWidth(scaled(380));
  auto* reason = new QLabel(why, this);
  reason->setWordWrap(true);
  reason->setTextInteractionFlags(Qt::TextSelectableByMouse | Qt::TextSelectableByKeyboard);
  words->addWidget(heading);
  words->addWidget(reason);
  top->addLayout(words, 1);
  whole->addLayout(top);
  whole->addSpacing(scaled(10));
  buttons_ = new QHBoxLayout;
  auto* copy = new QPushButton(tr("Copy the details"), this);
  copy->setAccessibleDescription(tr("Copies the sentence and the file's name, for a report"));
  connect(copy, &QPushButton::clicked, this, [title, why, file] {
    QApplication::clipboard()->setText(QStringLiteral("%1: %2 (%3)").arg(title, why, file));
  });
  buttons_->addWidget(copy);
  buttons_->addStretch(1);
  auto* close = new QPushButton(tr("Close"), this);
  close->setDefault(true);
  close->setFocus();
  connect(close, &QPushButton::clicked, this, &QDialog::reject);
  buttons_->addWidget(close);
  whole->addLayout(buttons_);
}

void FailureDialog::add_remedy(const QString& words, std::function<void()> call) {
  auto* button = new QPushButton(words, this);
  button->setProperty("role", QStringLiteral("primary"));
  connect(button, &QPushButton::clicked, this, [this, call = std::move(call)] {
    accept();
    call();
  });
  buttons_->addWidget(button);
}

}  // namespace relief::studio
