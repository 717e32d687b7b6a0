// Frames for a window: what is redrawn, at which level, from which camera, and what may be asked of them afterwards.
#include "render_support.h"
#include "support/cuts.h"

#include <relief/core/tessellate.h>
#include <relief/render/coverage.h>
#include <relief/render/gl_context.h>
#include <relief/render/slab_view.h>

#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>

namespace relief::testing {
namespace {

Words blank(const Frame& frame) {
  return Words(static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height), 0x12345678U);
}

/// The whole picture of another renderer.
Words whole(FrameRenderer& with, const Snapshot& model, const Frame& frame) {
  Words words = blank(frame);
  const auto rect = with.draw(model, frame, words, frame.width, nullptr, true);
  EXPECT_TRUE(rect) << rect.error().message;
  return words;
}

double words_psnr(const Words& a, const Words& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    for (const unsigned shift : {0U, 8U, 16U}) {
      const double d = double((a[k] >> shift) & 255U) - double((b[k] >> shift) & 255U);
      sum += d * d;
    }
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * 3 * static_cast<double>(a.size()) / sum);
}

double rough(Vec3d d) { return 0.08 * std::sin(13 * d.x + 3) * std::cos(11 * d.y); }

/// One dab at a random place: carved, painted, masked or cut through.
class Dabs {
 public:
  Dabs(SnapshotPtr model, unsigned seed) : draft_(model), mesh_(model->shared_slab_mesh()), random_(seed) {}

  SnapshotPtr next(Layer layer) {
    std::normal_distribution<double> any;
    const Vec3d middle = normalized(Vec3d{any(random_), any(random_), any(random_)});
    const double radius = std::uniform_real_distribution(0.05, 0.25)(random_);
    const float amount = std::uniform_real_distribution(-0.2F, 0.2F)(random_);
    const Snapshot base = draft_.now();
    for (SlabId s = 0; s < mesh_->slab_count(); ++s) {
      const int n = base.tile(layer, s).intervals();
      for (int j = 0; j <= n; ++j)
        for (int i = 0; i + j <= n; ++i) {
          if (length(normalized(sample_position(*mesh_, s, n, {i, j}, 0.5)) - middle) > radius) continue;
          const std::size_t k = sample_index(n, {i, j});
          for (int c = 0; c < channels(layer); ++c) {
            const float before = base.tile(layer, s).value(c, k);
            const float after = layer == Layer::Void ? 1.0F : std::clamp(before + amount, 0.1F, 0.9F);
            if (before != after) draft_.edit(layer, s).set(c, k, after);
          }
        }
    }
    return draft_.finish();
  }

 private:
  SnapshotDraft draft_;
  std::shared_ptr<const SlabMesh> mesh_;
  std::mt19937 random_;
};

TEST(DirtyRectangle, GivesTheBitsOfAFullRedraw) {
  const auto start = [] {
    SnapshotDraft draft(
        coloured(ball(3, 16, rough), 8, [](Vec3d p) { return Vec3f{p.x > 0 ? 0.8F : 0.4F, 0.5F, 0.4F}; }));
    draft.add_layer(Layer::Mask, 8, 0);
    draft.add_layer(Layer::Void, kOwnIntervals, 0);
    return draft.finish();
  }();
  FrameRenderer kept = make_renderer(), fresh = make_renderer();
  Frame frame = small_frame(front(16.0 / 9, 25, 15));
  Words words = blank(frame);
  int whole_frames = 0, drawn = 0, too_small = 0;
  unsigned seed = 1;
  for (const int samples : {1, 4})
    for (const Look::Map map : {Look::Map::None, Look::Map::Depth})
      for (const double tau : {0.0, 3.0}) {
        frame.samples = samples;
        frame.look.map = map;
        frame.tau = tau;
        Dabs dabs(start, seed++);
        ASSERT_TRUE(kept.draw(*start, frame, words, kWidth));
        EXPECT_TRUE(kept.stats().everything);
        for (int k = 0; k < 10; ++k) {
          const Layer layer = k % 5 == 3   ? Layer::Colour
                              : k % 5 == 4 ? Layer::Mask
                              : k == 7     ? Layer::Void
                                           : Layer::Displacement;
          const auto model = dabs.next(layer);
          const Words before = words;
          const auto rect = kept.draw(*model, frame, words, kWidth);
          ASSERT_TRUE(rect) << rect.error().message;
          const Words expected = whole(fresh, *model, frame);
          ASSERT_EQ(words, expected) << "dab " << k << " samples " << samples << " tau " << tau;
          EXPECT_EQ(pasted(before, words, *rect), words) << "written beyond the rectangle";
          whole_frames += kept.stats().everything ? 1 : 0;
          drawn += rect->empty() ? 0 : 1;
          if (!rect->empty() && pasted(before, words, shrunk(*rect, 8)) != expected) ++too_small;
        }
      }
  EXPECT_GT(drawn, 40);
  EXPECT_LT(whole_frames, 25);
  // Bounds that are 8 pixels too small are found out.
  EXPECT_GT(too_small, 15);
}

TEST(DirtyRectangle, IsEmptyWhenNothingDiffers) {
  const auto model = ball(2, 16);
  const Frame frame = small_frame(front());
  Words words = blank(frame);
  FrameRenderer kept = make_renderer();
  ASSERT_TRUE(kept.draw(*model, frame, words, kWidth));
  Words untouched = blank(frame);
  const auto again = kept.draw(*model, frame, untouched, kWidth);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->empty());
  EXPECT_EQ(untouched, blank(frame));
  EXPECT_EQ(kept.stats().triangles, 0U);
  // Another camera, size, look, tau: all is drawn.
  std::vector<Frame> others(5, frame);
  others[0].camera.eye.x += 0.1;
  others[1].look.cavity = false;
  others[2].tau = 2;
  others[3].samples = 4;
  others[4].look.bottom.x = 0.5F;
  for (const Frame& other : others) {
    EXPECT_EQ(*kept.draw(*model, other, words, kWidth), (PixelRect{0, 0, kWidth, kHeight}));
    EXPECT_TRUE(kept.stats().everything);
  }
}

TEST(DirtyRectangle, OnlyChangedRowsAreUploadedAndFewSlabsDrawn) {
  const auto before = ball(4, 16);
  const Frame frame = small_frame(front());
  Words words = blank(frame);
  FrameRenderer kept = make_renderer();
  ASSERT_TRUE(kept.draw(*before, frame, words, kWidth));
  const std::uint64_t all = kept.stats().triangles;
  EXPECT_GT(kept.stats().slabs_culled, 500U) << "of 2048, half face away";
  Dabs dabs(before, 5);
  PixelRect rect;
  for (int k = 0; k < 30 && rect.empty(); ++k) rect = *kept.draw(*dabs.next(Layer::Displacement), frame, words, kWidth);
  EXPECT_FALSE(rect.empty());
  EXPECT_LT(kept.stats().triangles * 2, all);
  EXPECT_LT(kept.stats().tiles_uploaded, 400U);
}

/// Levels at random, and the same without stitching: every slab as if its neighbours had its own level.
class RandomLevels : public ::testing::Test {
 protected:
  RandomLevels() : context_(GlContext()), scope_(*context_) {}
  static std::unique_ptr<detail::GlContext> GlContext() {
    auto made = detail::GlContext::create();
    if (!made) std::abort();
    return *std::move(made);
  }
  detail::SignedCoverage cover(const Snapshot& model, bool stitched, unsigned seed) {
    detail::DisplayCache cache;
    EXPECT_TRUE(cache.update(model));
    std::mt19937 random(seed);
    std::vector<std::uint8_t> levels;
    for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s)
      levels.push_back(static_cast<std::uint8_t>(random() % 7));
    detail::DrawnLevels made = cache.detail(levels);
    if (!stitched)
      for (SlabId s = 0; s < levels.size(); ++s) made.pattern[s] = cache.detail(levels[s]).pattern[s];
    const Camera camera = framing(surface_bounds(model), 33, 21, 16.0 / 9);
    const auto sums = detail::signed_coverage(cache, made, camera, 640, 360);
    EXPECT_TRUE(sums);
    return sums.value_or(detail::SignedCoverage{});
  }

 private:
  std::unique_ptr<detail::GlContext> context_;
  detail::GlContext::Scope scope_;
};

TEST_F(RandomLevels, LeaveNoCrackAndWithoutStitchingTheyDo) {
  const auto waves = [](Vec3d p) { return 0.5 + 0.35 * std::sin(9 * p.x + 7 * p.y - 5 * p.z); };
  const std::vector<SnapshotPtr> models = {ball(3, 32, rough),
                                           ball(2, 24, rough),
                                           ball(2, 15, rough),
                                           displaced(mixed_shell(*sphere_shell(2, 1), 1, 6), waves),
                                           displaced(mixed_shell(*sphere_shell(2, 1), 3, 4), waves),
                                           displaced(torus_shell(24, 12, 16), waves)};
  unsigned seed = 0;
  for (const SnapshotPtr& model : models)
    for (int round = 0; round < 3; ++round) {
      const auto found = cover(*model, true, ++seed);
      EXPECT_EQ(found.cracks, 0U) << "seed " << seed;
      EXPECT_GT(found.covered, 10000U);
    }
  EXPECT_GT(cover(*models[0], false, 1).cracks, 100U);
  EXPECT_GT(cover(*models[3], false, 1).cracks, 100U);
}

TEST(LevelOfDetail, TwoPixelsLookLikeAllSamples) {
  const auto model =
      ball(3, 64, [](Vec3d d) { return 0.04 * std::sin(7 * d.x) * std::cos(6 * d.y) + 0.01 * std::sin(31 * d.z); });
  Frame frame = small_frame(front(16.0 / 9, 20, 10));
  frame.samples = 16;
  FrameRenderer with = make_renderer();
  frame.tau = 0;
  const Words full = whole(with, *model, frame);
  const std::uint64_t all = with.stats().triangles;
  frame.tau = 2;
  const Words coarse = whole(with, *model, frame);
  EXPECT_LT(with.stats().triangles * 4, all);
  EXPECT_GT(words_psnr(full, coarse), 42);
  const auto sums = with.coverage(*model, frame);
  ASSERT_TRUE(sums);
  EXPECT_EQ(sums->cracks, 0U);
  EXPECT_GT(sums->covered, 10000U);
}

TEST(LevelOfDetail, NearSlabsAreFinerThanFarOnesAndOddGridsStay) {
  const auto mesh = sphere_shell(3, 64, 0.8, 1.2);
  const Camera camera = front();
  const detail::Eye eye = detail::make_eye(camera, {}, 16.0 / 9, mesh->bounds());
  const auto levels = detail::choose_levels(*mesh, {}, eye, 1080, 3.2);
  const auto middle = [&](SlabId s) { return mesh->box(s).centre().z; };
  int near = 0, far = 0, near_count = 0, far_count = 0;
  for (SlabId s = 0; s < levels.size(); ++s) {
    (middle(s) > 0 ? near : far) += levels[s];
    ++(middle(s) > 0 ? near_count : far_count);
  }
  EXPECT_LT(double(near) / near_count, double(far) / far_count);
  EXPECT_EQ(detail::choose_levels(*sphere_shell(3, 15), {}, eye, 1080, 100), std::vector<std::uint8_t>(512, 0));
  EXPECT_EQ(detail::choose_levels(*mesh, {}, eye, 1080, 0), std::vector<std::uint8_t>(512, 0));
}

TEST(Culling, LeavesTheSamePicture) {
  // Close up, from inside the bounds, and from far away: slabs behind, beside and turned away are left out.
  const auto model = ball(3, 16, rough);
  const std::vector<Camera> cameras = [] {
    std::vector<Camera> all(3, front(16.0 / 9, 40, 10));
    all[0].eye = {0.4, 0.2, 1.5};
    all[0].target = {0.2, 0.4, 0};
    all[1].eye = {1.05, 0.1, 0.3};
    all[2].eye = all[2].eye * 4;
    return all;
  }();
  for (const Camera& camera : cameras) {
    const Frame frame = small_frame(camera);
    FrameRenderer with = make_renderer();
    const Words words = whole(with, *model, frame);
    EXPECT_GT(with.stats().slabs_culled, 100U);
    // The mesh is never culled.
    const Tessellation all = tessellate(*model);
    Words plain = blank(frame);
    ASSERT_TRUE(with.draw({all.positions, all.triangles}, frame, plain, kWidth));
    int differ = 0;
    for (std::size_t k = 0; k < words.size(); ++k) {
      int most = 0;
      for (const unsigned shift : {0U, 8U, 16U})
        most = std::max(most, std::abs(int((words[k] >> shift) & 255U) - int((plain[k] >> shift) & 255U)));
      differ += most > 40 ? 1 : 0;
    }
    EXPECT_LT(differ, 30);
  }
}

TEST(Mesh, LooksLikeTheSlabsThatReplaceIt) {
  const auto model = ball(3, 32, rough);
  Frame frame = small_frame(front(16.0 / 9, 20, 10));
  frame.samples = 4;
  FrameRenderer with = make_renderer();
  const Words slabs = whole(with, *model, frame);
  const Tessellation all = tessellate(*model);
  const MeshView mesh{all.positions, all.triangles};
  Words words = blank(frame);
  ASSERT_EQ(*with.draw(mesh, frame, words, kWidth), (PixelRect{0, 0, kWidth, kHeight}));
  EXPECT_GT(words_psnr(slabs, words), 40);
  EXPECT_TRUE(with.draw(mesh, frame, words, kWidth)->empty());
  ASSERT_TRUE(with.pick(160, 90));
  EXPECT_NEAR(length(*with.pick(160, 90)), 1, 0.1);
  // Back to the slabs without a trace of the mesh.
  words = blank(frame);
  EXPECT_FALSE(with.draw(*model, frame, words, kWidth)->empty());
  EXPECT_EQ(words, slabs);
  // Its colours, where it has some.
  const std::vector<Rgba8> red(all.positions.size(), Rgba8{220, 40, 40, 255});
  ASSERT_TRUE(with.draw({all.positions, all.triangles, red}, frame, words, kWidth));
  const std::uint32_t middle = words[90 * kWidth + 160];
  EXPECT_GT((middle >> 16U) & 255U, 2 * ((middle >> 8U) & 255U));
  // Nothing at all is a picture too.
  EXPECT_TRUE(with.draw(MeshView{}, frame, words, kWidth));
}

/// A cube with corners at +-1, two slabs a face: fibres along its diagonals, from 0.8 to 1.2 times a corner.
SnapshotPtr cube(int n) {
  std::vector<Fibre> fibres;
  for (unsigned k = 0; k < 8; ++k) {
    const Vec3d corner = {(k & 1U) != 0 ? 1.0 : -1.0, (k & 2U) != 0 ? 1.0 : -1.0, (k & 4U) != 0 ? 1.0 : -1.0};
    fibres.push_back({corner * 0.8, corner * 1.2});
  }
  std::vector<SlabMesh::Face> faces;
  for (const std::array<FibreId, 4> q :
       {std::array<FibreId, 4>{1, 3, 7, 5}, {0, 4, 6, 2}, {2, 6, 7, 3}, {0, 1, 5, 4}, {4, 5, 7, 6}, {0, 2, 3, 1}}) {
    faces.push_back({{q[0], q[1], q[2]}, n});
    faces.push_back({{q[0], q[2], q[3]}, n});
  }
  auto mesh = SlabMesh::make(std::move(fibres), faces);
  return displaced(std::make_shared<const SlabMesh>(*std::move(mesh)), [](Vec3d) { return 0.5; });
}

/// From afar, in light that depends on the normal only.
Frame from_afar() {
  Camera camera = front(16.0 / 9, 30, 25);
  camera.parallel = true;
  camera.view_height = 4;
  Frame frame = small_frame(camera);
  frame.tau = 0;
  frame.look.light = Look::Light::Matcap;
  return frame;
}

/// The face of the cube that a ray meets first, by its six planes, and how far from its edges.
struct Met {
  std::size_t face = 0;
  double rim = 0;
};
std::optional<Met> first_face(const Ray3d& ray) {
  double enter = -1e9, leave = 1e9;
  Met met;
  const std::array o = {ray.origin.x, ray.origin.y, ray.origin.z},
                   d = {ray.direction.x, ray.direction.y, ray.direction.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double a = (-1 - o[axis]) / d[axis], b = (1 - o[axis]) / d[axis], near = std::min(a, b);
    if (near > enter) {
      enter = near;
      met.face = 2 * axis + (d[axis] < 0 ? 1 : 0);
    }
    leave = std::min(leave, std::max(a, b));
  }
  if (enter > leave) return std::nullopt;
  met.rim = 1;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (axis != met.face / 2) met.rim = std::min(met.rim, 1 - std::abs(o[axis] + d[axis] * enter));
  return met;
}

void expect_one_colour_a_face(const Words& words, const Frame& frame, const std::string& of) {
  std::array<std::optional<Pixel>, 6> colours;
  int seen = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto met = first_face(pixel_ray(frame.camera, kWidth, kHeight, x + 0.5, y + 0.5));
      if (!met || met->rim < 0.05) continue;  // two pixels at the edges
      const std::uint32_t word = words[static_cast<std::size_t>(y * kWidth + x)];
      const Pixel now = {static_cast<int>((word >> 16U) & 255U), static_cast<int>((word >> 8U) & 255U),
                         static_cast<int>(word & 255U)};
      std::optional<Pixel>& first = colours[met->face];
      if (!first) first = now;
      ASSERT_LE(difference(*first, now), 2) << of << " at " << x << ' ' << y;
      ++seen;
    }
  EXPECT_GT(seen, 5000) << of;
}

TEST(Edges, AFaceOfACubeHasOneColourUpToItsEdges) {
  const Frame frame = from_afar();
  FrameRenderer with = make_renderer();
  for (const int n : {4, 15}) {
    const auto model = cube(n);
    expect_one_colour_a_face(whole(with, *model, frame), frame, "n " + std::to_string(n));
    expect_one_colour_a_face(whole(with, *cut_at_random(model, 6), frame), frame, "cut, n " + std::to_string(n));
    const Tessellation all = tessellate(*model);
    Words words = blank(frame);
    ASSERT_TRUE(with.draw({all.positions, all.triangles}, frame, words, kWidth));
    expect_one_colour_a_face(words, frame, "mesh, n " + std::to_string(n));
  }
}

TEST(Edges, OfAMeshAreSharpFromThirtyDegrees) {
  const Frame frame = from_afar();
  const Vec3d right = normalized(cross(frame.camera.target - frame.camera.eye, frame.camera.up)),
              back = normalized(frame.camera.eye - frame.camera.target), up = cross(back, right);
  // A roof towards the eye, its ridge upright; how many colours its right half has.
  const auto colours = [&](double degrees) {
    const double slope = std::tan(degrees * std::numbers::pi / 360);
    std::vector<Vec3d> corners;
    for (const double y : {-0.8, 0.8})
      for (const double x : {-1.0, 0.0, 1.0}) corners.push_back(right * x + up * y - back * (slope * std::abs(x)));
    const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}};
    FrameRenderer with = make_renderer();  // which holds no mesh that lay in the same places
    Words words = blank(frame);
    EXPECT_TRUE(with.draw({corners, triangles}, frame, words, kWidth));
    const auto row = words.begin() + kHeight / 2 * kWidth;
    return std::set<std::uint32_t>(row + kWidth / 2 + 2, row + kWidth / 2 + 40).size();
  };
  EXPECT_LE(colours(36), 2U);
  EXPECT_GT(colours(24), 5U);
}

TEST(Edges, FacetsOfRoundGroundDoNotShow) {
  // Facets of about 6 degrees; the judge is a ball of 64 times as many.
  const Frame frame = from_afar();
  const auto coarse = ball(1, 8), fine = ball(1, 64);
  FrameRenderer with = make_renderer();
  const Words wanted = whole(with, *fine, frame);
  const Tessellation all = tessellate(*coarse);
  Words mesh = blank(frame);
  ASSERT_TRUE(with.draw({all.positions, all.triangles}, frame, mesh, kWidth));
  for (const Words& words : {whole(with, *coarse, frame), mesh}) {
    unsigned worst = 0;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        if (std::hypot(x + 0.5 - kWidth / 2.0, y + 0.5 - kHeight / 2.0) > 0.2 * kHeight) continue;
        const std::size_t k = static_cast<std::size_t>(y * kWidth + x);
        for (const unsigned shift : {0U, 8U, 16U}) {
          const unsigned a = (words[k] >> shift) & 255U, b = (wanted[k] >> shift) & 255U;
          worst = std::max(worst, std::max(a, b) - std::min(a, b));
        }
      }
    EXPECT_LE(worst, 14U);
  }
}

TEST(ParallelCamera, ShowsABallAsACircleOfItsRadius) {
  const auto model = ball(3, 16);
  Camera camera = front(16.0 / 9, 30, 20);
  camera.parallel = true;
  camera.view_height = 3;
  for (const Vec3d from : {Vec3d{}, camera.eye * -1.2}) {  // the second eye is behind the ball
    camera.eye += from;
    camera.target += from;
    Frame frame = small_frame(camera);
    frame.look.top = frame.look.bottom = {};
    const Words words = whole(renderer(), *model, frame);
    const Ray3d middle = pixel_ray(camera, kWidth, kHeight, 160, 90);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const Ray3d ray = pixel_ray(camera, kWidth, kHeight, x + 0.5, y + 0.5);
        const double r = length(cross(ray.origin, ray.direction));
        EXPECT_EQ(ray.direction, middle.direction);
        const bool covered = (words[static_cast<std::size_t>(y * kWidth + x)] & 0xffffffU) != 0;
        if (r < 0.98) {
          ASSERT_TRUE(covered) << x << ' ' << y;
        } else if (r > 1.02) {
          ASSERT_FALSE(covered) << x << ' ' << y;
        }
      }
  }
}

TEST(Pick, FindsWhatTheRayFinds) {
  const auto model = ball(3, 32, rough);
  Camera flat = front(16.0 / 9, 10, 40);
  flat.parallel = true;
  flat.view_height = 2.5;
  for (const Camera& camera : {front(16.0 / 9, 70, -20), flat})
    for (const int samples : {1, 16}) {
      Frame frame = small_frame(camera);
      frame.samples = samples;
      frame.tau = 0;
      whole(renderer(), *model, frame);
      int hits = 0;
      for (int y = 5; y < kHeight; y += 13)
        for (int x = 5; x < kWidth; x += 13) {
          const auto picked = renderer().pick(x + 0.5, y + 0.5);
          // Some sample of the pixel is where the ray was; at a rim it may miss.
          const auto hit = raycast(*model, pixel_ray(camera, kWidth, kHeight, x + 0.5, y + 0.5));
          const auto beside = raycast(*model, pixel_ray(camera, kWidth, kHeight, x + 3, y + 0.5));
          const auto other = raycast(*model, pixel_ray(camera, kWidth, kHeight, x - 2, y + 0.5));
          if (hit && beside && other) {
            ASSERT_TRUE(picked) << x << ' ' << y;
            if (samples == 1) {
              EXPECT_LT(length(*picked - hit->point.position), 2e-4) << x << ' ' << y;
            }
            // On the surface in any case.
            EXPECT_LT(length(closest_point(*model, *picked).position - *picked), 2e-4);
            ++hits;
          } else if (!hit && !beside && !other) {
            EXPECT_FALSE(picked) << x << ' ' << y;
          }
        }
      EXPECT_GT(hits, 40);
    }
  EXPECT_FALSE(renderer().pick(-1, 5));
  EXPECT_FALSE(renderer().pick(5, 1e9));
}

TEST(Cancelled, TheNextFrameIsWhole) {
  const auto model = ball(4, 32, rough), other = ball(4, 32);
  Frame frame = small_frame(front());
  frame.samples = 16;
  FrameRenderer with = make_renderer();
  const Words expected = whole(with, *model, frame);
  Words words = blank(frame);
  const std::atomic<bool> at_once = true;
  EXPECT_EQ(with.draw(*model, frame, words, kWidth, &at_once, true).error().code, Errc::Cancelled);
  EXPECT_EQ(*with.draw(*model, frame, words, kWidth), (PixelRect{0, 0, kWidth, kHeight}));
  EXPECT_EQ(words, expected);
  // While it uploads, and while it draws.
  Frame large = frame;
  large.width = large.height = 4000;
  Words many = blank(large);
  for (const int wait : {5, 60, 400}) {
    std::atomic<bool> cancel = false;
    std::jthread asks([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(wait));
      cancel = true;
    });
    const auto stopped = with.draw(*other, large, many, large.width, &cancel, true);
    ASSERT_FALSE(stopped) << wait;
    EXPECT_EQ(stopped.error().code, Errc::Cancelled);
    words = blank(frame);
    ASSERT_TRUE(with.draw(*model, frame, words, kWidth));
    EXPECT_EQ(words, expected) << wait;
  }
  // A cancel that nobody asks for changes nothing.
  const std::atomic<bool> never = false;
  words = blank(frame);
  ASSERT_TRUE(with.draw(*model, frame, words, kWidth, &never, true));
  EXPECT_EQ(words, expected);
}

TEST(Adopt, DrawsIntoTheCallersFramebufferWhatIsInItsOwnPicture) {
  EXPECT_EQ(FrameRenderer::adopt().error().code, Errc::Io) << "no context is current";
  const auto model = ball(3, 16, rough);
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  Frame frame = small_frame(front(16.0 / 9, 30, 10));
  const Words expected = whole(renderer(), *model, frame);
  auto with = FrameRenderer::adopt();
  ASSERT_TRUE(with) << with.error().message;
  EXPECT_EQ(with->device(), renderer().device());
  EXPECT_EQ(whole(*with, *model, frame), expected);
  const detail::GlFramebuffer mine = detail::make_framebuffer();
  const detail::GlTexture colour = detail::attached(mine, GL_COLOR_ATTACHMENT0, GL_RGBA8, kWidth, kHeight);
  ASSERT_TRUE(with->draw_to(*model, frame, mine));
  Words words = blank(frame);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, mine);
  glReadPixels(0, 0, kWidth, kHeight, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV, words.data());
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      ASSERT_EQ(words[static_cast<std::size_t>((kHeight - 1 - y) * kWidth + x)],
                expected[static_cast<std::size_t>(y * kWidth + x)])
          << x << ' ' << y;
}

TEST(Look, StrideLeavesTheRestAlone) {
  const auto model = ball(2, 16);
  const Frame frame = small_frame(front());
  constexpr int kStride = kWidth + 7;
  Words words(std::size_t{kStride} * kHeight, 7);
  ASSERT_TRUE(renderer().draw(*model, frame, words, kStride, nullptr, true));
  const Words expected = whole(renderer(), *model, frame);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kStride; ++x) {
      const std::uint32_t word = words[static_cast<std::size_t>(y * kStride + x)];
      ASSERT_EQ(word, x < kWidth ? expected[static_cast<std::size_t>(y * kWidth + x)] : 7U);
    }
  words.resize(words.size() - 8);
  EXPECT_EQ(renderer().draw(*model, frame, words, kStride).error().code, Errc::InvalidArgument);
  EXPECT_EQ(renderer().draw(*model, frame, words, kWidth - 1).error().code, Errc::InvalidArgument);
}

TEST(Look, EachMaterialIsItsOwnAndAllAreLitFromAbove) {
  const auto model = ball(3, 16);
  Frame frame = small_frame(front());
  std::vector<std::uint32_t> middles;
  ASSERT_GE(matcaps().size(), 6U);
  EXPECT_EQ(matcaps()[0], "clay");
  for (int k = 0; k < static_cast<int>(matcaps().size()); ++k) {
    frame.look.matcap = k;
    const Words words = whole(renderer(), *model, frame);
    const auto green = [&](int x, int y) { return (words[static_cast<std::size_t>(y * kWidth + x)] >> 8U) & 255U; };
    EXPECT_GT(green(145, 55), green(170, 140) + 15) << matcaps()[static_cast<std::size_t>(k)];
    middles.push_back(words[90 * kWidth + 160]);
  }
  std::ranges::sort(middles);
  EXPECT_EQ(std::ranges::unique(middles).begin(), middles.end());
  frame.look.matcap = static_cast<int>(matcaps().size());
  Words words = blank(frame);
  EXPECT_EQ(renderer().draw(*model, frame, words, kWidth).error().code, Errc::InvalidArgument);
}

TEST(Look, TheMaskDarkensAndHollowsAreDarkerThanRidges) {
  // Waves along z, seen from the side: the bottoms lie where cos is -1.
  const auto model = ball(4, 32, [](Vec3d d) { return 0.02 * std::cos(40 * d.y); });
  Frame frame = small_frame(front());
  const auto bright = [&](const Words& words) {
    double sum = 0;
    for (const std::uint32_t word : words) sum += double((word >> 8U) & 255U);
    return sum;
  };
  const Words with = whole(renderer(), *model, frame);
  frame.look.cavity = false;
  const Words without = whole(renderer(), *model, frame);
  const auto change = [&](double height) {
    const double y = 90 - 90 / std::tan(15 * std::numbers::pi / 180) * height /
                              (length(frame.camera.eye) - std::sqrt(1 - height * height));
    const auto k = static_cast<std::size_t>(y) * kWidth + 160;
    return int((with[k] >> 8U) & 255U) - int((without[k] >> 8U) & 255U);
  };
  EXPECT_LT(change(5 * std::numbers::pi / 40), -5);
  EXPECT_GT(change(4 * std::numbers::pi / 40), 2);
  SnapshotDraft draft(model);
  draft.add_layer(Layer::Mask, 4, 1);
  const auto masked = draft.finish();
  EXPECT_LT(bright(whole(renderer(), *masked, frame)), 0.95 * bright(without));
  frame.look.mask = false;
  EXPECT_EQ(whole(renderer(), *masked, frame), without);
}

TEST(Look, ColoursRunOnAcrossTheEdgesOfSlabs) {
  // A flat sheet of many slabs whose colour runs evenly from side to side.
  const auto run = [](bool broken) {
    SnapshotDraft draft(coloured(displaced(plane_shell(4, 16), [](Vec3d) { return 0.5; }), 16,
                                 [](Vec3d p) { return Vec3f{static_cast<float>(p.x), 0.5F, 0.5F}; }));
    if (broken)
      for (int k = 0; k <= 16; ++k) draft.edit(Layer::Colour, 13).set(0, sample_index(16, edge_point(16, 1, k)), 1);
    return draft.finish();
  };
  // In steps of 8 bits per pixel along rows, beyond the even run.
  const auto largest_jump = [&](bool broken) {
    const auto model = run(broken);
    Frame frame = small_frame(framing(surface_bounds(*model), 0, 89.9, 16.0 / 9));
    frame.look.cavity = false;
    frame.look.matcap = 5;
    const Words words = whole(renderer(), *model, frame);
    int most = 0;
    for (int y = 20; y < kHeight - 20; ++y)
      for (int x = 85; x < 235; ++x) {
        const auto red = [&](int at) { return int((words[static_cast<std::size_t>(y * kWidth + at)] >> 16U) & 255U); };
        most = std::max(most, std::abs(red(x + 1) - red(x)));
      }
    return most;
  };
  EXPECT_LE(largest_jump(false), 3);
  EXPECT_GT(largest_jump(true), 20);
}

TEST(Memory, IsAQuarterOfClassicBuffers) {
  for (const int n : {15, 64}) {
    const auto model = ball(n == 15 ? 3 : 2, n, rough);
    Frame frame = small_frame(front());
    whole(renderer(), *model, frame);
    // A vertex of 3 floats, a normal of 3, and a word of hollow and mask; indices of 16 bits; by slab.
    const double samples = static_cast<double>(sample_count(n)), triangles = double(n) * n;
    const double classic = static_cast<double>(model->slab_mesh().slab_count()) * (samples * 28 + triangles * 6);
    EXPECT_LT(static_cast<double>(renderer().stats().gpu_bytes), classic / 4) << n;
  }
}

}  // namespace
}  // namespace relief::testing
