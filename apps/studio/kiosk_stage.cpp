#include "kiosk_stage.h"

#include "widgets/colour_palette.h"
#include "widgets/icons.h"
#include "widgets/theme.h"

#include <QButtonGroup>
#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPushButton>
#include <QShortcut>
#include <QToolButton>
#include <QVBoxLayout>

namespace relief::studio {

namespace {

/// Pixels at 100 % text: a fingertip is about 60 (a centimetre on a screen of 24 inches).
constexpr double kButton = 76, kSwatch = 52;

}  // namespace

KioskStage::KioskStage(DocumentBridge& bridge, ToolState& tools, QWidget* parent) : QWidget(parent), tools_(tools) {
  setObjectName(QStringLiteral("kiosk-stage"));
  auto* across = new QHBoxLayout(this);
  across->setContentsMargins(0, 0, 0, 0);
  across->setSpacing(0);
  left_ = new QWidget(this);
  tool_column_ = new QVBoxLayout(left_);
  tool_group_ = new QButtonGroup(this);
  viewport_ = new Viewport(bridge, tools, this);
  viewport_->setAcceptDrops(false);
  right_ = new QWidget(this);
  right_->setFixedWidth(scaled(300));
  across->addWidget(left_);
  across->addWidget(viewport_, 1);
  across->addWidget(right_);

  auto* column = new QVBoxLayout(right_);
  column->setContentsMargins(scaled(20), scaled(24), scaled(20), scaled(24));
  column->setSpacing(scaled(14));
  title_ = new QLabel(right_);
  title_->setFont(ui_font(22, QFont::DemiBold));
  sentences_ = new QLabel(right_);
  sentences_->setObjectName(QStringLiteral("caption"));
  sentences_->setFont(ui_font(14));
  for (QLabel* label : {title_, sentences_}) {
    label->setWordWrap(true);
    label->setTextFormat(Qt::PlainText);
    column->addWidget(label);
  }
  column->addStretch(1);
  colours_ = new QWidget(right_);
  add_colours();
  column->addWidget(colours_);
  const auto button = [&](const QString& id, const QString& picture, auto signal) {
    auto* made = new QPushButton(icon(picture), {}, right_);
    made->setObjectName(id);
    made->setFont(ui_font(15));
    made->setIconSize(QSize(scaled(28), scaled(28)));
    made->setMinimumHeight(scaled(kButton * 0.85));
    made->setFocusPolicy(Qt::NoFocus);
    connect(made, &QPushButton::clicked, this, signal);
    column->addWidget(made);
    return made;
  };
  undo_ = button(QStringLiteral("kiosk-undo"), QStringLiteral("undo"), &KioskStage::undoAsked);
  again_ = button(QStringLiteral("kiosk-again"), QStringLiteral("recover"), &KioskStage::againAsked);
  others_ = button(QStringLiteral("kiosk-others"), QStringLiteral("home"), &KioskStage::othersAsked);
}

void KioskStage::add_colours() {
  auto* grid = new QGridLayout(colours_);
  grid->setContentsMargins(0, 0, 0, 0);
  grid->setSpacing(scaled(6));
  auto* group = new QButtonGroup(colours_);
  int k = 0;
  for (const NamedColour& each : palette_colours()) {
    auto* swatch = new Swatch(QColor(each.colour), colours_);
    swatch->setFixedSize(scaled(kSwatch), scaled(kSwatch));
    swatch->setCheckable(true);
    swatch->setFocusPolicy(Qt::NoFocus);
    group->addButton(swatch);
    // Assistive tools check the swatch without clicking it.
    connect(swatch, &Swatch::toggled, this, [this, colour = swatch->colour()](bool on) {
      if (on) tools_.set_colour({colour.redF(), colour.greenF(), colour.blueF()});
    });
    grid->addWidget(swatch, k / 4, k % 4);
    ++k;
  }
}

void KioskStage::set_exhibit(const Exhibit& exhibit) {
  while (QLayoutItem* item = tool_column_->takeAt(0)) {
    delete item->widget();
    delete item;
  }
  tool_column_->addStretch(1);
  for (const QString& id : exhibit.tools) {
    auto* button = new QToolButton(left_);
    button->setObjectName(QStringLiteral("kiosk-tool-") + id);
    button->setToolButtonStyle(Qt::ToolButtonTextUnderIcon);
    button->setIcon(icon(id));
    button->setIconSize(QSize(scaled(34), scaled(34)));
    button->setFont(ui_font(12));
    button->setCheckable(true);
    button->setFixedWidth(scaled(116));
    button->setMinimumHeight(scaled(kButton));
    button->setFocusPolicy(Qt::NoFocus);
    button->setProperty("tool-id", id);
    tool_group_->addButton(button);
    // Assistive tools check the button without clicking it.
    connect(button, &QToolButton::toggled, this, [this, id](bool on) {
      if (on) choose(id);
    });
    auto* key = new QShortcut(QKeySequence(ToolState::key(id)), button);
    connect(key, &QShortcut::activated, button, [button] { button->setChecked(true); });
    tool_column_->addWidget(button);
  }
  tool_column_->addStretch(1);
  // The first tool that leaves a trace: who taps sees something happen.
  const auto first =
      std::ranges::find_if(exhibit.tools, [](const QString& id) { return ToolState::tool_of(id).has_value(); });
  colours_->findChild<Swatch*>()->setChecked(true);
  const QString id = first == exhibit.tools.end() ? exhibit.tools.first() : *first;
  for (QAbstractButton* button : tool_group_->buttons())
    if (button->property("tool-id").toString() == id) button->setChecked(true);
  choose(id);
}

void KioskStage::choose(const QString& id) {
  tools_.choose(id);
  const auto tool = ToolState::tool_of(id);
  colours_->setVisible(tool && info(*tool).writes == Layer::Colour);
}

void KioskStage::set_language(const Exhibit& exhibit, const QString& language) {
  const Exhibit::Caption& caption = exhibit.caption(language);
  title_->setText(caption.title);
  sentences_->setText(caption.sentences.join(QStringLiteral("\n\n")));
  sentences_->setAccessibleDescription(caption.sentences.join(QLatin1Char(' ')));
  sentences_->setVisible(!caption.sentences.isEmpty());
  for (QAbstractButton* button : tool_group_->buttons()) {
    const QString title = ToolState::title(button->property("tool-id").toString());
    button->setText(title);
    button->setAccessibleName(title);
  }
  undo_->setText(tr("Undo"));
  again_->setText(tr("Start again"));
  others_->setText(tr("Choose another"));
}

void KioskStage::set_touched(bool touched) {
  undo_->setEnabled(touched);
  again_->setEnabled(touched);
}

void KioskStage::set_others(bool others) { others_->setVisible(others); }

void KioskStage::set_controls_shown(bool shown) {
  left_->setVisible(shown);
  right_->setVisible(shown);
  viewport_->show_overlays(shown);
}

}  // namespace relief::studio
