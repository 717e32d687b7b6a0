// What a conversion says: of reports made by hand, so that each sentence has its case.
#include <relief/convert/convert.h>
#include <relief/convert/failures.h>
#include <relief/convert/obstacle_text.h>
#include <relief/convert/report.h>
#include <relief/convert/support/words.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace relief {
namespace {

ConvertSettings for_slabs(int slabs) {
  ConvertSettings settings;
  settings.slabs = slabs;
  return settings;
}

TEST(Remedy, NamesWhatIsLeftToTry) {
  EXPECT_EQ(remedy(Mode::Certified, false), "use --remesh or --mode tolerant");
  EXPECT_EQ(remedy(Mode::Certified, true), "use --mode tolerant");
  for (const bool is_remeshed : {false, true})
    EXPECT_EQ(remedy(Mode::Tolerant, is_remeshed), "try more --slabs or a smaller --thickness");
}

TEST(Remedy, ARefusalForAnyObstacleHasAtMost25Words) {
  using detail::DefectKind;
  for (const DefectKind kind : {DefectKind::HighValence, DefectKind::SingularVertex, DefectKind::SelfIntersection,
                                DefectKind::PatchIntersection, DefectKind::TooNear, DefectKind::Fold})
    for (const std::size_t count : {1U, 12U}) {
      ConvertReport report;
      report.not_certified = detail::clause({.kind = kind, .place = {}, .count = count}) + ", first near " +
                             detail::place({-13.8523, 13.4067, 2.18048});
      const std::string said = detail::no_shell(report, {.mode = Mode::Certified}).error().message;
      std::istringstream words(said);
      const auto most = std::distance(std::istream_iterator<std::string>(words), {});
      EXPECT_LE(most, 25) << said;
      EXPECT_TRUE(said.contains("front") || said.contains("triangle")) << said;
    }
}

TEST(Words, APlaceIsAsExactAsItsSurroundingsNeed) {
  EXPECT_EQ(detail::place({16.8548, -47.8289, 17.5052}, 130), "(16.9, -47.8, 17.5)");
  EXPECT_EQ(detail::place({0.0168548, -0.00004, 0}, 0.13), "(0.0169, 0, 0)");
  EXPECT_EQ(detail::place({1234567.8, -47.8289, 1}, 1100), "(1234568, -48, 1)");
}

TEST(Verdict, TellsClayInTheUnitOfTheModel) {
  ConvertReport report;
  report.clay.below.thin_fibres = 0.031;
  report.clay.below.least = 2.49041e-05;
  report.clay.below.least_at = {16.8548, -47.8289, 17.5052};
  const ModelInfo info{.mode = Mode::Certified, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 130};
  const std::vector<std::string> notes = detail::notes_of(report, for_slabs(200), info, 1000);
  const std::string clay = "tools find little clay: 3.1 % of the fibres have less than " +
                           detail::rounded(130 * ClaySide::kThin) +
                           " mm below the surface, the least 0.0032 mm near (16.9, -47.8, 17.5)";
  EXPECT_NE(std::ranges::find(notes, clay), notes.end()) << (notes.empty() ? "" : notes.back());
}

TEST(Verdict, SaysTheModeTheDistanceAndWhatWasRemovedPatchedAndMoved) {
  ConvertReport report;
  report.fibres_cast = report.hits_single = 1'000'000;
  report.to_source.max = 3e-4;
  report.coverage.farthest = 2e-4;
  ModelInfo info{.mode = Mode::Certified, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 300};
  EXPECT_EQ(verdict(report, info), "Certified; within 0.09 mm of the scan; nothing was removed");
  info.source_diagonal = 1.1e7;
  EXPECT_EQ(verdict(report, info), "Certified; within 3300 mm of the scan; nothing was removed");
  info = {.mode = Mode::Tolerant, .unit = Unit::Metre, .source = {}, .source_diagonal = 2};
  report.coverage = {.share = 0.9, .farthest = 0.004, .missing_near = {1, 2, 3}};
  report.parts.certified = 1;
  report.strays = {.components = 1, .triangles = 1, .near = {7, 8, 9}, .away = 50};
  report.replaced_triangles = 5;
  report.replaced_widest = 0.01;
  report.moved_vertices = 1;
  report.moved_most = 0.001;
  report.remesh = {.voxel = 0.02, .is_smooth = true};
  EXPECT_EQ(verdict(report, info),
            "Tolerant, as more than 0.5 % of what can be seen is missing; "
            "within 0.008 m of the scan, but 10 % of what can be seen of it is missing, as near (1, 2, 3); "
            "removed: 1 triangle far off, near (7, 8, 9); patched: 5 triangles, at most 0.02 m across, near (0, 0, 0); "
            "1 vertex moved by at most 0.002 m; it stands on a solid rebuilt with voxels of 0.04 m, without sharp "
            "edges");
}

TEST(Verdict, SaysWhatIsThinnerThanTheVoxels) {
  ConvertReport report;
  report.remesh = {.voxel = 0.02, .lost = 0.013, .lost_near = {4, 5, 6}};
  const ModelInfo info{.mode = Mode::Certified, .unit = Unit::Metre, .source = {}, .source_diagonal = 2};
  EXPECT_TRUE(verdict(report, info)
                  .ends_with("it stands on a solid rebuilt with voxels of 0.04 m; lost, as it is thinner "
                             "than a voxel: 1.3 % of the solid's skin, as near (4, 5, 6)"))
      << verdict(report, info);
  report.remesh->lost = 0;
  EXPECT_TRUE(verdict(report, info).ends_with("voxels of 0.04 m")) << verdict(report, info);
}

TEST(Verdict, NamesTheReasonForTolerant) {
  ConvertReport report;
  report.slabs_asked = 60;
  report.not_certified = detail::why_tolerant(report);
  const ModelInfo info{.mode = Mode::Tolerant, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 300};
  EXPECT_EQ(verdict(report, info),
            "Tolerant, as no proof was found with 60 slabs; within 0 mm of the scan; nothing was removed");
  report.parts.certified = 1;
  report.coverage.beyond = report.to_source.max = 0.012;
  EXPECT_EQ(verdict(report, info),
            "Tolerant, as it stands on a surface 3.6 mm off the scan, more than 1 % of its diagonal; within "
            "3.6 mm of the scan; nothing was removed");
  report.coverage.share = 0.9;
  EXPECT_TRUE(verdict(report, info)
                  .starts_with("Tolerant, as more than 0.5 % of what can be seen is missing and it stands on a "
                               "surface 3.6 mm off"))
      << verdict(report, info);
}

std::string notes_with(const ConvertReport& report, const ConvertSettings& settings, Mode mode) {
  const ModelInfo info{.mode = mode, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 200};
  std::string all;
  for (const std::string& note : detail::notes_of(report, settings, info, 1000)) all += note + "\n";
  return all;
}

TEST(Verdict, DoesNotSayThatNothingWentWhereSomeIsMissing) {
  ConvertReport report;
  report.coverage.share = 0.64;
  report.coverage.missing_near = {1, 2, 3};
  const ModelInfo info{.mode = Mode::Tolerant, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 300};
  const std::string said = verdict(report, info);
  EXPECT_NE(said.find("36 % of what can be seen of it is missing"), std::string::npos) << said;
  EXPECT_EQ(said.find("nothing was removed"), std::string::npos) << said;
}

TEST(Notes, TheUsualErrorIsNotMissedInSilence) {
  ConvertReport report;
  report.slabs = report.slabs_asked = 200;
  report.error = 1e-4;
  report.slabs_too_coarse = 150;
  report.too_coarse_most = 5e-3;
  EXPECT_NE(notes_with(report, for_slabs(200), Mode::Certified)
                .find("the usual error of 0.0001 of the diagonal, 0.02 mm, is not kept in 150 of 200 slabs: between "
                      "samples their surface lies up to 1 mm off; more --slabs bring it nearer"),
            std::string::npos);
  report.error_asked = true;
  const std::string asked = notes_with(report, for_slabs(200), Mode::Certified);
  EXPECT_NE(asked.find("--error 0.0001, 0.02 mm, is not kept in 150 of 200 slabs"), std::string::npos) << asked;
  // Slabs as small as the source's triangles cannot be more.
  report.slabs = 1000;
  report.slabs_asked = 2000;
  const std::string finest = notes_with(report, for_slabs(2000), Mode::Certified);
  EXPECT_EQ(finest.find("more --slabs"), std::string::npos) << finest;
  EXPECT_EQ(to_string(report).find("--slabs"), std::string::npos) << to_string(report);
}

TEST(Notes, ATolerantResultThatNobodyAskedForNamesARemedy) {
  ConvertReport report;
  EXPECT_NE(notes_with(report, for_slabs(200), Mode::Tolerant).find("--remesh, which"), std::string::npos);
  report.remesh = {.voxel = 0.01};
  EXPECT_NE(notes_with(report, for_slabs(200), Mode::Tolerant).find("--remesh=0.005"), std::string::npos);
  EXPECT_EQ(notes_with(report, for_slabs(200), Mode::Certified).find("--remesh=0."), std::string::npos);
  ConvertSettings tolerant = for_slabs(200);
  tolerant.mode = Mode::Tolerant;
  EXPECT_EQ(notes_with(report, tolerant, Mode::Tolerant).find("--remesh=0."), std::string::npos);
}

TEST(Notes, SheetsAlongEachOtherNameARemeshUnlessItWasDone) {
  ConvertReport report;
  report.repair.corners_on_edges = 1;
  EXPECT_NE(notes_with(report, for_slabs(200), Mode::Certified).find("--remesh joins them"), std::string::npos);
  EXPECT_EQ(to_string(report.repair).find("--remesh"), std::string::npos);
  report.remesh = {.voxel = 0.01};
  EXPECT_EQ(notes_with(report, for_slabs(200), Mode::Certified).find("--remesh joins them"), std::string::npos);
}

/// All notes of conversions but those of options, with one and with several of each thing; each once, in order.
std::set<std::string> notes_of_conversions() {
  const ModelInfo info{.mode = Mode::Certified, .unit = Unit::Millimetre, .source = {}, .source_diagonal = 130};
  std::set<std::string> all;
  const auto add = [&](const auto& set) {
    ConvertReport report;
    report.clay.below.least = 1;
    report.slabs = report.slabs_asked = 200;
    set(report);
    const std::vector<std::string> notes = detail::notes_of(report, {}, info, 200);
    EXPECT_FALSE(notes.empty());
    for (const std::string& note : notes)
      if (!note.contains("--")) all.insert(note);
  };
  for (const std::size_t n : {1U, 3U}) {
    add([&](ConvertReport& r) { r.given_triangles = 4, r.repair.duplicate_triangles = n; });
    add([&](ConvertReport& r) { r.given_triangles = 4, r.repair.degenerate_triangles = n; });
    for (const std::size_t parts : {std::size_t{1}, n})
      add([&](ConvertReport& r) { r.strays = {.components = parts, .triangles = n, .near = {1, 2, 3}, .away = 50}; });
    add([&](ConvertReport& r) { r.split_high_valence = n; });
    add([&](ConvertReport& r) { r.truncated_spikes = n; });
    add([&](ConvertReport& r) { r.specks = n; });
    add([](ConvertReport& r) { r.undecided = {0.18, {1, 2, 3}}; });
    add([&](ConvertReport& r) { r.slabs = n, r.slabs_asked = r.slabs_too_coarse = 1, r.error = 1e-4; });
    for (int kind = 0; kind <= static_cast<int>(detail::DefectKind::Fold); ++kind) {
      const detail::Obstacle obstacle = {.kind = static_cast<detail::DefectKind>(kind), .place = {}, .count = n};
      add([&](ConvertReport& r) { r.left_out = {{n, {1, 2, 3}, 1e-5, detail::clause(obstacle)}}; });
      add([&](ConvertReport& r) {
        r.remesh = {.voxel = 0.02};
        r.not_certified = detail::why_no_shell(obstacle, {1, 2, 3});
      });
    }
  }
  add([](ConvertReport& r) { r.remesh = {.voxel = 0.02}, r.slabs_that_hold = 300; });
  add([](ConvertReport& r) { r.remesh = {.voxel = 0.02}, r.not_certified = detail::why_refused({}); });
  add([](ConvertReport& r) { r.clay.below.thin_fibres = 0.03, r.clay.below.least = 1e-4; });
  return all;
}

// The file is what the studio's test looks up in its other languages.
TEST(Notes, AreThoseOfTheFileThatIsTranslated) {
  std::ifstream file(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data/notes_of_conversions.txt");
  std::set<std::string> listed;
  for (std::string note; std::getline(file, note);) listed.insert(note);
  const std::set<std::string> made = notes_of_conversions();
  for (const std::string& note : made) EXPECT_TRUE(listed.contains(note)) << "not in the file: " << note;
  for (const std::string& note : listed) EXPECT_TRUE(made.contains(note)) << "never said: " << note;
}

TEST(Failures, SayWhatAndWhy) {
  using namespace detail;
  const auto said = [](const std::unexpected<Error>& error) { return error.error().message; };
  EXPECT_EQ(said(outside_range(Setting::Slabs, 2000001, {4, 1000000})),
            "the number of slabs is 2000001; it must be 4 to 1000000.");
  EXPECT_EQ(said(outside_range(Setting::Intervals, 129, {1, 128})),
            "the number of intervals per edge is 129; it must be 0 (chosen per slab) or 1 to 128.");
  EXPECT_EQ(said(outside_range(Setting::Error, 1e-8, {1e-7, 1})),
            "the error is 1e-08; it must be 1e-07 to 1, a share of the diagonal.");
  EXPECT_EQ(said(outside_range(Setting::ColourIntervals, -1, {1, 128})),
            "the number of colour intervals per edge is -1; it must be 0 (chosen for the colours) or 1 to 128.");
  EXPECT_EQ(said(outside_range(Setting::Voxel, 0.2, {1e-5, 0.1})),
            "the voxel to remesh with is 0.2; it must be 0 (chosen from the source) or 1e-05 to 0.1, a share of the "
            "diagonal.");
  EXPECT_EQ(said(outside_range(Setting::Thickness, 2, {1e-4, 1})),
            "the thickness is 2; it must be 0.0001 to 1, a share of the diagonal.");
  EXPECT_EQ(said(cancelled(Work::Conversion)), "conversion was cancelled.");
  EXPECT_EQ(said(cancelled(Work::Remesh)), "remeshing was cancelled.");
  EXPECT_EQ(said(cancelled(Work::Room)), "making room was cancelled.");
  EXPECT_EQ(said(cancelled(Work::Other)), "cancelled");
  EXPECT_EQ(said(not_enough_memory(7, 200)),
            "there is not enough memory for 7 triangles and 200 slabs; use fewer --slabs.");
  EXPECT_EQ(said(too_far_from_the_origin(1e14, 0.09)),
            "the source lies 1e+14 from the origin, and its triangles, 0.09 across, are too small for that; move it "
            "nearer to the origin.");
  EXPECT_EQ(said(size_out_of_bounds(1e40, {1e-36, 1e36})),
            "the source is 1e+40 across; coordinates of this size cannot be computed with; scale it to between 1e-36 "
            "and 1e+36.");
  EXPECT_EQ(said(voxels_too_small(0.0002441)),
            "the voxels to remesh with are too small; this source can take 0.000245 of its diagonal or more.");
  EXPECT_EQ(said(no_room(NoRoom::OtherCage)), "the room was made for another cage.");
  EXPECT_EQ(said(no_room(NoRoom::OtherModel)), "the room was made for another model.");
  EXPECT_EQ(said(slabs_refused("why", Mode::Certified, false)),
            "the verifier refused the slabs: why; use --remesh or --mode tolerant.");
  EXPECT_EQ(said(not_written("out\n.ply")), "out\\x0a.ply: not written, as the export was cancelled");
  EXPECT_EQ(fault_of_tiles(Layer::Colour, "why"), "the tiles of colour: why");
  EXPECT_EQ(voxels_too_small(1).error().code, Errc::InvalidArgument);
  EXPECT_EQ(no_room(NoRoom::NoNumbers).error().code, Errc::InvalidArgument);
  EXPECT_EQ(nothing_as_large_as_voxels().error().code, Errc::Corrupt);
  EXPECT_EQ(samples_refused("why").error().code, Errc::Unfoldable);
}

TEST(ToString, OneOfAThingIsSaidAsOne) {
  ConvertReport report;
  report.remesh = {.voxel = 0.01, .sheets = 1, .crumbs = 1};
  report.skin = ConvertReport::Skin{.repaired = 1};
  report.moved_vertices = report.replaced_triangles = report.parted_vertices = 1;
  report.source_triangles = report.slabs = 1;
  const std::string said = to_string(report);
  for (const char* many : {"1 parts", "1 points", "1 triangles", "1 slabs", "1 vertices", "1 source vertices"})
    EXPECT_EQ(said.find(many), std::string::npos) << said;
  EXPECT_NE(said.find("1 part that closes nothing off became a sheet"), std::string::npos) << said;
  EXPECT_NE(said.find("1 part of a few voxels was left out"), std::string::npos) << said;
}

}  // namespace
}  // namespace relief
