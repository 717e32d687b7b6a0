// All builds of the kernels must give the same bits: a model may not depend on the machine that sculpted it.
#include "edit_support.h"

#include <relief/edit/kernels.h>

#include <bit>
#include <random>

namespace relief {
namespace {

TEST(Kernels, EveryBuildGivesTheSameBits) {
  const detail::Kernels &a = detail::baseline_kernels(), &b = detail::best_kernels();
  if (&a == &b) GTEST_SKIP() << "skipped: this machine runs the baseline only";
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const int n : {1, 2, 3, 15, 31, 32, 33}) {
    const auto mesh = testing::torus_shell(8, 6, n);
    const detail::GridTables grid(n);
    const detail::Resampling resampling(n, 17);
    const std::size_t count = sample_count(n);
    Tile from(n, 3, 0), mask(n, 1, 0), one(n, 3, 0), two(n, 3, 0);
    const auto expect_same = [&](const char* what) {
      for (std::size_t k = 0; k < count; ++k)
        ASSERT_EQ(std::bit_cast<std::uint32_t>(one.plane()[k]), std::bit_cast<std::uint32_t>(two.plane()[k]))
            << what << " n " << n << " sample " << k;
    };
    for (SlabId s = 0; s < mesh->slab_count(); s += 5) {
      for (std::size_t k = 0; k < count; ++k) {
        for (int c = 0; c < 3; ++c) from.plane(c)[k] = unit(random);
        mask.plane()[k] = std::max(0.0F, unit(random) - 0.3F);
      }
      const SlabCorners corners = mesh->corners(s);
      const Vec3d origin = corners.point({0.3, 0.3, 0.4}, 0.4);
      const detail::SlabFrame frame(corners, origin, 0.3, grid);
      const Vec3f up = normalized(to_float(corners.outer[0] - corners.inner[0]));
      a.carve(frame, up, from.plane(), one.plane(), count);
      b.carve(frame, up, from.plane(), two.plane(), count);
      expect_same("carve");
      EXPECT_EQ(a.count_changes(from.plane(), one.plane(), from.stride(), 1, count),
                b.count_changes(from.plane(), one.plane(), from.stride(), 1, count));
      a.protect(mask.plane(), from.plane(), one.plane(), count);
      b.protect(mask.plane(), from.plane(), two.plane(), count);
      expect_same("protect");
      a.deposit(frame, 0.1F, from.plane(), one.plane(), count);
      b.deposit(frame, 0.1F, from.plane(), two.plane(), count);
      expect_same("deposit");
      a.cone(frame, 0.9F, from.plane(), one.plane(), count);
      b.cone(frame, 0.9F, from.plane(), two.plane(), count);
      expect_same("cone");
      a.fade(mask.plane(), one.plane(), count);
      b.fade(mask.plane(), two.plane(), count);
      expect_same("fade");
      a.blend(mask.plane(), 0.7F, from.plane(), one.plane(), count);
      b.blend(mask.plane(), 0.7F, from.plane(), two.plane(), count);
      expect_same("blend");
      Tile coarse(17, 1, 0), coarse_too(17, 1, 0);
      a.resample(resampling, from.plane(), coarse.plane(), sample_count(17));
      b.resample(resampling, from.plane(), coarse_too.plane(), sample_count(17));
      EXPECT_TRUE(coarse.same_values(coarse_too));
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
  const Tile from(32, 1, 0.5F);
  std::vector<std::unique_ptr<Tile>> results;
  for (SlabId s = 0; s < mesh->slab_count(); ++s) {
    results.push_back(std::make_unique<Tile>(32, 1, 0.0F));
    const detail::SlabFrame frame(mesh->corners(s), origin, 0.8, grid);
    kernels.carve(frame, {1, 0, 0}, from.plane(), results.back()->plane(), from.size());
  }
  testing::for_each_sample(*mesh, [&](SlabId s, std::size_t k, GridPoint at) {
    mesh->for_each_copy(s, 32, at, [&](SampleCopy copy) {
      EXPECT_EQ(results[s]->plane()[k], results[copy.slab]->plane()[sample_index(32, copy.at)]);
    });
  });
}

}  // namespace
}  // namespace relief
