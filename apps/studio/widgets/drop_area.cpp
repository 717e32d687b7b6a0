#include "drop_area.h"

#include "accessible.h"
#include "icons.h"
#include "theme.h"

#include <QDragEnterEvent>
#include <QFileInfo>
#include <QLabel>
#include <QMimeData>
#include <QPainter>
#include <QPushButton>
#include <QUrl>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

constexpr int kIcon = 44;  // pixels

}  // namespace

DropArea::DropArea(const QString& title, const QStringList& suffixes, QWidget* parent)
    : QWidget(parent),
      suffixes_(suffixes),
      icon_(new QLabel),
      title_(new QLabel(title)),
      hint_(new QLabel),
      browse_(new QPushButton(tr("Choose a file …"))) {
  set_accessible_role(this, QAccessible::Grouping);
  setObjectName(QStringLiteral("drop_area"));
  setAccessibleName(title);
  setAcceptDrops(true);
  title_->setProperty("role", QStringLiteral("heading"));
  hint_->setProperty("role", QStringLiteral("dim"));
  hint_->setWordWrap(true);
  hint_->setAlignment(Qt::AlignCenter);
  browse_->setObjectName(QStringLiteral("drop_area.browse"));
  browse_->setAccessibleName(tr("Choose a file"));
  browse_->setAccessibleDescription(title);
  browse_->setToolTip(title);
  browse_->setProperty("role", QStringLiteral("primary"));
  connect(browse_, &QPushButton::clicked, this, &DropArea::browseRequested);
  auto* layout = new QVBoxLayout(this);
  layout->setContentsMargins(20, 20, 20, 20);
  layout->addStretch();
  layout->addWidget(icon_, 0, Qt::AlignHCenter);
  layout->addWidget(title_, 0, Qt::AlignHCenter);
  layout->addWidget(hint_);
  layout->addSpacing(8);
  layout->addWidget(browse_, 0, Qt::AlignHCenter);
  layout->addStretch();
  set_over(Over::Nothing);
}

QStringList DropArea::taken(const QList<QUrl>& addresses) const {
  QStringList files;
  for (const QUrl& address : addresses) {
    const QString file = address.toLocalFile();
    if (!file.isEmpty() && suffixes_.contains(QFileInfo(file).suffix().toLower())) files.append(file);
  }
  return files;
}

void DropArea::set_over(Over over) {
  over_ = over;
  const QString known = suffixes_.join(QStringLiteral(", "));
  hint_->setText(over == Over::Unknown ? tr("This kind of file cannot be opened. Known are %1.").arg(known) : known);
  describe(this, hint_->text());
  show_icon();
  update();
}

void DropArea::dragEnterEvent(QDragEnterEvent* event) {
  const bool welcome = !taken(event->mimeData()->urls()).isEmpty();
  set_over(welcome ? Over::Welcome : Over::Unknown);
  // One that is not welcome is accepted, too, or there would be no leave event to take the words back.
  event->setDropAction(welcome ? Qt::CopyAction : Qt::IgnoreAction);
  event->accept();
}

void DropArea::dragLeaveEvent(QDragLeaveEvent*) { set_over(Over::Nothing); }

void DropArea::dropEvent(QDropEvent* event) {
  const QStringList files = taken(event->mimeData()->urls());
  set_over(Over::Nothing);
  if (files.isEmpty()) return event->ignore();
  event->acceptProposedAction();
  emit dropped(files);
}

QSize DropArea::minimumSizeHint() const { return layout()->totalMinimumSize().expandedTo({scaled(280), scaled(200)}); }

QColor DropArea::edge() const {
  const Theme& theme = current_theme();
  return over_ == Over::Welcome ? theme.accent : over_ == Over::Unknown ? theme.bad : theme.dim;
}

void DropArea::show_icon() {
  const QString id = over_ == Over::Unknown ? QStringLiteral("warning") : QStringLiteral("open");
  icon_->setPixmap(icon_pixmap(id, scaled(kIcon), edge(), devicePixelRatioF()));
}

void DropArea::changeEvent(QEvent* event) {
  if (event->type() == QEvent::StyleChange) show_icon();
  QWidget::changeEvent(event);
}

void DropArea::paintEvent(QPaintEvent*) {
  const Theme& theme = current_theme();
  QPainter painter(this);
  painter.setRenderHint(QPainter::Antialiasing);
  QPen pen(edge(), 1.6);
  pen.setDashPattern({5, 4});
  painter.setPen(pen);
  painter.setBrush(over_ == Over::Welcome ? mixed(theme.field, theme.accent, 0.1) : theme.field);
  painter.drawRoundedRect(QRectF(rect()).adjusted(1, 1, -1, -1), 2 * corner(), 2 * corner());
}

}  // namespace relief::studio
