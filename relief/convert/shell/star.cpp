#include <relief/convert/shell/star.h>

#include <algorithm>

namespace relief::detail {

void Star::clear() noexcept {
  faces.clear();
  slots.clear();
  vanished.clear();
  fresh = second = 0;
  moved = kNone;
}

void Star::set_fibre(const LinkedDraft& draft, std::uint32_t v) {
  clear();
  moved = v;
  draft.for_ring(v, [&](std::uint32_t h) {
    faces.push_back({v, draft.target(h), draft.target(next_of(h))});
    slots.push_back(h / 3);
  });
}

void Star::set_edge(const LinkedDraft& draft, std::uint32_t h) {
  clear();
  const std::vector<std::uint32_t>& twins = draft.twins;
  moved = draft.origin(h);
  for (const std::uint32_t start : {h, twins[h]}) {
    second = faces.size();
    vanished.push_back(start / 3);
    const std::uint32_t stop = next_of(twins[start]);  // the first edge after the twin's face is reached
    for (std::uint32_t e = twins[last_of(start)]; e != stop; e = twins[last_of(e)]) {
      faces.push_back({moved, draft.target(e), draft.target(next_of(e))});
      slots.push_back(e / 3);
    }
  }
}

void Star::set_flip(const LinkedDraft& draft, std::uint32_t h) {
  clear();
  const std::uint32_t back = draft.twins[h];
  const std::uint32_t u = draft.origin(h), v = draft.target(h), a = draft.target(next_of(h)),
                      b = draft.target(next_of(back));
  faces = {{u, b, a}, {b, v, a}};
  slots = {h / 3, back / 3};
}

std::vector<LinkEdge> Star::link(const LinkedDraft& draft) const {
  std::vector<LinkEdge> edges;
  edges.reserve(2 * (faces.size() - fresh));
  for (std::size_t k = fresh; k < faces.size(); ++k)
    for (const Side side : {kInner, kOuter})
      edges.push_back({side, to_double(draft.ends[faces[k][1]][side]), to_double(draft.ends[faces[k][2]][side])});
  return edges;
}

Quality Star::quality(const LinkedDraft& draft, Vec3d at) const noexcept {
  Quality q;
  for (std::size_t k = fresh; k < faces.size(); ++k) {
    const Vec3d b = draft.at[faces[k][1]], c = draft.at[faces[k][2]];
    const double shape = shape_of(at, b, c, length(cross(b - at, c - at)));
    q.least = std::min(q.least, shape);
    q.mean += shape / double(faces.size());
  }
  return q;
}

Quality Star::quality_now(const LinkedDraft& draft) const noexcept {
  Quality q;
  for (const std::uint32_t f : slots) {
    const double shape = draft.shape(draft.faces[f]);
    q.least = std::min(q.least, shape);
    q.mean += shape / double(slots.size());
  }
  return q;
}

}  // namespace relief::detail
