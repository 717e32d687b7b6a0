// All builds of the kernels must give the same bits: a model may not depend on the machine that sculpted it.
#include "edit_support.h"

#include <relief/edit/kernels.h>

#include <bit>
#include <cstdint>
#include <random>
#include <vector>

namespace relief {
namespace {

/// What a build of the kernels makes of one tile, all of it.
std::vector<float> everything(const detail::Kernels& kernels, const detail::SlabFrame& frame, int n, const Tile& from,
                              const Tile& protect) {
  const std::size_t count = sample_count(n);
  std::vector<float> all;
  // Room for what the kernels read and write beyond the tile.
  Tile one(kMaxIntervals, 3, 0), weight(n, 1, 0), to(kMaxIntervals, 1, 0);
  std::vector<std::uint8_t> over(count);
  const auto keep = [&](const Tile& tile, int planes = 1) {
    for (int c = 0; c < planes; ++c) all.insert(all.end(), tile.plane(c), tile.plane(c) + count);
  };
  const float *start = from.plane(0), *now = from.plane(1);
  for (const Vec3f along : {Vec3f{}, Vec3f{0.3F, -0.1F, 0.2F}}) {
    const detail::Cutter cutter{normalized(frame.direction[0]), along, false};
    kernels.cut(frame, cutter, {start, from.plane(0), from.plane(1), from.plane(2)}, protect.plane(), now, to.plane(),
                count);
    keep(to);
    const detail::Lift lift = kernels.lift(frame, cutter, start, protect.plane(), over.data(), count);
    all.insert(all.end(), over.begin(), over.end());
    all.push_back(lift.lift);
    all.push_back(static_cast<float>(lift.limited));
  }
  for (const Falloff falloff : {Falloff::Linear, Falloff::Smooth, Falloff::Dome}) {
    kernels.weigh(frame, falloff, now, protect.plane(), weight.plane(), count);
    keep(weight);
  }
  kernels.raise(frame, 0.2F, weight.plane(), to.plane(), count);
  keep(to);
  all.push_back(kernels.room(frame, weight.plane(), to.plane(), start, now, count));
  all.push_back(static_cast<float>(kernels.settle(now, to.plane(), 0.7F, one.plane(), over.data(), count)));
  keep(one);
  const detail::TargetPlane plane{{0.1F, 0, 0.1F}, normalized(frame.direction[1]), true, true};
  kernels.flatten(frame, plane, 0.4F, now, weight.plane(), to.plane(), count);
  keep(to);
  kernels.approach(0.3F, weight.plane(), to.plane(), count);
  kernels.scale(0.3F, weight.plane(), to.plane(), count);
  keep(to);
  kernels.cover(0.3F, weight.plane(), start, to.plane(), count);
  keep(to);
  kernels.mix(to.plane(), 0.7F, start, one.plane(), count);
  keep(one);
  kernels.raise(frame, 0.3F, start, to.plane(), count);
  keep(to);
  kernels.positions(frame, now, one.plane(0), one.plane(1), one.plane(2), count);
  keep(one, 3);
  Tile normals(kMaxIntervals, 3, 0);
  kernels.normals(n, {one.plane(0), one.plane(1), one.plane(2)}, normals.plane(0), normals.plane(1), normals.plane(2));
  keep(normals, 3);
  for (const bool swell : {false, true}) {
    kernels.around(frame, n, swell, {one.plane(0), one.plane(1), one.plane(2)}, to.plane());
    keep(to);
  }
  const detail::BorderTables table(n);
  const auto border = static_cast<std::size_t>(3 * n);
  std::vector<float> sums(6 * border), ways(border, 6), at_border(border);
  for (const bool swell : {false, true}) {
    kernels.border(table, {one.plane(0), one.plane(1), one.plane(2)}, sums.data());
    all.insert(all.end(), sums.begin(), sums.end());
    kernels.border_change(frame, table, swell, sums.data(), ways.data(), at_border.data());
    all.insert(all.end(), at_border.begin(), at_border.end());
  }
  for (const double sum : kernels.mean(weight.plane(), one.plane(0), one.plane(1), one.plane(2), count))
    all.push_back(static_cast<float>(sum));
  Tile coarse(17, 1, 0);
  kernels.resample(detail::Resampling(n, 17), now, coarse.plane(), sample_count(17));
  all.insert(all.end(), coarse.plane(), coarse.plane() + coarse.size());
  all.push_back(static_cast<float>(kernels.count_changes(start, now, from.stride(), 1, count)));
  all.push_back(kernels.largest(now, count));
  return all;
}

TEST(Kernels, EveryBuildGivesTheSameBits) {
  const detail::Kernels &a = detail::baseline_kernels(), &b = detail::best_kernels();
  if (&a == &b) GTEST_SKIP() << "skipped: this machine runs the baseline only";
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int n : {1, 2, 3, 15, 31, 32, 33}) {
    const auto mesh = testing::torus_shell(8, 6, n);
    const detail::GridTables grid(n);
    Tile from(n, 3, 0), protect(n, 1, 0), space(n, 1, 0);
    for (SlabId s = 0; s < mesh->slab_count(); s += 5) {
      for (std::size_t k = 0; k < from.size(); ++k) {
        for (int c = 0; c < 3; ++c) from.plane(c)[k] = unit(random);
        protect.plane()[k] = std::max(0.0F, unit(random) - 0.3F);
        space.plane()[k] = 0.02F + 0.1F * unit(random);
      }
      const SlabCorners corners = mesh->corners(s);
      detail::SlabFrame frame(corners, corners.point({0.3, 0.3, 0.4}, 0.4), 0.3, grid.weights);
      frame.space = space.plane();
      const auto one = everything(a, frame, n, from, protect), two = everything(b, frame, n, from, protect);
      ASSERT_EQ(one.size(), two.size());
      for (std::size_t k = 0; k < one.size(); ++k)
        ASSERT_EQ(std::bit_cast<std::uint32_t>(one[k]), std::bit_cast<std::uint32_t>(two[k]))
            << "n " << n << " at " << k;
    }
  }
}

TEST(Kernels, CountsASampleOnceWhicheverPlanesDiffer) {
  Tile a(15, 3, 0.5F), b(15, 3, 0.5F);
  b.plane(0)[3] = b.plane(2)[3] = 0;
  b.plane(1)[9] = b.plane(2)[135] = 1;
  for (const detail::Kernels* kernels : {&detail::baseline_kernels(), &detail::best_kernels()}) {
    EXPECT_EQ(kernels->count_changes(a.plane(), b.plane(), a.stride(), 3, a.size()), 3U);
    EXPECT_EQ(kernels->count_changes(a.plane(), b.plane(), a.stride(), 1, a.size()), 1U);
  }
}

TEST(Kernels, ASharedSampleGetsTheSameBitsInBothSlabs) {
  // Before any commit: the operations themselves leave no seam.
  const auto mesh = testing::torus_shell(10, 6, 32);
  const detail::GridTables grid(32);
  const detail::Kernels& kernels = detail::best_kernels();
  const Vec3d origin = {2.75, 0.1, 0.1};
  const Tile from(32, 1, 0.5F), zeros(32, 1, 0), space(32, 1, 0.02F);
  std::vector<std::unique_ptr<Tile>> results;
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    results.push_back(std::make_unique<Tile>(32, 1, 0.0F));
    detail::SlabFrame frame(mesh->corners(s), origin, 0.8, grid.weights);
    frame.space = space.plane();
    const detail::Cutter cutter{{1, 0, 0}, {0, 0.2F, 0}, true};
    const detail::Start start{from.plane(), zeros.plane(), zeros.plane(), zeros.plane()};
    kernels.cut(frame, cutter, start, zeros.plane(), from.plane(), results.back()->plane(), from.size());
  }
  testing::for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
    mesh->for_each_copy(s, at, [&](SampleCopy copy) {
      EXPECT_EQ(results[s]->plane()[k], results[copy.slab]->plane()[sample_index(32, copy.at)]);
    });
  });
}

}  // namespace
}  // namespace relief
