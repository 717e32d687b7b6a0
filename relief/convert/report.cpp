// What a conversion says to a person.
#include <relief/convert/convert.h>
#include <relief/convert/obstacle_text.h>
#include <relief/convert/report.h>
#include <relief/convert/support/words.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <utility>

namespace relief {

using namespace detail;

namespace {

/// "0.09 mm", from a share of the diagonal.
std::string distance(double share, const ModelInfo& info) {
  return rounded(share * info.source_diagonal) + " " + std::string(name(info.unit));
}

std::string place_in(Vec3d p, const ModelInfo& info) { return place(p, info.source_diagonal); }

std::string percent(double share) {
  const double value = 100 * share;
  return (value > 99 ? number(std::floor(100 * value) / 100) : rounded(value)) + " %";
}

/// Share of the diagonal: a cut half as deep as this is a scratch, and where a fibre has less below the surface it is
/// told.
constexpr double kShortOfClay = 0.01;

/// Adds a clause to a list that "; " parts.
void add(std::string& list, const std::string& clause) { list += (list.empty() ? "" : "; ") + clause; }

std::string vertices(std::size_t count) { return std::to_string(count) + (count == 1 ? " vertex" : " vertices"); }

/// "was" or "were".
std::string was(std::size_t count) { return count == 1 ? " was" : " were"; }

std::string of_diagonal(double share, const char* format) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), format, share);
  return text.data() + std::string(" of the diagonal");
}

/// What is missing of the source's visible area is told beside it: where some is, it is not said that nothing went.
std::string removed(const ConvertReport& report, const ModelInfo& info) {
  std::string text;
  if (report.strays.components > 0)
    add(text, counted(report.strays.triangles, "triangle") + " far off, near " + place_in(report.strays.near, info));
  if (report.specks > 0)
    add(text, counted(report.specks, "tiny component") +
                  (report.left_out.empty() ? "" : ", first near " + place_in(report.left_out.front().near, info)));
  if (report.dropped_parts > 0) add(text, "the smallest " + counted(report.dropped_parts, "part"));
  if (report.skin && report.skin->dropped > 0)
    add(text, counted(report.skin->dropped, "triangle") + " inside of other parts");
  if (report.skin && report.skin->open_parts > 0)
    add(text, counted(report.skin->open_parts, "open part") + " inside of others, near " +
                  place_in(report.skin->open_near, info));
  if (report.skin && report.skin->specks > 0) add(text, counted(report.skin->specks, "sliver") + " that cuts left");
  if (report.vanished_parts > 0) add(text, counted(report.vanished_parts, "part") + " with what was cut out");
  if (report.remesh && report.remesh->crumbs > 0)
    add(text, counted(report.remesh->crumbs, "part") + " of a few voxels");
  if (!text.empty()) return "removed: " + text;
  return report.coverage.share < 1 ? "" : "nothing was removed";
}

/// Why it is tolerant: no slabs have a proof, or it would speak of something else than the source; or else what kept it
/// from being certified. `how_far` the surface lies off, in words.
std::string reason(const ConvertReport& report, const std::string& how_far) {
  if (report.refused) return report.not_certified;
  if (report.parts.certified == 0) return "no proof was found with " + counted(report.slabs_asked, "slab");
  using Coverage = ConvertReport::Coverage;
  const Coverage& coverage = report.coverage;
  std::string why;
  if (coverage.share < Coverage::kWhole)
    why = "more than " + percent(1 - Coverage::kWhole) + " of what can be seen is missing";
  if (coverage.beyond > Coverage::kNear)
    why += (why.empty() ? "" : " and ") + ("it stands on a surface " + how_far) + " off the scan, more than " +
           percent(Coverage::kNear) + " of its diagonal";
  return why.empty() ? report.not_certified : why;
}

/// Why it is not the source that the slabs stand on, or not all of them meet it once.
std::string given_up(const ConvertReport& report, const ModelInfo& info) {
  std::string text;
  if (report.remesh)
    add(text, "it stands on a solid rebuilt with voxels of " + distance(report.remesh->voxel, info) +
                  (report.remesh->is_smooth ? ", without sharp edges" : ""));
  if (report.remesh && report.remesh->lost > 0)
    add(text, "lost, as it is thinner than a voxel: " + percent(report.remesh->lost) +
                  " of the solid's skin, as near " + place_in(report.remesh->lost_near, info));
  const std::size_t missing = report.fibres_cast - report.hits_single - report.hits_several;
  if (info.mode == Mode::Tolerant && report.hits_several > 0)
    add(text, percent(double(report.hits_several) / double(report.fibres_cast)) +
                  " of the fibres meet the surface several times");
  if (info.mode == Mode::Tolerant && missing > 0 && report.coverage.share == 1)
    add(text, percent(double(missing) / double(report.fibres_cast)) + " of the fibres meet nothing");
  return text;
}

}  // namespace

bool is_of_the_source(const ConvertReport& report) noexcept {
  return report.coverage.share >= ConvertReport::Coverage::kWhole &&
         report.coverage.beyond <= ConvertReport::Coverage::kNear;
}

double farthest_off(const ConvertReport& report) noexcept {
  return std::max({report.to_source.max, report.coverage.farthest, report.coverage.beyond});
}

std::string verdict(const ConvertReport& report, const ModelInfo& info) {
  const ConvertReport::Coverage& coverage = report.coverage;
  std::string text(1, static_cast<char>(std::toupper(name(info.mode).front())));
  text += name(info.mode).substr(1);
  if (info.mode == Mode::Tolerant) text += ", as " + reason(report, distance(coverage.beyond, info));
  text += "; within " + distance(farthest_off(report), info) + " of the scan";
  if (coverage.share < 1)
    text += ", but " + percent(1 - coverage.share) + " of what can be seen of it is missing, as near " +
            place_in(coverage.missing_near, info);
  if (const std::string gone = removed(report, info); !gone.empty()) text += "; " + gone;
  if (report.replaced_triangles > 0)
    text += "; patched: " + counted(report.replaced_triangles, "triangle") + ", at most " +
            distance(report.replaced_widest, info) + " across, near " + place_in(report.replaced_near, info);
  if (report.skin && report.skin->cut > 0)
    text += "; " + counted(report.skin->cut, "triangle") + " cut where parts overlap";
  if (report.closed_openings > 0) text += "; " + counted(report.closed_openings, "opening") + " left open";
  if (report.moved_vertices > 0)
    text += "; " + vertices(report.moved_vertices) + " moved by at most " + distance(report.moved_most, info);
  if (const std::string lost = given_up(report, info); !lost.empty()) text += "; " + lost;
  return text;
}

namespace {

/// What may lead to a certificate where nobody asked to do without; a sentence. Then no shell folds, and a model is
/// tolerant only because it is not of the source.
std::string remedy_of_tolerant(const ConvertReport& report) {
  if (!report.remesh) return "--remesh, which rebuilds the source as a solid, may lead to a certificate";
  return "smaller voxels keep more of the source: --remesh=" + rounded(report.remesh->voxel / 2);
}

}  // namespace

std::string remedy(Mode mode, bool is_remeshed) {
  if (mode == Mode::Tolerant) return "try more --slabs or a smaller --thickness";
  return is_remeshed ? "use --mode tolerant" : "use --remesh or --mode tolerant";
}

std::string to_string(const ConvertReport& report) {
  std::array<char, 600> line{};
  std::string text = to_string(report.repair);
  if (!text.empty() && text.back() != '\n') text += '\n';
  if (report.remesh) {
    const ConvertReport::Remesh& r = *report.remesh;
    text += "remeshed with voxels of " + of_diagonal(r.voxel, "%.2e") + "\n";
    if (r.sheets > 0)
      text += counted(r.sheets, "part") + (r.sheets == 1 ? " that closes" : " that close") + " nothing off became " +
              (r.sheets == 1 ? "a sheet" : "sheets") + " of two voxels\n";
    if (r.crumbs > 0) text += counted(r.crumbs, "part") + " of a few voxels" + was(r.crumbs) + " left out\n";
  }
  text += counted(report.source_triangles, "triangle") + " became " + counted(report.slabs, "slab") + "\n";
  std::snprintf(line.data(), line.size(),
                "%zu fibres: %zu meet the source once, %zu never, %zu several times\n"
                "distance, of the diagonal (rms, greatest): to the mended source %.2e, %.2e; back %.2e, %.2e\n"
                "  to the source as read %.2e, %.2e; back %.2e, %.2e\n"
                "thickness, of the diagonal: least %.2e, median %.2e\n",
                report.fibres_cast, report.hits_single, report.hits_none, report.hits_several, report.to_mended.rms,
                report.to_mended.max, report.from_mended.rms, report.from_mended.max, report.to_source.rms,
                report.to_source.max, report.from_source.rms, report.from_source.max, report.thickness_min,
                report.thickness_median);
  text += line.data();
  const auto side = [](const ClaySide& s) {
    return of_diagonal(s.least, "%.2e") + " at least, " + rounded(100 * s.thin_fibres) + " % of the fibres under " +
           number(ClaySide::kThin) + ", one in ten under " + rounded(s.tenth);
  };
  text += "clay below the surface: " + side(report.clay.below) + "\n  above it: " + side(report.clay.above) + "\n";
  if (report.slabs > report.slabs_asked)
    text += std::to_string(report.slabs_asked) +
            " slabs were the target: no way was found to keep the mode with fewer than " +
            std::to_string(report.slabs) + "\n";
  for (const std::string& note : report.notes) text += note + "\n";
  if (!report.not_certified.empty() && !report.remesh) text += "not certified: " + report.not_certified + "\n";
  if (report.parts.count > 1)
    for (const ConvertReport::Parts::Obstacle& part : report.parts.obstacles)
      text += "  part " + std::to_string(part.part) + " of " + std::to_string(report.parts.count) + ", " +
              counted(part.triangles, "triangle") + ": " + part.reason + ", first near " + place(part.near) + "\n";
  if (report.moved_vertices > 0)
    text += vertices(report.moved_vertices) + " of the source moved by at most " +
            of_diagonal(report.moved_most, "%.2e") + "\n";
  if (report.closed_openings > 0)
    text += counted(report.closed_openings, "opening") + " closed with fill triangles; samples on them are void\n";
  if (report.skin && report.skin->repaired > 0)
    text += counted(report.skin->repaired, "point") + " of the cuts moved by at most " +
            of_diagonal(report.skin->moved_most, "%.2e") + ", where these left slivers\n";
  if (report.parted_vertices > 0)
    text += vertices(report.parted_vertices) + was(report.parted_vertices) +
            " moved off others that lay there, or nearer than the lattice can tell apart\n";
  if (report.replaced_triangles > 0)
    text += counted(report.replaced_triangles, "triangle") +
            " cut out and closed with patches, where the source met itself, folded or was seen from no side, and "
            "around there; the widest hole was " +
            of_diagonal(report.replaced_widest, "%.2e") + " wide, near " + place(report.replaced_near) + "\n";
  if (report.vanished_parts > 0) text += counted(report.vanished_parts, "part") + " went with what was cut out\n";
  if (report.dropped_parts > 0)
    text += "without " + counted(report.dropped_parts, "part") + ", the smallest: more slabs would hold them\n";
  double seconds = 0;
  for (const ConvertReport::Phase& phase : report.phases) seconds += phase.seconds;
  std::snprintf(line.data(), line.size(), "%.2f s of CPU:", seconds);
  text += line.data();
  for (const ConvertReport::Phase& phase : report.phases) {
    std::snprintf(line.data(), line.size(), " %s %.2f", phase.name.c_str(), phase.seconds);
    text += line.data();
  }
  return text + "\n";
}

namespace detail {
namespace {

/// Returns where coordinates are coarser than the shape they describe, triangles collapse, and some of the others
/// coincide. Where triangles coincide and few have collapsed, the file has the surface twice.
std::string collapsed(const ConvertReport& report) {
  constexpr double kMany = 0.2;  // of the triangles
  const std::size_t triangles = report.given_triangles;
  const std::size_t flat = report.repair.degenerate_triangles, twice = report.repair.duplicate_triangles;
  if (double(flat + twice) <= kMany * double(triangles)) return {};
  const std::string of_all = " of " + counted(triangles, "triangle");
  if (twice > flat)
    return std::to_string(twice) + of_all +
           (twice == 1 ? " has the same corners as another and was" : " have the same corners as another and were") +
           " left out: the file has these faces more than once";
  return std::to_string(flat + twice) + of_all +
         (flat + twice == 1 ? " has no area or coincides" : " have no area or coincide") +
         ": the file's coordinates may be too coarse for the shape, as far "
         "from the origin";
}

std::string left_out(const ConvertReport::LeftOut& speck, double step, const ModelInfo& info) {
  return "a part of " + counted(speck.triangles, "triangle") + " at " + place_in(speck.near, info) + ", only " +
         number(speck.across) +
         " of the diagonal across, was left out, as no slabs stand on it with lattice steps of " + number(step) +
         " of the diagonal: " + speck.reason;
}

/// That the error requested, or the usual one, is not kept everywhere, how far off the model lies there, and what
/// helps.
std::string missed_error(const ConvertReport& report, std::size_t mended_triangles, const ModelInfo& info) {
  const std::string aim = report.error_asked ? "--error " + number(report.error)
                                             : "the usual error of " + number(report.error) + " of the diagonal";
  const bool has_more = report.slabs < mended_triangles;
  return aim + ", " + distance(report.error, info) + ", is not kept in " + std::to_string(report.slabs_too_coarse) +
         " of " + counted(report.slabs, "slab") + ": between samples their surface lies up to " +
         distance(report.too_coarse_most, info) + " off" + (has_more ? "; more --slabs bring it nearer" : "");
}

}  // namespace

std::vector<std::string> notes_of(const ConvertReport& report, const ConvertSettings& settings, const ModelInfo& info,
                                  std::size_t mended_triangles) {
  std::vector<std::string> notes;
  const auto note = [&](std::string sentence) {
    if (!sentence.empty()) notes.push_back(std::move(sentence));
  };
  const std::string asked = std::to_string(report.slabs_asked), slabs = std::to_string(report.slabs);
  note(collapsed(report));
  if (report.strays.components > 0)
    note(counted(report.strays.triangles, "triangle") + " in " + counted(report.strays.components, "part") +
         (report.strays.components == 1 ? " that lies" : " that lie") +
         " farther off than ten times the rest is across, the farthest " + rounded(report.strays.away) +
         " times, near " + place_in(report.strays.near, info) + "," + was(report.strays.triangles) + " left out");
  if (report.split_high_valence > 0)
    note(vertices(report.split_high_valence) +
         " had very many triangles around, which rings divide now; the surface stays within the rounding of the "
         "lattice");
  if (report.truncated_spikes > 0)
    note(vertices(report.truncated_spikes) +
         " had faces without a common front-facing direction and long edges: the tips, at most 0.002 of the diagonal "
         "long, were cut off "
         "and closed with patches");
  if (report.undecided.share > 0)
    note("inside and outside cannot be told apart for " + percent(report.undecided.share) +
         " of the surface, first near " + place_in(report.undecided.near, info) +
         "; close or delete the open sheets there");
  for (const ConvertReport::LeftOut& speck : report.left_out) note(left_out(speck, report.lattice_step, info));
  if (report.specks > report.left_out.size())
    note(std::to_string(report.specks - report.left_out.size()) + " more such" +
         (report.specks - report.left_out.size() == 1 ? " part was" : " parts were") + " left out");
  if (report.slabs < report.slabs_asked && mended_triangles < report.slabs_asked)
    note("--slabs " + asked + " is more than the " + std::to_string(mended_triangles) +
         " triangles of the mended source, and slabs are no smaller than these: there are " + slabs);
  if (report.fewest.slabs > report.slabs_asked)
    note("--slabs " + asked + " cannot be reached: the mended source has " + counted(report.fewest.components, "part") +
         " and " + counted(report.fewest.handles, "handle") +
         ", and a part takes 4 slabs, or 14 and more with handles: " + std::to_string(report.fewest.slabs) +
         " at least");
  if (report.clay.below.least < kShortOfClay)
    note("tools find little clay: " + percent(report.clay.below.thin_fibres) + " of the fibres have less than " +
         distance(ClaySide::kThin, info) + " below the surface, the least " + distance(report.clay.below.least, info) +
         " near " + place_in(report.clay.below.least_at, info));
  if (report.remesh && !settings.remesh)
    note("the source was rebuilt as a solid with voxels of " + number(report.remesh->voxel) + " of the diagonal: " +
         (report.slabs_that_hold > 0
              ? "no fewer than " + std::to_string(report.slabs_that_hold) + " slabs were found that hold it"
              : report.not_certified));
  if (report.is_fewest && report.fewest.slabs <= report.slabs_asked)
    note("no fewer than " + slabs + " slabs were found with fibres of at most " + number(settings.thickness) +
         " of the diagonal: a greater --thickness may allow fewer");
  if (settings.intervals == 0 && report.slabs_too_coarse > 0) note(missed_error(report, mended_triangles, info));
  if (settings.intervals > 0 && report.slabs_too_coarse > 0)
    note("--samples " + std::to_string(settings.intervals) + " loses detail in " +
         percent(double(report.slabs_too_coarse) / double(report.slabs)) + " of the slabs, which lie up to " +
         rounded(report.too_coarse_most) + " of the diagonal off; give more, or leave it out");
  if (report.repair.corners_on_edges > 0 && !report.remesh)
    note("where sheets lie along each other without common corners, --remesh joins them");
  if (info.mode == Mode::Tolerant && !settings.mode) note(remedy_of_tolerant(report));
  return notes;
}

std::string why_no_shell(const Obstacle& obstacle, Vec3d near) {
  return clause(obstacle) + ", first near " + place(near);
}

std::string why_refused(const verify::Certificate& certificate) {
  return certificate.failures.empty() ? "the shell failed its check" : certificate.failures.front().what;
}

std::string why_not_joined(const Error& error) { return "the slabs do not join: " + error.message; }

std::string not_of_the_source(const ConvertReport& report) {
  const ConvertReport::Coverage& coverage = report.coverage;
  if (coverage.share < ConvertReport::Coverage::kWhole)
    return "no certificate: " + percent(1 - coverage.share) + " of what can be seen would be missing, as near " +
           place(coverage.missing_near);
  return "no certificate: the certified surface would lie " + rounded(coverage.beyond) + " of the diagonal off";
}

std::string why_tolerant(const ConvertReport& report) {
  return reason(report, rounded(report.coverage.beyond) + " of the diagonal");
}

std::unexpected<Error> no_shell(const ConvertReport& report, const ConvertSettings& settings) {
  const Mode mode = settings.mode.value_or(Mode::Tolerant);
  const std::string what = mode == Mode::Certified ? "no certificate: " : "no slabs hold it: ";
  return fail(Errc::Unfoldable, what + report.not_certified + "; " + remedy(mode, settings.remesh.has_value()) + ".");
}

}  // namespace detail
}  // namespace relief
