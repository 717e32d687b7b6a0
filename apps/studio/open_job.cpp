#include "open_job.h"

#include "text.h"

#include <relief/base/try.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <QCoreApplication>
#include <algorithm>
#include <array>

namespace relief::studio {

namespace {

/// Where a phase lies in the whole, by the CPU time that it takes of a scan of a million triangles.
struct Band {
  std::string_view phase;
  const char* words;
  double from, to;
};
constexpr std::array kBands = {
    Band{"import", QT_TRANSLATE_NOOP("OpenJob", "Reading the scan"), 0, 0.06},
    Band{"open", QT_TRANSLATE_NOOP("OpenJob", "Opening the model"), 0, 0.9},
    Band{"check", QT_TRANSLATE_NOOP("OpenJob", "Checking the slabs"), 0.9, 1},
    Band{"remesh", QT_TRANSLATE_NOOP("OpenJob", "Mending the scan"), 0.06, 0.1},
    Band{"shell", QT_TRANSLATE_NOOP("OpenJob", "Preparing the surface: a thin shell"), 0.06, 0.14},
    Band{"reduce", QT_TRANSLATE_NOOP("OpenJob", "Preparing the surface: slabs"), 0.14, 0.78},
    Band{"sample", QT_TRANSLATE_NOOP("OpenJob", "Preparing the surface: samples"), 0.78, 0.88},
    Band{"measure", QT_TRANSLATE_NOOP("OpenJob", "Measuring the distance to the scan"), 0.88, 0.94},
    Band{"colour", QT_TRANSLATE_NOOP("OpenJob", "Taking over the colours"), 0.9, 0.94},
    Band{"save", QT_TRANSLATE_NOOP("OpenJob", "Saving"), 0.94, 1},
};

struct Words {
  Q_DECLARE_TR_FUNCTIONS(OpenJob)
};

/// Of the whole, between two reports: a pixel of the bar.
constexpr double kLeastStep = 0.002;

}  // namespace

OpenJob::~OpenJob() {
  cancel_ = true;
  if (thread_.joinable()) thread_.join();
}

void OpenJob::cancel() { cancel_ = true; }

void OpenJob::start(std::function<void()> work) {
  if (thread_.joinable()) thread_.join();
  cancel_ = false;
  running_ = true;
  share_ = 0;
  told_ = -1;
  phase_ = {};
  thread_ = std::thread(std::move(work));
}

/// Worker thread.
void OpenJob::report(std::string_view phase, double share) {
  const auto band = std::ranges::find(kBands, phase, &Band::phase);
  if (band == kBands.end()) return;
  share_ = std::max(share_, band->from + (band->to - band->from) * std::clamp(share, 0.0, 1.0));
  if (band->phase == phase_ && share_ < told_ + kLeastStep) return;
  phase_ = band->phase;
  told_ = share_;
  QMetaObject::invokeMethod(
      this, [this, words = band->words, whole = share_] { emit progress(Words::tr(words), whole); },
      Qt::QueuedConnection);
}

/// Worker thread, as the last that it does. Whoever hears the outcome may begin the next job at once.
void OpenJob::finish(Result<std::shared_ptr<Opened>> outcome) {
  QMetaObject::invokeMethod(
      this,
      [this, outcome = std::move(outcome)] {
        running_ = false;
        if (outcome)
          emit opened(*outcome);
        else if (outcome.error().code == Errc::Cancelled)
          emit cancelled();
        else
          emit failed(outcome.error());
      },
      Qt::QueuedConnection);
}

void OpenJob::open_model(const QString& file) {
  start([this, file] {
    const Progress progress{[this](std::string_view phase, double share) { report(phase, share); }, &cancel_};
    const auto work = [&]() -> Result<std::shared_ptr<Opened>> {
      RELIEF_TRY(ModelFile model, ModelFile::open(path(file), false, progress));
      report("check", 0);
      auto made = std::make_shared<Opened>();
      made->file = path(file);
      made->diagonal = model.model().info.source_diagonal;
      made->doubt = text(model.doubt(progress));
      if (cancel_) return fail(Errc::Cancelled, "cancelled");
      made->model = std::move(model);
      return made;
    };
    finish(work());
  });
}

Result<std::shared_ptr<Opened>> OpenJob::make(TriangleMesh mesh, const QString& to, Unit unit, bool anew) {
  const Progress progress{[this](std::string_view phase, double share) { report(phase, share); }, &cancel_};
  const auto shown = std::make_shared<const TriangleMesh>(std::move(mesh));
  QMetaObject::invokeMethod(this, [this, shown] { emit meshReady(shown); }, Qt::QueuedConnection);
  ConvertSettings settings;
  settings.unit = shown->unit.value_or(unit);
  if (anew) settings.remesh = 0.0;
  RELIEF_TRY(Conversion conversion, convert(*shown, settings, progress));
  report("save", 0);
  auto made = std::make_shared<Opened>();
  made->file = path(to);
  made->diagonal = conversion.model.info.source_diagonal;
  RELIEF_TRY(made->model, ModelFile::create(path(to), conversion.model, progress));
  made->report = std::move(conversion.report);
  return made;
}

void OpenJob::open_scan(const QString& file, const QString& to, Unit unit, bool anew) {
  start([this, file, to, unit, anew] {
    const auto work = [&]() -> Result<std::shared_ptr<Opened>> {
      report("import", 0);
      const Progress progress{[this](std::string_view phase, double share) { report(phase, share); }, &cancel_};
      RELIEF_TRY(TriangleMesh mesh, import_mesh(path(file), progress));
      return make(std::move(mesh), to, unit, anew);
    };
    finish(work());
  });
}

void OpenJob::open_sample(const QString& name, const QString& to) {
  start([this, name, to] {
    constexpr std::size_t kTriangles = 300'000;  // as fine as its grids: with a third, facets are seen in its folds
    const auto work = [&]() -> Result<std::shared_ptr<Opened>> {
      const Progress progress{[this](std::string_view, double share) { report("import", share); }, &cancel_};
      RELIEF_TRY(TriangleMesh mesh, make_sample(name.toStdString(), kTriangles, progress));
      return make(std::move(mesh), to, Unit::Millimetre, false);
    };
    finish(work());
  });
}

Verdict verdict_of(const ConvertReport& report, Mode mode, double diagonal, Unit unit) {
  Verdict verdict;
  verdict.certified = mode == Mode::Certified;
  verdict.title = verdict.certified ? Words::tr("Certified") : Words::tr("Tolerant");
  const double most = std::max(report.to_source.max, report.from_source.max) * diagonal;
  verdict.lines.append(Words::tr("Within %1 of the scan.").arg(length_text(most, unit)));
  if (!verdict.certified)
    verdict.lines.append(
        Words::tr("The slabs do not overlap, but some places of the scan are seen from no side or touch each other."));
  if (report.fibres_cast > 0 && report.hits_single < report.fibres_cast) {
    const auto several = static_cast<double>(report.hits_several) / static_cast<double>(report.fibres_cast);
    if (several > 0)
      verdict.lines.append(Words::tr("%1 % of the surface lies over itself and shows its outer side only.")
                               .arg(100 * several, 0, 'g', 2));
  }
  QStringList removed;
  if (report.closed_openings > 0)
    removed.append(Words::tr("%n opening(s) stay open", nullptr, static_cast<int>(report.closed_openings)));
  if (report.dropped_parts > 0)
    removed.append(Words::tr("%n small part(s) were left out", nullptr, static_cast<int>(report.dropped_parts)));
  if (report.specks > 0)
    removed.append(Words::tr("%n tiny component(s) were left out", nullptr, static_cast<int>(report.specks)));
  if (report.replaced_triangles > 0)
    removed.append(Words::tr("%n triangle(s) were mended", nullptr, static_cast<int>(report.replaced_triangles)));
  verdict.lines.append(removed.isEmpty() ? Words::tr("Nothing was removed.")
                                         : removed.join(QStringLiteral("; ")) + QLatin1Char('.'));
  for (const std::string& note : report.notes)
    if (note.find("--") == std::string::npos)  // what it says of options is for those who give some
      verdict.lines.append(note_text(note) + QLatin1Char('.'));
  return verdict;
}

}  // namespace relief::studio
