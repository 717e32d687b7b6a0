#include <relief/convert/shell/shell_draft.h>

#include <array>
#include <numeric>
#include <utility>

namespace relief::detail {

void ReferenceLists::pack() {
  std::vector<std::uint32_t> order;  // of slabs with lists, as these lie in memory
  for (std::uint32_t f = 0; f < ranges_.size(); ++f) {
    if (ranges_[f].count > 0)
      order.push_back(f);
    else
      ranges_[f] = {};
  }
  std::ranges::sort(order, {}, [&](std::uint32_t f) { return ranges_[f].begin; });
  auto end = pool_.begin();
  for (const std::uint32_t f : order) {
    Range& range = ranges_[f];
    const auto from = pool_.begin() + range.begin;
    range.begin = static_cast<std::uint32_t>(end - pool_.begin());
    end = from == end ? from + range.count : std::copy(from, from + range.count, end);
  }
  pool_.erase(end, pool_.end());
}

void add_plane(const SourceIndex& source, std::uint32_t t, Quadric& quadric) noexcept {
  const Vec3d n = source.cross_of(t);
  const double size = length(n);
  if (size > 0) quadric.add_plane(n / size, to_double(source.points[source.faces[t][0]]), size / 6);
}

ShellDraft finest_draft(const SourceIndex& source, std::vector<Ends>&& ends, std::vector<std::uint32_t>&& component) {
  ShellDraft draft;
  draft.faces = source.faces;
  draft.ends = std::move(ends);
  draft.component = std::move(component);
  draft.at.reserve(source.points.size());
  for (const LatticePoint p : source.points) draft.at.push_back(to_double(p));
  draft.quadrics.resize(source.points.size());
  for (std::uint32_t t = 0; t < source.faces.size(); ++t)
    for (const std::uint32_t v : source.faces[t]) add_plane(source, t, draft.quadrics[v]);
  draft.lists.resize(draft.faces.size());
  draft.from.resize(draft.faces.size());
  std::iota(draft.from.begin(), draft.from.end(), 0U);
  return draft;
}

LinkedDraft::LinkedDraft(ShellDraft&& draft) : ShellDraft(std::move(draft)) {
  const std::size_t points = ends.size();
  twins = find_twins(faces, points);
  out.assign(points, kNone);
  valences.assign(points, 0);
  for (std::uint32_t h = 0; h < twins.size(); ++h) {
    out[origin(h)] = h;
    ++valences[origin(h)];
  }
  fixed.assign(points, 0);
  for (std::uint32_t h = 0; h < twins.size(); ++h)
    if (twins[h] == kNone) fixed[origin(h)] = fixed[target(h)] = 1;
  changed.assign(points, kAtFirst);
  alive_count = faces.size();
}

bool LinkedDraft::are_joined(std::uint32_t u, std::uint32_t v) const {
  bool joined = false;
  for_ring(u, [&](std::uint32_t e) { joined = joined || target(e) == v; });
  return joined;
}

void LinkedDraft::touch(std::uint32_t v) {
  ++clock;
  changed[v] = clock;
  for_ring(v, [&](std::uint32_t h) { changed[target(h)] = clock; });
}

bool LinkedDraft::link_allows(std::uint32_t h) const {
  const std::uint32_t u = origin(h), v = target(h);
  const int around = valences[u] + valences[v];  // the merged fibre has four faces less
  if (around < 3 + 4 || around > kMostValence + 4) return false;
  std::array<std::uint32_t, kMostValence + 4> neighbours;
  std::size_t count = 0, shared = 0;
  for_ring(u, [&](std::uint32_t e) { neighbours[count++] = target(e); });
  for_ring(v, [&](std::uint32_t e) {
    const std::uint32_t w = target(e);
    for (std::size_t k = 0; k < count; ++k) shared += neighbours[k] == w;
  });
  if (shared != 2) return false;
  return valences[target(next_of(h))] > 3 && valences[target(next_of(twins[h]))] > 3;
}

void LinkedDraft::collapse(std::uint32_t h) {
  const std::uint32_t u = origin(h), v = target(h), back = twins[h];
  const std::uint32_t a = target(next_of(h)), b = target(next_of(back));
  const std::uint32_t a_to_v = twins[next_of(h)], u_to_a = twins[last_of(h)];
  const std::uint32_t b_to_u = twins[next_of(back)], v_to_b = twins[last_of(back)];
  for_ring(v, [&](std::uint32_t e) { faces[e / 3][e % 3] = u; });
  faces[h / 3] = faces[back / 3] = {kNone, kNone, kNone};
  join(a_to_v, u_to_a);
  join(b_to_u, v_to_b);
  out[u] = u_to_a;
  out[a] = a_to_v;
  out[b] = b_to_u;
  out[v] = kNone;
  valences[u] = static_cast<std::uint16_t>(valences[u] + valences[v] - 4);
  --valences[a];
  --valences[b];
  alive_count -= 2;
}

void LinkedDraft::flip(std::uint32_t h) {
  const std::uint32_t back = twins[h], f = h / 3, g = back / 3;
  const std::uint32_t u = origin(h), v = target(h), a = target(next_of(h)), b = target(next_of(back));
  const std::uint32_t a_to_v = twins[next_of(h)], u_to_a = twins[last_of(h)];
  const std::uint32_t b_to_u = twins[next_of(back)], v_to_b = twins[last_of(back)];
  faces[f] = {u, b, a};
  faces[g] = {b, v, a};
  join(3 * f, b_to_u);
  join(3 * f + 1, 3 * g + 2);
  join(3 * f + 2, u_to_a);
  join(3 * g, v_to_b);
  join(3 * g + 1, a_to_v);
  --valences[u];
  --valences[v];
  ++valences[a];
  ++valences[b];
  out[u] = 3 * f;
  out[b] = 3 * g;
  out[v] = 3 * g + 1;
  out[a] = 3 * f + 2;
}

}  // namespace relief::detail
