// What the studio says of a conversion.
#include <gtest/gtest.h>
#include <studio/open_job.h>

#include <string>

namespace relief::studio {
namespace {

/// A report of a whole, certified model, 0.1 % of the diagonal off.
ConvertReport whole() {
  ConvertReport report;
  report.fibres_cast = report.hits_single = 1000;
  report.to_source.max = 1e-3;
  return report;
}

QString lines(const ConvertReport& report, Mode mode) {
  QString said = verdict_of(report, mode, 100, Unit::Millimetre).lines.join(QLatin1Char('\n'));
  return said.replace(QChar(QChar::Nbsp), QLatin1Char(' '));
}

TEST(Verdict, SaysTheDistanceOfWhatCanBeSeenAndThatNothingWent) {
  ConvertReport report = whole();
  report.from_source.max = 0.4;  // of what lies inside, which nobody sees
  EXPECT_EQ(lines(report, Mode::Certified).toStdString(), "Within 0.100 mm of the scan.\nNothing was removed.");
  report.coverage.farthest = 2e-3;
  EXPECT_TRUE(lines(report, Mode::Certified).contains(QStringLiteral("Within 0.200 mm")));
  report.coverage.beyond = 3e-3;
  EXPECT_TRUE(lines(report, Mode::Certified).contains(QStringLiteral("Within 0.300 mm")));
}

TEST(Verdict, SaysWhatIsMissingRebuiltLeftOutAndMoved) {
  ConvertReport report = whole();
  report.coverage.share = 0.97;
  report.remesh = ConvertReport::Remesh{.voxel = 5e-3, .lost = 0.02};
  report.strays.components = 2;
  report.skin.emplace().dropped = 12;
  report.moved_vertices = 3;
  report.moved_most = 1e-4;
  report.hits_single = 900;
  report.hits_several = 100;
  const QString said = lines(report, Mode::Tolerant);
  for (const char* what :
       {"3 % of what can be seen of the scan is missing.", "voxels of 0.500 mm",
        "2 % of that solid is thinner than a voxel", "not close enough", "10 % of the surface lies over itself",
        "2 component(s) far off", "12 triangle(s) inside", "3 point(s) moved by at most 0.0100 mm"})
    EXPECT_TRUE(said.contains(QLatin1String(what))) << what << "\n" << said.toStdString();
  EXPECT_FALSE(said.contains(QStringLiteral("Nothing was removed")));
}

}  // namespace
}  // namespace relief::studio
