#include <relief/convert/geometry/half_edges.h>
#include <relief/convert/remesh/fold_mending.h>
#include <relief/convert/support/parallel.h>
#include <relief/convert/support/sort_unique.h>

#include <algorithm>
#include <span>

namespace relief::detail {
namespace {

using Fit = FittedMesh::Fit;

constexpr double kSmooth = 0.985;  // cosine of ten degrees: normals of corners that no fold lies between
constexpr double kOnSkin = 0.02;   // voxels: a triangle so near to the skin is held against it
constexpr double kLeast = 1e-6;    // square voxels: what has less area looks nowhere
constexpr double kExact = 1e-6;    // voxels
constexpr int kPasses = 4;

class FoldMending {
 public:
  FoldMending(FittedMesh& mesh, const Skin& skin) : mesh_(mesh), skin_(skin) {}

  bool run(const Progress& progress) {
    bool changed = false;
    for (int pass = 0; pass < kPasses && mend(progress); ++pass) changed = true;
    return changed;
  }

 private:
  [[nodiscard]] Vec3d position(std::uint32_t v) const noexcept { return mesh_.positions[v]; }
  [[nodiscard]] std::uint32_t corner(std::uint32_t h) const noexcept { return mesh_.triangles[h / 3][h % 3]; }

  /// Says how a triangle looks: 1 the way the skin does, -1 against it; away from it -1 against all that its corners
  /// lie in, else 0.
  struct Look {
    int way = 0;
    double off = 0;  // voxels, of its middle
  };
  [[nodiscard]] Look look(const Triangle& t) const {
    const Vec3d a = position(t[0]), b = position(t[1]), c = position(t[2]);
    const Vec3d normal = cross(b - a, c - a);
    const Skin::Place near = skin_.nearest((a + b + c) / 3.0);
    if (near.distance < kOnSkin) return {dot(normal, near.normal) > kLeast ? 1 : -1, near.distance};
    const bool is_against =
        std::ranges::all_of(t, [&](std::uint32_t v) { return dot(normal, to_double(mesh_.normals[v])) < kLeast; });
    return {is_against ? -1 : 0, near.distance};
  }
  [[nodiscard]] bool is_smooth(const Triangle& t) const noexcept {
    return std::ranges::all_of(t, [&](std::uint32_t v) {
      return mesh_.fits[v] == Fit::OnFace && double(dot(mesh_.normals[v], mesh_.normals[t[0]])) > kSmooth;
    });
  }
  [[nodiscard]] bool is_folded(const Triangle& t) const {
    if (!is_smooth(t)) return look(t).way < 0;
    const Vec3d a = position(t[0]);
    return dot(cross(position(t[1]) - a, position(t[2]) - a), to_double(mesh_.normals[t[0]])) <= 0;
  }

  /// Returns whether triangles look the skin's way and lie as near to it as those whose place they take.
  [[nodiscard]] bool is_better(std::span<const Triangle> made, std::span<const Triangle> gone) const {
    double most = kExact;
    for (const Triangle& t : gone) most = std::max(most, look(t).off);
    return std::ranges::all_of(made, [&](const Triangle& t) {
      const Look at = look(t);
      return at.way >= 0 && at.off <= most;
    });
  }

  bool mend(const Progress& progress) {
    std::vector<std::uint8_t> folded(mesh_.triangles.size(), 0);
    for_all(folded.size(), 512, progress, [&](std::size_t t) {
      folded[t] = is_pending(mesh_.triangles[t]) && is_folded(mesh_.triangles[t]) ? 1 : 0;
    });
    for (std::uint8_t& bits : mesh_.pending) bits = static_cast<std::uint8_t>(bits & ~FittedMesh::kSeekFolds);
    if (std::ranges::find(folded, 1) == folded.end() || progress.cancelled()) return false;
    const Stars stars(mesh_.triangles, mesh_.positions.size());
    const std::vector<std::uint32_t> twins = find_twins(mesh_.triangles, mesh_.positions.size());
    touched_.assign(mesh_.positions.size(), 0);
    bool changed = false;
    for (std::uint32_t t = 0; t < folded.size(); ++t) {
      if (folded[t] == 0 || is_touched(mesh_.triangles[t])) continue;
      for (std::uint32_t h = 3 * t; h < 3 * t + 3; ++h)
        if (!is_touched(mesh_.triangles[twins[h] / 3]) &&
            (flip(stars, h, twins[h]) || collapse(stars, h) || collapse(stars, twins[h]))) {
          changed = true;
          break;
        }
    }
    std::erase_if(mesh_.triangles, [](const Triangle& t) { return t[0] == kNone; });
    return changed;
  }

  bool flip(const Stars& stars, std::uint32_t h, std::uint32_t g) {
    const std::uint32_t p = corner(h), q = corner(g), r = corner(last_of(h)), s = corner(last_of(g));
    if (are_joined(stars, r, s)) return false;
    const std::array<Triangle, 2> made = {{{r, p, s}, {s, q, r}}};
    if (!is_better(made, std::array{mesh_.triangles[h / 3], mesh_.triangles[g / 3]})) return false;
    mesh_.triangles[h / 3] = made[0];
    mesh_.triangles[g / 3] = made[1];
    touch(std::array{p, q, r, s});
    return true;
  }

  /// The start of half-edge h goes to its end, which lies on as many faces of the skin at least.
  bool collapse(const Stars& stars, std::uint32_t h) {
    const std::uint32_t gone = corner(h), kept = corner(next_of(h));
    if (mesh_.fits[gone] > mesh_.fits[kept]) return false;
    const std::vector<std::uint32_t> around = neighbours(stars, gone), others = neighbours(stars, kept);
    if (is_touched(around)) return false;
    std::vector<std::uint32_t> both;
    std::ranges::set_intersection(around, others, std::back_inserter(both));
    if (both.size() != 2 || others.size() < 4) return false;
    std::vector<Triangle> made, before;
    for (const std::uint32_t k : stars.of(gone)) {
      Triangle t = mesh_.triangles[k / 3];
      before.push_back(t);
      if (std::ranges::find(t, kept) != t.end()) continue;
      t[k % 3] = kept;
      made.push_back(t);
    }
    if (!is_better(made, before)) return false;
    for (const std::uint32_t k : stars.of(gone)) {
      Triangle& t = mesh_.triangles[k / 3];
      if (std::ranges::find(t, kept) != t.end())
        t = {kNone, kNone, kNone};
      else
        t[k % 3] = kept;
    }
    touch(around);
    touch(std::array{gone});
    return true;
  }

  [[nodiscard]] std::vector<std::uint32_t> neighbours(const Stars& stars, std::uint32_t v) const {
    std::vector<std::uint32_t> list;
    for (const std::uint32_t h : stars.of(v)) list.push_back(corner(next_of(h)));
    sort_unique(list);
    return list;
  }
  [[nodiscard]] bool are_joined(const Stars& stars, std::uint32_t v, std::uint32_t w) const {
    return std::ranges::any_of(stars.of(v), [&](std::uint32_t h) { return corner(next_of(h)) == w; });
  }
  /// Also where they are gone.
  [[nodiscard]] bool is_touched(std::span<const std::uint32_t> some) const noexcept {
    return std::ranges::any_of(some, [&](std::uint32_t v) { return v == kNone || touched_[v] != 0; });
  }
  void touch(std::span<const std::uint32_t> some) {
    for (const std::uint32_t v : some) {
      touched_[v] = 1;
      mesh_.pending[v] = FittedMesh::kSeekAll;
    }
  }
  [[nodiscard]] bool is_pending(const Triangle& t) const noexcept {
    return std::ranges::any_of(t, [&](std::uint32_t v) { return (mesh_.pending[v] & FittedMesh::kSeekFolds) != 0; });
  }

  FittedMesh& mesh_;
  const Skin& skin_;
  std::vector<std::uint8_t> touched_;  // by vertex: the stars of what is touched are not those of the mesh any more
};

}  // namespace

bool mend_folds(FittedMesh& mesh, const Skin& skin, const Progress& progress) {
  return FoldMending(mesh, skin).run(progress);
}

}  // namespace relief::detail
