#include "layers_panel.h"

#include "widgets/icons.h"
#include "widgets/theme.h"

#include <QCoreApplication>
#include <QHBoxLayout>
#include <QLabel>
#include <QToolButton>
#include <QVBoxLayout>
#include <array>

namespace relief::studio {

namespace {

struct Row {
  Layer layer;
  const char* title;
  bool Look::* shown;  ///< null where it is always seen, or felt only
  const char* help;
};
const std::array kRows = {
    Row{Layer::Displacement, QT_TRANSLATE_NOOP("LayersPanel", "Form"), nullptr,
        QT_TRANSLATE_NOOP("LayersPanel", "The shape itself")},
    Row{Layer::Colour, QT_TRANSLATE_NOOP("LayersPanel", "Colour"), &Look::colours,
        QT_TRANSLATE_NOOP("LayersPanel", "Show the painted colours")},
    Row{Layer::Mask, QT_TRANSLATE_NOOP("LayersPanel", "Mask"), &Look::mask,
        QT_TRANSLATE_NOOP("LayersPanel", "Show what is protected, darker")},
    Row{Layer::Stiffness, QT_TRANSLATE_NOOP("LayersPanel", "Stiffness"), nullptr,
        QT_TRANSLATE_NOOP("LayersPanel", "Felt with a device")},
    Row{Layer::StaticFriction, QT_TRANSLATE_NOOP("LayersPanel", "Static friction"), nullptr,
        QT_TRANSLATE_NOOP("LayersPanel", "Felt with a device")},
    Row{Layer::DynamicFriction, QT_TRANSLATE_NOOP("LayersPanel", "Dynamic friction"), nullptr,
        QT_TRANSLATE_NOOP("LayersPanel", "Felt with a device")},
    Row{Layer::Strata, QT_TRANSLATE_NOOP("LayersPanel", "Strata"), nullptr,
        QT_TRANSLATE_NOOP("LayersPanel", "Felt with a device")},
};

unsigned bit(Layer layer) { return 1U << static_cast<unsigned>(layer); }

}  // namespace

LayersPanel::LayersPanel(QWidget* parent) : QWidget(parent) {
  setObjectName(QStringLiteral("layers"));
  setAccessibleName(tr("Layers"));
  rows_ = new QVBoxLayout(this);
  rows_->setContentsMargins(0, 0, 0, 0);
  rows_->setSpacing(2);
}

bool LayersPanel::set_model(const Snapshot* model) {
  unsigned layers = 0;
  if (model != nullptr)
    for (const Row& row : kRows)
      if (model->has(row.layer)) layers |= bit(row.layer);
  if (layers == layers_) return false;
  rebuild(layers);
  return true;
}

void LayersPanel::set_look(const Look& look) {
  const bool same = look.colours == look_.colours && look.mask == look_.mask;
  look_ = look;
  if (!same) rebuild(layers_);
}

void LayersPanel::rebuild(unsigned layers) {
  layers_ = layers;
  while (QLayoutItem* item = rows_->takeAt(0)) {
    if (QWidget* widget = item->widget()) {
      widget->hide();
      widget->deleteLater();
    }
    delete item;
  }
  for (const Row& row : kRows)
    if ((layers & bit(row.layer)) != 0) add_row(row.layer);
}

void LayersPanel::add_row(Layer layer) {
  const Row& row = *std::ranges::find(kRows, layer, &Row::layer);
  auto* line = new QWidget(this);
  auto* across = new QHBoxLayout(line);
  across->setContentsMargins(8, 2, 4, 2);
  const QString title = QCoreApplication::translate("LayersPanel", row.title);
  const QString help = QCoreApplication::translate("LayersPanel", row.help);
  auto* name = new QLabel(title, line);
  name->setToolTip(help);
  across->addWidget(name, 1);
  if (row.shown != nullptr) {
    auto* eye = new QToolButton(line);
    eye->setCheckable(true);
    eye->setChecked(look_.*row.shown);
    eye->setIcon(icon(eye->isChecked() ? u"eye" : u"eye-off"));
    eye->setAutoRaise(true);
    eye->setObjectName(QStringLiteral("show-") + title.toLower());
    eye->setAccessibleName(tr("Show %1").arg(title.toLower()));
    eye->setAccessibleDescription(help);
    eye->setToolTip(help);
    connect(eye, &QToolButton::toggled, this, [this, eye, shown = row.shown](bool on) {
      eye->setIcon(icon(on ? u"eye" : u"eye-off"));
      look_.*shown = on;
      emit lookChanged(look_);
    });
    across->addWidget(eye);
  }
  rows_->addWidget(line);
}

}  // namespace relief::studio
