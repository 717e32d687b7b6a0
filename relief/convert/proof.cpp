#include <relief/base/try.h>
#include <relief/convert/failures.h>
#include <relief/convert/proof.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <tuple>
#include <utility>

namespace relief {
namespace {

verify::Certificate certificate_of(const Model& model, TriangleMesh mended, const Progress& progress) {
  const PlainCage shell(model.head->slab_mesh());
  const PlainSource source(std::move(mended));
  return verify::check(view(shell), source.view(), progress);
}

}  // namespace

verify::Shell view(const PlainCage& cage) noexcept { return {cage.inner, cage.outer, cage.triangles}; }

PlainSource::PlainSource(TriangleMesh&& mesh)
    : positions(std::move(mesh.positions)), triangles(std::move(mesh.triangles)), phantom_from(mesh.phantom_from) {
  mesh = {};  // colours and images
  const auto place = [&](std::uint32_t v) { return std::tie(positions[v].x, positions[v].y, positions[v].z); };
  std::vector<std::uint32_t> order, number(positions.size());
  order.reserve(positions.size());
  for (std::uint32_t v = 0; v < positions.size(); ++v)
    if (is_finite(positions[v])) order.push_back(v);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple_cat(place(a), std::tie(a)) < std::tuple_cat(place(b), std::tie(b));
  });
  std::iota(number.begin(), number.end(), 0U);
  for (std::size_t k = 1; k < order.size(); ++k)
    if (positions[order[k]] == positions[order[k - 1]]) number[order[k]] = number[order[k - 1]];
  for (auto& t : triangles)
    for (std::uint32_t& v : t)
      if (v < number.size()) v = number[v];
}

verify::Source PlainSource::view() const {
  return {
      {positions.empty() ? nullptr : &positions.front().x, positions.size(), sizeof(Vec3d)}, triangles, phantom_from};
}

TileFaults faults_of_tiles(const Snapshot& head, const verify::Certificate& certificate, const Progress& progress) {
  if (!certificate.holds[0] || progress.cancelled()) return {};
  const PlainCage roots(head.slab_mesh()), pieces = PlainCage::of_pieces(head.slab_mesh());
  for (const auto& [layer, between] :
       {std::pair{Layer::Displacement, verify::Between::Linear}, std::pair{Layer::Void, verify::Between::Nearer},
        std::pair{Layer::Folded, verify::Between::Nearer}}) {
    if (!head.has(layer)) continue;
    std::vector<verify::SampleTile> tiles;
    tiles.reserve(head.slab_mesh().slab_count());
    for (SlabId s = 0; s < head.slab_mesh().slab_count(); ++s) {
      const Tile& tile = head.tile(layer, s);
      tiles.push_back({tile.intervals(), {tile.plane(), tile.size()}});
      tile.rest();
    }
    const auto was_read = [&](SlabId s) { head.tile(layer, s).rest(); };
    const verify::TileCheck found = head.slab_mesh().is_cut()
                                        ? verify::check_tiles(view(roots), view(pieces), tiles, between, was_read)
                                        : verify::check_tiles(view(pieces), tiles, between, was_read);
    if (found.failure_count > 0) return {detail::fault_of_tiles(layer, found.failures.front().what), found.slabs};
  }
  return {};
}

bool claims(Mode mode, verify::Condition condition) { return claims(mode).contains(verify::name(condition)); }

std::size_t claimed(const verify::Certificate& certificate, bool as_made) noexcept {
  return as_made ? certificate.asked() : verify::kShellConditionCount;
}

bool claim_holds(Mode mode, const verify::Certificate& certificate, bool as_made) {
  for (std::size_t k = 0; k < claimed(certificate, as_made); ++k)
    if (claims(mode, static_cast<verify::Condition>(k)) && !certificate.holds[k]) return false;
  return true;
}

std::string first_reason(Mode mode, const verify::Certificate& certificate, bool as_made) {
  const std::size_t count = claimed(certificate, as_made);
  for (const verify::Failure& f : certificate.failures)
    if (static_cast<std::size_t>(f.condition) < count && claims(mode, f.condition)) return f.what;
  for (std::size_t k = 0; k < count; ++k)
    if (const auto condition = static_cast<verify::Condition>(k); claims(mode, condition) && !certificate.holds[k])
      return detail::why_not_tested(condition);
  return detail::no_reason();
}

Result<verify::Certificate> prove(Conversion& made, const std::optional<Mode>& asked, bool is_remeshed,
                                  const Progress& progress) {
  verify::Certificate certificate = certificate_of(made.model, std::move(made.mended), progress);
  const TileFaults tiles = faults_of_tiles(*made.model.head, certificate, progress);
  if (progress.cancelled()) return detail::cancelled(detail::Work::Other);
  Mode& mode = made.model.info.mode;
  ConvertReport& report = made.report;
  if (mode == Mode::Certified && asked != Mode::Certified && !claim_holds(Mode::Certified, certificate)) {
    // The builder was wrong about its own work: what it made claims less, and says why.
    report.refused = true;
    report.not_certified = detail::why_not_proved(first_reason(Mode::Certified, certificate));
    if (claim_holds(Mode::Tolerant, certificate) &&
        certificate.holds[static_cast<std::size_t>(verify::Condition::C5)]) {
      mode = Mode::Tolerant;
      report.parts.certified = 0;
    }
  }
  // What might have been given up was not.
  if (mode == Mode::Tolerant && claim_holds(Mode::Certified, certificate) && report.hits_none == report.hits_missing &&
      report.hits_several == 0 && is_of_the_source(report)) {
    mode = Mode::Certified;
    report.parts.certified = report.parts.count;
    report.not_certified.clear();
  }
  if (!claim_holds(mode, certificate))
    return detail::slabs_refused(first_reason(mode, certificate), asked.value_or(mode), is_remeshed);
  if (!tiles.first.empty()) return detail::samples_refused(tiles.first);
  return certificate;
}

}  // namespace relief
