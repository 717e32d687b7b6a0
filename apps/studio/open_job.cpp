#include "open_job.h"

#include "text.h"

#include <relief/base/try.h>
#include <relief/convert/proof.h>
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
    Band{"prove", QT_TRANSLATE_NOOP("OpenJob", "Checking the slabs"), 0.94, 0.96},
    Band{"save", QT_TRANSLATE_NOOP("OpenJob", "Saving"), 0.96, 1},
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
  report("prove", 0);
  RELIEF_CHECK(prove(conversion, settings.mode, anew, progress));
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
  const auto distance = [&](double share) { return length_text(share * diagonal, unit); };
  const auto percent = [](double share) { return QString::number(100 * share, 'g', 2); };
  const auto count = [](std::size_t n) { return static_cast<int>(std::min<std::size_t>(n, 1'000'000'000)); };
  Verdict verdict;
  verdict.certified = mode == Mode::Certified;
  verdict.title = verdict.certified ? Words::tr("Certified") : Words::tr("Tolerant");
  verdict.lines.append(Words::tr("Within %1 of the scan.").arg(distance(farthest_off(report))));
  if (report.coverage.share < 1)
    verdict.lines.append(
        Words::tr("%1 % of what can be seen of the scan is missing.").arg(percent(1 - report.coverage.share)));
  if (report.remesh) {
    verdict.lines.append(
        Words::tr("It stands on a solid that was rebuilt with voxels of %1.").arg(distance(report.remesh->voxel)));
    if (report.remesh->lost > 0)
      verdict.lines.append(
          Words::tr("%1 % of that solid is thinner than a voxel and is missing.").arg(percent(report.remesh->lost)));
  }
  if (!verdict.certified)
    verdict.lines.append(
        is_of_the_source(report)
            ? Words::tr(
                  "The slabs do not overlap, but some places of the scan are seen from no side or touch each other.")
            : Words::tr("It is not certified, because it is not close enough to the whole scan."));
  if (report.hits_several > 0)
    verdict.lines.append(
        Words::tr("%1 % of the surface lies over itself and shows its outer side only.")
            .arg(percent(static_cast<double>(report.hits_several) / static_cast<double>(report.fibres_cast))));
  QStringList removed;
  if (report.strays.components > 0)
    removed.append(Words::tr("%n component(s) far off were left out", nullptr, count(report.strays.components)));
  if (report.skin && report.skin->dropped > 0)
    removed.append(
        Words::tr("%n triangle(s) inside of other parts were left out", nullptr, count(report.skin->dropped)));
  if (report.closed_openings > 0)
    removed.append(Words::tr("%n opening(s) stay open", nullptr, count(report.closed_openings)));
  if (report.dropped_parts > 0)
    removed.append(Words::tr("%n small part(s) were left out", nullptr, count(report.dropped_parts)));
  if (report.specks > 0) removed.append(Words::tr("%n tiny component(s) were left out", nullptr, count(report.specks)));
  if (report.replaced_triangles > 0)
    removed.append(Words::tr("%n triangle(s) were mended", nullptr, count(report.replaced_triangles)));
  if (report.moved_vertices > 0)
    removed.append(Words::tr("%n point(s) moved by at most %1", nullptr, count(report.moved_vertices))
                       .arg(distance(report.moved_most)));
  if (!removed.isEmpty())
    verdict.lines.append(removed.join(QStringLiteral("; ")) + QLatin1Char('.'));
  else if (report.coverage.share == 1)
    verdict.lines.append(Words::tr("Nothing was removed."));
  for (const std::string& note : report.notes)
    if (note.find("--") == std::string::npos)  // what it says of options is for those who give some
      verdict.lines.append(note_text(note) + QLatin1Char('.'));
  return verdict;
}

}  // namespace relief::studio
