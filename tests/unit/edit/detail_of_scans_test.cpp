// Small balls cut into scans as they are converted.
#include "edit_support.h"
#include "support/data.h"

#include <relief/convert/convert.h>
#include <relief/core/detail.h>
#include <relief/mesh/import.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <vector>

namespace relief {
namespace {

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// How far a cut lies from that of the true ball, between samples as at them: the rms over what the ball cuts, normal
/// to the surface.
double cut_error(const Snapshot& before, const Snapshot& after, const Dab& dab, double radius) {
  const Vec3d centre = dab.cursor + dab.normal * radius;
  const SlabMesh& mesh = after.slab_mesh();
  constexpr int kPlaces = 45;  // along an edge; not a power of two, so that few are samples
  double sum = 0, area = 0;
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    if (mesh.box(s).distance2(dab.contact) > 4 * radius * radius) continue;
    const SlabCorners corners = mesh.corners(s);
    const double share = length(cross(corners.point({0, 1, 0}, 0.5) - corners.point({1, 0, 0}, 0.5),
                                      corners.point({0, 0, 1}, 0.5) - corners.point({1, 0, 0}, 0.5)));
    for (int i = 0; i < kPlaces; ++i)
      for (int j = 0; i + j < kPlaces; ++j) {
        const double u = (i + 1.0 / 3) / kPlaces, v = (j + 1.0 / 3) / kPlaces;
        const auto there = heir(mesh, before.slab_mesh(), {s, u, v, 0});
        const double old_alpha = displacement_at(before, there->slab, there->u, there->v);
        const Vec3d inner = corners.point({1 - u - v, u, v}, 0);
        const Vec3d along = corners.point({1 - u - v, u, v}, 1) - inner;
        if (length(inner + along * old_alpha - dab.contact) > 2 * radius || dot(along, dab.normal) <= 0) continue;
        const Vec3d o = inner - centre;
        const double a = dot(along, along), b = dot(o, along), c = dot(o, o) - radius * radius;
        const double square = b * b - a * c;
        const double entry = square > 0 ? (-b - std::sqrt(square)) / a : 2;
        const double is = displacement_at(after, s, u, v);
        if (!(entry < old_alpha) && is == old_alpha) continue;
        const double off = (is - std::min(entry, old_alpha)) * dot(along, dab.normal);
        sum += share * off * off;
        area += share;
      }
  }
  return area > 0 ? std::sqrt(sum / area) : 0;
}

std::size_t samples_of(const Snapshot& model) {
  std::size_t sum = 0;
  for (const Slab& slab : model.slab_mesh().slabs()) sum += sample_count(slab.intervals);
  return sum;
}

/// A scan, and at how many of the 100 places at most a stroke that gets no room may say that it did not do all.
struct Scan {
  const char* file;
  std::size_t limited, beside;  ///< the clay ends; fibres lean
};

class DetailOfScans : public ::testing::TestWithParam<Scan> {
 protected:
  void open(const std::filesystem::path& file) {
    auto mesh = import_mesh(file);
    ASSERT_TRUE(mesh) << mesh.error().message;
    auto made = convert(*std::move(mesh), {});
    ASSERT_TRUE(made) << made.error().message;
    model_ = made->model.head;
    diagonal_ = length(bounds(made->mended).extent());
  }
  /// A place on the surface that a ball can cut.
  Dab random_dab(const Snapshot& model, double depth) {
    const SlabMesh& mesh = model.slab_mesh();
    std::uniform_real_distribution<double> unit(0, 1);
    const auto s = static_cast<SlabId>(random_() % mesh.slab_count());
    double u = unit(random_), v = unit(random_);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const SurfacePoint at = surface_point(model, s, u, v);
    return {.slab = s, .contact = at.position, .cursor = at.position - at.normal * depth, .normal = at.normal};
  }
  SnapshotPtr model_;
  double diagonal_ = 0;
  std::mt19937 random_{1};
};

TEST_P(DetailOfScans, ASmallBallIsCutAsItIsAnywhere) {
  RELIEF_DATA_FILE(file, GetParam().file);
  open(file);
  const double radius = 0.005 * diagonal_, depth = 0.6 * radius;
  std::vector<double> errors;
  std::vector<std::size_t> slabs, samples;
  std::size_t limited = 0, beside = 0;
  double before = 0;
  for (int place = 0; place < 100; ++place) {
    Editor editor(model_);
    const Dab dab = random_dab(*model_, depth);
    const double began = cpu_seconds();
    const DabResult told = testing::apply(editor, {.radius = radius}, dab);
    before += cpu_seconds() - began;
    if (told.limited > 0 || told.beside) {
      ++(told.limited > 0 ? limited : beside);
      continue;
    }
    errors.push_back(cut_error(*model_, *editor.head(), dab, radius) / depth);
    slabs.push_back(told.slabs_added);
    samples.push_back(told.samples_added);
    if (place % 10 == 0) {
      EXPECT_TRUE(testing::valid(*editor.head()));
    }
  }
  std::ranges::sort(errors);
  std::ranges::sort(slabs);
  std::ranges::sort(samples);
  std::printf(
      "%s: %u slabs, %zu samples; %zu at the end of the clay, %zu where fibres lean; %zu others: rms of the depth "
      "median %.3f, 90 %% "
      "%.3f, most %.3f; slabs added median %zu, most %zu; samples added median %zu, most %zu; %.2f ms a stroke\n",
      GetParam().file, model_->slab_mesh().slab_count(), samples_of(*model_), limited, beside, errors.size(),
      errors[errors.size() / 2], errors[errors.size() * 9 / 10], errors.back(), slabs[slabs.size() / 2], slabs.back(),
      samples[samples.size() / 2], samples.back(), 10 * before);
  EXPECT_LE(errors.back(), 0.04);
  EXPECT_LE(limited, GetParam().limited);
  EXPECT_LE(beside, GetParam().beside);
}

TEST_P(DetailOfScans, TwentyPlacesCostLittle) {
  RELIEF_DATA_FILE(file, GetParam().file);
  open(file);
  const double radius = 0.005 * diagonal_;
  Editor editor(model_);
  for (int place = 0; place < 20; ++place)
    testing::apply(editor, {.radius = radius, .detail = 0.1}, random_dab(*editor.head(), 0.6 * radius));
  const double slabs = static_cast<double>(editor.head()->slab_mesh().slab_count() - model_->slab_mesh().slab_count());
  const double share = static_cast<double>(samples_of(*editor.head())) / static_cast<double>(samples_of(*model_));
  std::printf("%s: %.1f slabs added per place, samples %.3f times\n", GetParam().file, slabs / 20, share);
  EXPECT_TRUE(testing::valid(*editor.head()));
  EXPECT_LE(slabs / 20, 90);
  EXPECT_LE((share - 1) * static_cast<double>(samples_of(*model_)) / 20, 20000);
}

// The head is a scan of many thin and folded parts: three in four of its fibres have little clay, which is told.
INSTANTIATE_TEST_SUITE_P(Scans, DetailOfScans,
                         ::testing::Values(Scan{"a_models/pumpkin.ply", 0, 4}, Scan{"a_models/head_lps.ply", 40, 22},
                                           Scan{"a_models/bunny.ply", 4, 27}, Scan{"b_bad/variant/sphere.stl", 0, 0}),
                         [](const auto& test) { return std::filesystem::path(test.param.file).stem().string(); });

}  // namespace
}  // namespace relief
