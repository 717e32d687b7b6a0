#include "export_dialog.h"

#include <relief/core/tessellate.h>

#include <QComboBox>
#include <QFileInfo>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLocale>
#include <QPushButton>
#include <QVBoxLayout>
#include <array>
#include <cmath>

namespace relief::studio {

namespace {

using Up = SurfaceExport::Up;

/// How many triangles a level has, but for holes and the seams between slabs of different resolution.
double triangles_of(const SlabMesh& mesh, int level) {
  double count = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int edge = mesh.intervals(s) / level_step(mesh, s, level);
    count += edge * edge;
  }
  return count;
}

/// Two digits, the rest zeros.
QString about(double count) {
  const double unit = count < 100 ? 1 : std::pow(10.0, std::floor(std::log10(count)) - 1);
  return QLocale().toString(std::round(count / unit) * unit, 'f', 0);
}

}  // namespace

ExportDialog::ExportDialog(QSettings& settings, const Snapshot& model, const QString& file, QWidget* parent)
    : QDialog(parent), settings_(settings) {
  setObjectName(QStringLiteral("export"));
  setWindowTitle(tr("Export %1").arg(QFileInfo(file).fileName()));
  auto* column = new QVBoxLayout(this);
  auto* form = new QFormLayout;
  column->addLayout(form);
  const auto row = [form](QComboBox& choice, const QString& id, const QString& name, const QString& help) {
    choice.setObjectName(id);
    choice.setAccessibleName(name);
    choice.setAccessibleDescription(help);
    choice.setToolTip(help);
    form->addRow(name, &choice);
  };
  const SlabMesh& mesh = model.slab_mesh();
  if (const int levels = level_count(mesh); levels > 1) {
    level_ = new QComboBox(this);
    for (int level = 0; level < levels; ++level) {
      const QString count = about(triangles_of(mesh, level));
      level_->addItem(level == 0 ? tr("Every sample: about %1 triangles").arg(count)
                                 : tr("One sample in %1: about %2 triangles").arg(1 << level).arg(count),
                      level);
    }
    row(*level_, QStringLiteral("export-level"), tr("Level of detail"),
        tr("Which samples along an edge are taken; each level has about a quarter of the triangles"));
  }
  struct Each {
    Up up;
    QString id, title;
  };
  const std::array axes = {Each{Up::AsItLies, QString(), tr("As the model lies")},
                           Each{Up::Z, QStringLiteral("z"), tr("z: turns a model whose y is up")},
                           Each{Up::Y, QStringLiteral("y"), tr("y: turns a model whose z is up")}};
  up_ = new QComboBox(this);
  const QString kept = settings.value("export/up").toString();
  for (const auto& [up, id, title] : axes) {
    up_->addItem(title, static_cast<int>(up));
    up_->setItemData(up_->count() - 1, id, Qt::UserRole + 1);
    if (id == kept) up_->setCurrentIndex(up_->count() - 1);
  }
  row(*up_, QStringLiteral("export-up"), tr("Up axis"), tr("For programs whose up axis is another one"));
  auto* buttons = new QHBoxLayout;
  auto* cancel = new QPushButton(tr("Cancel"), this);
  cancel->setObjectName(QStringLiteral("export-cancel"));
  cancel->setAutoDefault(false);
  auto* start = new QPushButton(tr("Export"), this);
  start->setObjectName(QStringLiteral("export-start"));
  start->setProperty("role", QStringLiteral("primary"));
  start->setDefault(true);
  buttons->addStretch(1);
  buttons->addWidget(cancel);
  buttons->addWidget(start);
  column->addStretch(1);
  column->addLayout(buttons);
  connect(start, &QPushButton::clicked, this, &ExportDialog::choose);
  connect(cancel, &QPushButton::clicked, this, &ExportDialog::reject);
}

void ExportDialog::choose() {
  settings_.setValue("export/up", up_->currentData(Qt::UserRole + 1).toString());
  emit chosen({.level = level_ != nullptr ? level_->currentData().toInt() : 0,
               .up = static_cast<Up>(up_->currentData().toInt())});
  accept();
}

}  // namespace relief::studio
