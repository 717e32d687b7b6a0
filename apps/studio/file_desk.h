// Opening, naming and closing of models.
#pragma once

#include "bridge.h"
#include "open_job.h"
#include "shelf.h"

#include <QObject>

namespace relief::studio {

/// Puts the job, the shelf and the bridge together. One model at a time.
class FileDesk : public QObject {
  Q_OBJECT
 public:
  FileDesk(DocumentBridge& bridge, QObject* parent = nullptr);

  /// A .relief file, or a scan in any format of the library.
  void open(const QString& file);
  void open_sample(const QString& name);
  /// The scan that is open, made a solid first; strokes that it has are left behind in its old model.
  void open_anew();
  void cancel() { job_.cancel(); }
  [[nodiscard]] bool opening() const { return job_.running(); }
  /// While failed() or cancelled() is told: what was open before is opened again right after.
  [[nodiscard]] bool goes_back() const { return !before_.isEmpty(); }
  /// False, with why, where not everything could be written; the model then stays open.
  [[nodiscard]] bool close(QString& why);
  /// The document goes on in this file; its old place, where it had no name, is given up when that is done. `cancel`
  /// leaves everything as it is.
  void save_as(const QString& file, std::shared_ptr<const std::atomic<bool>> cancel);

  [[nodiscard]] Shelf& shelf() { return shelf_; }
  [[nodiscard]] const QString& title() const { return title_; }
  /// Of the names of files that can be opened, without the dot.
  [[nodiscard]] static QStringList suffixes();
  /// The same for a dialog.
  [[nodiscard]] static QString filters();
  [[nodiscard]] static bool is_model(const QString& file);

 signals:
  /// The model that was open is closed by now.
  void openingBegun(const QString& title);
  void meshReady(std::shared_ptr<const relief::TriangleMesh> mesh);
  void progress(const QString& phase, double share);
  /// The document is open; with a verdict where it was a scan, with a doubt where the verifier has one.
  void opened(const std::optional<relief::studio::Verdict>& verdict, const QString& doubt);
  void cancelled();
  /// What people should know, as a toast.
  void said(const QString& words);
  /// What could not be done, and why in one sentence.
  void failed(const QString& title, const QString& why, const QString& file, bool damaged);

 private:
  void finish(const std::shared_ptr<Opened>& what);
  bool begin(const QString& file, const QString& title);
  void go_back();

  DocumentBridge& bridge_;
  Shelf shelf_;
  OpenJob job_;
  QString scan_;                   ///< the one that the open model was made of just now; else empty
  QString asked_, title_, made_;   ///< made_: the file that a conversion writes
  QString before_, before_title_;  ///< the model that was closed for the one that is being opened; else empty
  QString given_up_;               ///< an unnamed file that save_as() leaves
};

}  // namespace relief::studio
