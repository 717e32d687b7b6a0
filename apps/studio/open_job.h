// Opens a model, or makes one of a scan, on a thread of its own.
#pragma once

#include <relief/convert/convert.h>
#include <relief/file/model_file.h>

#include <QObject>
#include <QString>
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <thread>

namespace relief::studio {

struct Opened {
  std::filesystem::path file;
  std::optional<ModelFile> model;
  std::optional<ConvertReport> report;  ///< where it was a scan
  double diagonal = 1;                  ///< of the source, model units
  QString doubt;                        ///< what the verifier says about a model file; empty: nothing
};

/// One thing at a time; begin() again only after ended(). Signals come on the thread of the object.
class OpenJob : public QObject {
  Q_OBJECT
 public:
  explicit OpenJob(QObject* parent = nullptr) : QObject(parent) {}
  ~OpenJob() override;

  /// A .relief file.
  void open_model(const QString& file);
  /// A scan; the model goes into `to`, which is replaced.
  /// `anew`: it becomes a solid first, which mends what a certificate fails at.
  void open_scan(const QString& file, const QString& to, Unit unit, bool anew = false);
  /// One of the library's sample models, named as sample_names() has them.
  void open_sample(const QString& name, const QString& to);
  /// Heard within 0.3 s; cancelled() follows.
  void cancel();
  [[nodiscard]] bool running() const { return running_; }

 signals:
  void meshReady(std::shared_ptr<const relief::TriangleMesh> mesh);
  /// The share of the whole, which never falls, and the phase in words.
  void progress(const QString& phase, double share);
  void opened(std::shared_ptr<relief::studio::Opened> what);
  void cancelled();
  void failed(const relief::Error& error);

 private:
  void start(std::function<void()> work);
  void report(std::string_view phase, double share);
  [[nodiscard]] Result<std::shared_ptr<Opened>> make(TriangleMesh mesh, const QString& to, Unit unit, bool anew);
  void finish(Result<std::shared_ptr<Opened>> outcome);

  std::thread thread_;
  std::atomic<bool> cancel_{false};
  bool running_ = false;
  double share_ = 0, told_ = -1;
  std::string_view phase_;
};

/// What a scan's conversion came to, for people: a headline and further lines.
struct Verdict {
  bool certified = false;
  QString title;
  QStringList lines;
};
[[nodiscard]] Verdict verdict_of(const ConvertReport& report, Mode mode, double diagonal, Unit unit);

}  // namespace relief::studio
