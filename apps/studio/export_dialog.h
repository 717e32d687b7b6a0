// Asks how the surface shall go into a mesh file.
#pragma once

#include <relief/convert/convert.h>

#include <QDialog>
#include <QSettings>

class QComboBox;

namespace relief::studio {

/// Level of detail and up axis, as `relief export` has them. Only for meshes: a cage as text has neither. The level
/// begins with every sample each time, so that nobody loses detail unasked; the axis is remembered.
class ExportDialog : public QDialog {
  Q_OBJECT
 public:
  /// `model`: what is exported. `file`: where to.
  ExportDialog(QSettings& settings, const Snapshot& model, const QString& file, QWidget* parent = nullptr);

 signals:
  /// Somebody pressed "Export". The unit is left to who exports.
  void chosen(const relief::SurfaceExport& how);

 private:
  void choose();

  QSettings& settings_;
  QComboBox* level_ = nullptr;  ///< null where the model has one level only
  QComboBox* up_ = nullptr;
};

}  // namespace relief::studio
