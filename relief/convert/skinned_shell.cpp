#include <relief/base/compact.h>
#include <relief/convert/geometry/components.h>
#include <relief/convert/skin/outer_skin.h>
#include <relief/convert/skinned_shell.h>
#include <relief/convert/stage_meshes.h>

#include <cstddef>
#include <utility>

namespace relief::detail {
namespace {

/// Leaves out the parts that are mere tiny components.
void drop_specks(Skinned& skinned, const std::vector<Obstacle>& specks) {
  const Components parts = find_components(skinned.source.points.size(), skinned.source.faces);
  std::vector<std::uint8_t> stays(parts.count, 1);
  for (const Obstacle& speck : specks) stays[speck.component] = 0;
  keep_entries([&](std::size_t part) { return stays[part] != 0; }, skinned.part_of);
  ClosedSource& s = skinned.source;
  keep_entries([&](std::size_t f) { return stays[parts.of_face[f]] != 0; }, s.faces, s.patch, s.phantom,
               skinned.face_of);
  skinned.report->specks += specks.size();
}

/// Parts with fill triangles of which a skin has nothing.
struct OpenParts {
  std::size_t count = 0;
  LatticePoint near;  ///< of the first
};
OpenParts open_parts_without(const ClosedSource& given, const Components& parts,
                             const std::vector<std::uint32_t>& faces_of_skin) {
  std::vector<std::uint8_t> is_done(parts.count, 0);
  for (const std::uint32_t f : faces_of_skin) is_done[parts.of_face[f]] = 1;
  OpenParts found;
  for (std::size_t f = 0; f < given.faces.size(); ++f) {
    if (given.phantom[f] == 0 || std::exchange(is_done[parts.of_face[f]], 1) != 0) continue;
    if (found.count++ == 0) found.near = given.points[given.faces[f][0]];
  }
  return found;
}

}  // namespace

bool asks_for_skin(const Overlaps& overlaps, std::size_t faces, bool is_last) noexcept {
  const bool any = overlaps.between + overlaps.within + overlaps.patched > 0;
  return overlaps.between > 0 || overlaps.nested > 0 || overlaps.within > few_to_smooth(faces) || (is_last && any);
}

Skinned take_skin(ClosedSource&& given, const Lattice& lattice, double of_diagonal, const StageSink& show,
                  const Progress& progress) {
  auto skin = outer_skin(given, progress);
  if (!skin || skin->fault != OuterSkin::Fault::None) return {std::move(given), {}, {}};
  const Components parts = find_components(given.points.size(), given.faces);
  if (show) {
    std::vector<std::uint32_t> part;
    for (const std::uint32_t f : skin->from) part.push_back(parts.of_face[f]);
    show_skin(show, skin->source, part, lattice);
  }
  const Components of_skin = find_components(skin->source.points.size(), skin->source.faces);
  Skinned skinned{std::move(skin->source), std::move(skin->from), std::vector<std::uint32_t>(of_skin.count, 0)};
  for (std::size_t f = skinned.face_of.size(); f-- > 0;)
    skinned.part_of[of_skin.of_face[f]] = parts.of_face[skinned.face_of[f]];
  const OpenParts gone = open_parts_without(given, parts, skinned.face_of);
  skinned.report = {.cut = skin->cut,
                    .dropped = skin->dropped,
                    .open_parts = gone.count,
                    .open_near = lattice.to_model(gone.near),
                    .coincident = skin->coincident,
                    .repaired = skin->repaired,
                    .moved_most = skin->moved_most * of_diagonal,
                    .crossing = skin->crossing,
                    .specks = skin->slivers};
  skinned.undecided = {skin->undecided * lattice.step * lattice.step, lattice.to_model(skin->undecided_at)};
  return skinned;
}

CertifiedShell certify_skin(Skinned& skinned, CertifiedSettings settings, const Progress& progress) {
  if (!skinned.report) return build_certified(std::move(skinned.source), settings, progress);
  settings.limits.creased = true;
  CertifiedShell made = build_certified(skinned.source, settings, progress);
  while (!made.prepared.specks.empty() && made.prepared.specks.size() < skinned.part_of.size()) {
    drop_specks(skinned, made.prepared.specks);
    made = build_certified(skinned.source, settings, progress);
  }
  for (std::uint32_t& f : made.prepared.bad_faces) f = skinned.face_of[f];
  for (Obstacle& bad : made.prepared.bad_components) bad.component = skinned.part_of[bad.component];
  made.prepared.specks.clear();
  return made;
}

}  // namespace relief::detail
