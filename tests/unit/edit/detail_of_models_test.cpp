// Models as they are converted, cut in four at 20 places until 200 slabs are 1,400, with n of all kinds.
#include "support/cuts.h"
#include "support/data.h"

#include <relief/convert/convert.h>
#include <relief/convert/proof.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

namespace relief {
namespace {

constexpr SlabId kSlabs = 200, kPieces = 1400;

class DetailOfModels : public ::testing::TestWithParam<const char*> {
 protected:
  /// A sample of the project by its name, else a file of the test data.
  void SetUp() override {
    const std::string name = GetParam();
    if (name.find('/') == std::string::npos) {
      mesh_ = *make_sample(name, 20'000);
    } else {
      RELIEF_DATA_FILE(file, name);
      mesh_ = *import_mesh(file);
    }
  }
  [[nodiscard]] SnapshotPtr converted(int n) const {
    const auto made = convert(mesh_, {.slabs = kSlabs, .intervals = n});
    EXPECT_TRUE(made) << made.error().message;
    return made ? made->model.head : nullptr;
  }
  TriangleMesh mesh_;
};

/// Cuts in turn what lies at the places, until there are so many slabs.
SnapshotPtr cut_at_places(const SnapshotPtr& model, int places, SlabId slabs) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<SlabCoord> all;
  for (int k = 0; k < places; ++k) {
    const double u = unit(random);
    all.push_back({static_cast<SlabId>(random() % model->slab_mesh().slab_count()), u, unit(random) * (1 - u), 0});
  }
  testing::RandomCuts cuts(model);
  for (std::size_t k = 0; cuts.model()->slab_mesh().slab_count() < slabs; ++k)
    cuts.cut(heir(model->slab_mesh(), cuts.model()->slab_mesh(), all[k % all.size()]).value().slab);
  return cuts.model();
}

TEST_P(DetailOfModels, KeepTheirSurfaceTheirSamplesAndTheirProof) {
  for (const int n : {15, 31, 32, 63, 128}) {
    const SnapshotPtr model = converted(n);
    ASSERT_TRUE(model);
    const std::uint64_t hash = model->content_hash();
    const SnapshotPtr cut = cut_at_places(model, 20, kPieces);
    const SlabMesh &was = model->slab_mesh(), &is = cut->slab_mesh();

    const Status sound = validate(*cut);
    EXPECT_TRUE(sound) << sound.error().message;
    const PlainCage roots(is);
    const verify::Certificate certificate = verify::check(view(roots));
    EXPECT_TRUE(certificate.all()) << certificate.failures.front().what;
    EXPECT_EQ(faults_of_tiles(*cut, certificate).first, "");

    EXPECT_EQ(testing::samples_lost(*model, *cut), 0U) << "to the bit";
    const double moved = testing::moved_between(*model, *cut, 27'000);
    EXPECT_LE(moved, 2e-7) << "of alpha";
    const double angle = testing::least_angle_of_roots(is, was);
    EXPECT_GE(angle, 0.5);
    EXPECT_EQ(model->content_hash(), hash) << "which undo brings back";

    int deepest = 0;
    for (SlabId s = 0; s < is.slab_count(); ++s) deepest = std::max(deepest, is.level(s));
    std::printf("%s, n %d: %u slabs became %u, %d levels; moved by %.1e of alpha; least angle %.2f of its root's\n",
                GetParam(), n, was.slab_count(), is.slab_count(), deepest, moved, angle);
  }
}

INSTANTIATE_TEST_SUITE_P(Models, DetailOfModels,
                         ::testing::Values("head", "pumpkin", "torus", "bowl", "b_bad/variant/sphere.stl",
                                           "a_models/bunny.ply"),
                         [](const auto& test) { return std::filesystem::path(test.param).stem().string(); });

}  // namespace
}  // namespace relief
