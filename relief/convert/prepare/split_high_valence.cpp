#include <relief/convert/prepare/split_high_valence.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace relief::detail {
namespace {

constexpr double kOff = 0.25;       // lattice steps: how far the surface may come to lie from where it was
constexpr double kShortest = 16;    // lattice steps: edges of a ring, below which rounding would turn its triangles
constexpr double kLeastFlat = 0.5;  // cosine between what a ring leaves out and what takes its place

/// One fan while it is divided. What stands in the place of its faces is collected, from the rim inwards.
class Fan {
 public:
  /// Nothing where the faces, all of which have the vertex v, do not run around it once.
  static std::optional<Fan> make(const ClosedSource& source, std::uint32_t v, std::span<const std::uint32_t> faces);

  /// Puts rings inside until at most kHighValence points are left; false when there is no room for any.
  bool divide(std::vector<LatticePoint>& points);
  /// Returns the faces that take the place of the fan's.
  [[nodiscard]] std::vector<Face> take_faces() &&;

 private:
  [[nodiscard]] std::optional<double> widest_half() const;

  std::uint32_t middle_ = 0;
  Vec3d at_;
  std::vector<Vec3d> spokes_;            // unit, all of the rim's
  std::vector<Vec3d> normals_;           // unit, of the given faces: k lies between the spokes k and k + 1
  std::vector<std::uint32_t> ring_;      // the innermost ring's points
  std::vector<std::uint32_t> spoke_of_;  // by point of it, ascending
  double width_ = Box3d::kFar;           // of it: the least distance of a point from the middle
  std::vector<Face> faces_;
};

std::optional<Fan> Fan::make(const ClosedSource& source, std::uint32_t v, std::span<const std::uint32_t> faces) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;  // of the rim
  for (const std::uint32_t f : faces) {
    const Face& t = source.faces[f];
    const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
    edges.emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  Fan fan;
  fan.middle_ = v;
  fan.at_ = to_double(source.points[v]);
  std::uint32_t at = edges.front().first;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto edge = std::lower_bound(edges.begin(), edges.end(), std::pair(at, 0U));
    if (edge == edges.end() || edge->first != at || (k > 0 && at == fan.ring_.front())) return std::nullopt;
    const Vec3d spoke = to_double(source.points[at]) - fan.at_;
    const double size = length(spoke);
    if (!(size > 0)) return std::nullopt;
    fan.width_ = std::min(fan.width_, size);
    fan.spoke_of_.push_back(static_cast<std::uint32_t>(k));
    fan.ring_.push_back(at);
    fan.spokes_.push_back(spoke / size);
    at = edge->second;
  }
  if (at != fan.ring_.front()) return std::nullopt;
  for (std::size_t k = 0; k < edges.size(); ++k)
    fan.normals_.push_back(normalized(cross(fan.spokes_[k], fan.spokes_[(k + 1) % edges.size()])));
  return fan;
}

/// Returns how far from the middle every other spoke of the ring may end, if any distance will do.
std::optional<double> Fan::widest_half() const {
  double off = 0, shortest = Box3d::kFar;  // of a ring of radius 1
  for (std::size_t k = 0; k < ring_.size(); k += 2) {
    const std::size_t last = k + 2 < ring_.size() ? spoke_of_[k + 2] : spokes_.size();
    const Vec3d from = spokes_[spoke_of_[k]], to = spokes_[last % spokes_.size()];
    const Vec3d n = normalized(cross(from, to));
    for (std::size_t between = spoke_of_[k]; between < last; ++between) {
      if (!(dot(n, normals_[between]) > kLeastFlat)) return std::nullopt;
      off = std::max(off, std::abs(dot(n, spokes_[between])));
    }
    shortest = std::min(shortest, length(to - from));
  }
  const double widest = std::min(0.5 * width_, kOff / std::max(off, 1e-12));
  if (widest * shortest < kShortest) return std::nullopt;
  return widest;
}

bool Fan::divide(std::vector<LatticePoint>& points) {
  while (ring_.size() > kHighValence) {
    const std::optional<double> width = widest_half();
    if (!width) break;
    const auto first = static_cast<std::uint32_t>(points.size());
    std::vector<std::uint32_t> ring, spoke_of;
    for (std::size_t k = 0; k < ring_.size(); k += 2) {
      ring.push_back(first + static_cast<std::uint32_t>(k / 2));
      spoke_of.push_back(spoke_of_[k]);
      points.push_back(snap(at_ + spokes_[spoke_of_[k]] * *width));
    }
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const std::uint32_t a = ring[k], b = ring[(k + 1) % ring.size()];
      const std::uint32_t from = ring_[2 * k], to = ring_[(2 * k + 2) % (2 * ring.size())];
      if (2 * k + 1 == ring_.size()) {
        faces_.insert(faces_.end(), {Face{a, from, ring_.front()}, Face{a, ring_.front(), b}});
      } else {
        const std::uint32_t between = ring_[2 * k + 1];
        faces_.insert(faces_.end(), {Face{a, from, between}, Face{a, between, b}, Face{b, between, to}});
      }
    }
    ring_ = std::move(ring);
    spoke_of_ = std::move(spoke_of);
    width_ = *width;
  }
  return !faces_.empty();
}

std::vector<Face> Fan::take_faces() && {
  for (std::size_t k = 0; k < ring_.size(); ++k) faces_.push_back({middle_, ring_[k], ring_[(k + 1) % ring_.size()]});
  return std::move(faces_);
}

}  // namespace

std::vector<std::uint32_t> valences_of(const ClosedSource& source) {
  std::vector<std::uint32_t> valences(source.points.size(), 0);
  for (const Face& f : source.faces)
    for (const std::uint32_t v : f) ++valences[v];
  return valences;
}

std::size_t split_high_valence(ClosedSource& source) {
  // Fans that share faces take turns: most have no such neighbours.
  constexpr int kTurns = 8;
  std::size_t divided = 0;
  const std::size_t given = source.points.size();
  std::vector<std::uint8_t> done(given, 0);
  for (int turn = 0; turn < kTurns; ++turn) {
    const std::vector<std::uint32_t> valences = valences_of(source);
    std::vector<std::uint32_t> fan_of(source.points.size(), 0);
    std::vector<std::uint32_t> middles;
    for (std::uint32_t v = 0; v < given; ++v)
      if (done[v] == 0 && valences[v] > kHighValence) middles.push_back(v);
    if (middles.empty()) break;
    for (std::size_t k = 0; k < middles.size(); ++k) fan_of[middles[k]] = static_cast<std::uint32_t>(k + 1);
    std::vector<std::vector<std::uint32_t>> fans(middles.size());
    std::vector<std::uint8_t> waits(middles.size(), 0);
    for (std::uint32_t f = 0; f < source.faces.size(); ++f)
      for (const std::uint32_t v : source.faces[f]) {
        if (fan_of[v] == 0) continue;
        fans[fan_of[v] - 1].push_back(f);
        for (const std::uint32_t w : source.faces[f])
          if (fan_of[w] != 0 && fan_of[w] < fan_of[v]) waits[fan_of[v] - 1] = 1;
      }
    for (std::size_t k = 0; k < middles.size(); ++k) {
      if (waits[k] != 0) continue;
      done[middles[k]] = 1;
      const std::uint8_t patch = source.patch[fans[k].front()], phantom = source.phantom[fans[k].front()];
      const auto same = [&](std::uint32_t f) { return source.patch[f] == patch && source.phantom[f] == phantom; };
      if (!std::all_of(fans[k].begin(), fans[k].end(), same)) continue;
      std::optional<Fan> fan = Fan::make(source, middles[k], fans[k]);
      if (!fan || !fan->divide(source.points)) continue;
      ++divided;
      const std::vector<Face> faces = std::move(*fan).take_faces();
      for (std::size_t f = 0; f < fans[k].size(); ++f) source.faces[fans[k][f]] = faces[f];
      source.faces.insert(source.faces.end(), faces.begin() + std::ptrdiff_t(fans[k].size()), faces.end());
      source.patch.resize(source.faces.size(), patch);
      source.phantom.resize(source.faces.size(), phantom);
    }
  }
  return divided;
}

}  // namespace relief::detail
