#include <relief/convert/directions.h>
#include <relief/convert/parallel.h>
#include <relief/convert/thin_shell.h>

#include <algorithm>
#include <atomic>
#include <numeric>

namespace relief::detail {
namespace {

class ThinBuilder {
 public:
  ThinBuilder(const OrderedSource& source, double longest, const Progress& progress)
      : source_(source),
        stars_(source.faces, source.points.size()),
        directions_(source.points.size()),
        heights_(source.points.size()),
        ends_(source.points.size()),
        blamed_(source.points.size(), 0),
        works_(source.faces.size(), 1),
        faulty_(source.faces.size(), 0) {
    for_all(ends_.size(), 1024, progress, [&](std::size_t v) { start(static_cast<std::uint32_t>(v), 0.49 * longest); });
    tree_.emplace(source.faces.size(), [&](std::size_t f) {
      Box3d box;
      for (const std::uint32_t v : source_.faces[f])
        for (const LatticePoint p : ends_[v]) box.add(to_double(p));
      return box;
    });
  }

  ThinShell run(const Progress& progress) {
    constexpr int kRounds = 60;
    constexpr std::size_t kChunk = 8192;
    const std::size_t most_pairs = 30'000'000 + 2000 * source_.faces.size();
    std::vector<std::uint32_t> work(source_.faces.size());
    std::iota(work.begin(), work.end(), 0U);
    bool sound = false;
    for (int round = 0; round < kRounds && !sound; ++round) {
      for (const std::uint32_t f : work) faulty_[f] = 0;
      // A heap of triangles that all meet each other is given up early, always at the same place.
      for (std::size_t begin = 0; begin < work.size() && pairs_ < most_pairs; begin += kChunk)
        if (!for_all(std::min(kChunk, work.size() - begin), 512, progress,
                     [&](std::size_t k) { test(work[begin + k]); }))
          return {};
      for (const std::uint32_t f : work) works_[f] = 0;
      const bool shrunk = shrink(work);
      sound = work.empty();
      if (pairs_ >= most_pairs) sound = false;
      if (!sound && (!shrunk || pairs_ >= most_pairs)) break;
    }
    ThinShell shell;
    for (std::uint32_t f = 0; f < faulty_.size() && !sound; ++f)
      if (faulty_[f] != 0) shell.faults.push_back(f);
    shell.ends = std::move(ends_);
    shell.tree = std::move(tree_);
    return shell;
  }

 private:
  void start(std::uint32_t v, double most) {
    thread_local std::vector<Vec3d> normals;
    normals.clear();
    const Vec3d at = to_double(source_.points[v]);
    double shortest = Box3d::kFar;
    for (const std::uint32_t h : stars_.of(v)) {
      normals.push_back(source_.normal(h / 3));
      shortest = std::min(shortest, length(to_double(source_.points[source_.faces[h / 3][(h + 1) % 3]]) - at));
    }
    directions_[v] = to_float(best_direction(normals).d);
    heights_[v].fill(static_cast<float>(std::clamp(0.3 * shortest, kLeastHeight, most)));
    place(v);
  }
  void place(std::uint32_t v) {
    const Vec3d at = to_double(source_.points[v]), d = to_double(directions_[v]);
    ends_[v] = {snap(at - d * double(heights_[v][kInner])), snap(at + d * double(heights_[v][kOuter]))};
  }
  [[nodiscard]] LatticeTriangle triangle(std::uint32_t f, Side side) const noexcept {
    const Face& face = source_.faces[f];
    return {ends_[face[0]][side], ends_[face[1]][side], ends_[face[2]][side]};
  }
  void test(std::uint32_t f) {
    const SlabShape mine(triangle(f, kInner), triangle(f, kOuter));
    const auto found = [&](std::uint32_t face, Side side) {
      for (const std::uint32_t v : source_.faces[face])
        std::atomic_ref(blamed_[v]).fetch_or(static_cast<std::uint8_t>(1U << side), std::memory_order_relaxed);
      std::atomic_ref(faulty_[face]).store(1, std::memory_order_relaxed);
    };
    const JacobianFault jacobian = jacobian_fault(mine.triangle(kInner), mine.triangle(kOuter));
    if (jacobian != JacobianFault::None) {
      if (jacobian != JacobianFault::Outer) found(f, kInner);
      if (jacobian != JacobianFault::Inner) found(f, kOuter);
    }
    std::size_t pairs = 0;
    tree_->query(mine.box(), [&](std::uint32_t g) {
      ++pairs;
      const Meeting meeting = mine.meet(source_.triangle(g));
      if (meeting == Meeting::Outer || (meeting == Meeting::Folded && g == f)) found(f, kOuter);
      if (meeting == Meeting::Inner || (meeting == Meeting::Folded && g == f)) found(f, kInner);
      if (works_[g] != 0 && g < f) return true;  // the pair is tested from the other slab
      bool adjacent = false;
      for (const std::uint32_t v : source_.faces[f])
        for (const std::uint32_t w : source_.faces[g]) adjacent = adjacent || v == w;
      std::array<Box3d, 2> boxes;
      for (const Side side : {kInner, kOuter})
        for (const std::uint32_t v : source_.faces[g]) boxes[side].add(to_double(ends_[v][side]));
      for (const Side mine_side : {kInner, kOuter})
        for (const Side side : {kInner, kOuter}) {
          if ((side == mine_side && adjacent) || !boxes[side].meets(mine.box(mine_side))) continue;
          if (!triangles_meet(mine.triangle(mine_side), triangle(g, side))) continue;
          found(f, mine_side);
          found(g, side);
        }
      return true;
    });
    pairs_ += pairs;
  }

  /// Halves what is to blame, and leaves in `work` the faces that this changes; false when all of it is at the least.
  bool shrink(std::vector<std::uint32_t>& work) {
    work.clear();
    bool shrunk = false;
    for (std::uint32_t v = 0; v < blamed_.size(); ++v) {
      if (blamed_[v] == 0) continue;
      for (const Side side : {kInner, kOuter}) {
        float& height = heights_[v][side];
        if ((blamed_[v] >> side & 1U) == 0 || height <= float(kLeastHeight)) continue;
        height = std::max(float(kLeastHeight), height * 0.5F);
        shrunk = true;
      }
      blamed_[v] = 0;
      place(v);
      for (const std::uint32_t h : stars_.of(v)) {
        if (works_[h / 3] != 0) continue;
        works_[h / 3] = 1;
        work.push_back(h / 3);
      }
    }
    std::sort(work.begin(), work.end());
    return shrunk;
  }

  const OrderedSource& source_;
  Stars stars_;
  std::vector<Vec3f> directions_;
  std::vector<std::array<float, 2>> heights_;  // by Side
  std::vector<Ends> ends_;
  std::vector<std::uint8_t> blamed_;  // per point, a bit per Side
  std::vector<std::uint8_t> works_, faulty_;
  std::atomic<std::size_t> pairs_ = 0;
  std::optional<BoxTree> tree_;  // of the slabs as they were at first: they only shrink
};

}  // namespace

ThinShell make_thin_shell(const OrderedSource& source, double longest, const Progress& progress) {
  return ThinBuilder(source, longest, progress).run(progress);
}

}  // namespace relief::detail
