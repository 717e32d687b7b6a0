// What a kiosk shows, as its curator wrote it down.
#pragma once

#include <relief/base/error.h>

#include <QString>
#include <QStringList>
#include <map>
#include <vector>

namespace relief::studio {

/// A model and what stands beside it, in NAME.json beside NAME.relief (see docs/how-to/kiosk.md).
struct Exhibit {
  struct Caption {
    QString title;
    QStringList sentences;  ///< three at most
  };
  QString model;                        ///< absolute path; it is only ever read
  std::map<QString, Caption> captions;  ///< by language; "" for all others
  QStringList tools;                    ///< ids of ToolState, in the curator's order
  double force_cap = 0.6;               ///< of the device's greatest force, 0..1
  int timeout_s = 90;                   ///< without input, before the countdown; 2..3600

  /// In that language, else the one for all, else English, else any.
  [[nodiscard]] const Caption& caption(const QString& language) const;
};

/// Models, and all models of folders (not of folders in them), in the order given, folders by name. Reads each caption
/// and each model whole. Errors, each naming the file and the remedy: NotFound, Corrupt (a model), InvalidArgument (a
/// caption; nothing to show).
[[nodiscard]] Result<std::vector<Exhibit>> read_exhibits(const QStringList& models_or_folders);
/// The caption of a model; what a missing file or part leaves open has its default.
[[nodiscard]] Result<Exhibit> read_exhibit(const QString& model);

}  // namespace relief::studio
