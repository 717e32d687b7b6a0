// The surface as drawn: no cracks, levels of detail, and only what changed is uploaded.
#include "render_support.h"

#include <relief/core/query.h>
#include <relief/core/tessellate.h>

namespace relief::testing {
namespace {

FrameRenderer::Coverage coverage(const Snapshot& model, const Camera& camera, int level) {
  DrawSettings settings = small_settings();
  settings.width = 640;
  settings.height = 360;
  settings.level = level;
  const auto found = renderer().coverage(model, settings.frame(camera));
  if (!found) ADD_FAILURE() << found.error().message;
  return found.value_or(FrameRenderer::Coverage{});
}

double rough(Vec3d d) { return 0.1 * std::sin(13 * d.x + 3) * std::cos(11 * d.y) + 0.04 * std::sin(60 * d.z); }

TEST(Cracks, NoneOnClosedShellsAtAnyLevel) {
  for (const int n : {15, 16, 32}) {
    const auto model = ball(2, n, rough);
    for (int level = 0; level < 6; ++level) {
      const auto found = coverage(*model, front(16.0 / 9, 33, 21), level);
      EXPECT_EQ(found.cracks, 0U) << "n " << n << " level " << level;
      EXPECT_GT(found.covered, 30000U);
    }
  }
  const auto ring =
      displaced(torus_shell(24, 12, 8), [](Vec3d p) { return 0.5 + 0.45 * std::sin(9 * p.x + 7 * p.y - 5 * p.z); });
  for (int level = 0; level < 4; ++level) {
    const auto found = coverage(*ring, framing(surface_bounds(*ring), 20, 40, 16.0 / 9), level);
    EXPECT_EQ(found.cracks, 0U) << "level " << level;
    EXPECT_GT(found.covered, 10000U);
  }
}

TEST(Cracks, NoneBetweenSlabsOfDifferentN) {
  const auto waves = [](Vec3d p) { return 0.5 + 0.35 * std::sin(9 * p.x + 7 * p.y - 5 * p.z); };
  for (const auto& shell : {mixed_shell(*sphere_shell(2, 1), 1, 6), mixed_shell(*sphere_shell(1, 1), 3, 4),
                            mixed_shell(*torus_shell(24, 12, 1), 1, 4)}) {
    const auto model = displaced(shell, waves);
    for (int level = 0; level < level_count(*shell); ++level) {
      const auto found = coverage(*model, framing(surface_bounds(*model), 20, 40, 16.0 / 9), level);
      EXPECT_EQ(found.cracks, 0U) << "level " << level;
      EXPECT_GT(found.covered, 10000U);
      EXPECT_EQ(renderer().stats().triangles, tessellate(*model, level).triangles.size());
    }
  }
}

TEST(Cracks, NoneFarFromTheOriginOrCloseUp) {
  const Vec3d far = {1e6, 1e6, -1e6};
  Camera camera = front(16.0 / 9, 70, -10);
  camera.eye += far;
  camera.target += far;
  EXPECT_EQ(coverage(*ball(2, 32, rough, far), camera, 0).cracks, 0U);
  Camera close = front();
  close.eye = {0.2, 0.1, 1.6};
  close.target = {0.1, 0.3, 0};
  close.field_of_view = 20;
  EXPECT_EQ(coverage(*ball(2, 32, rough), close, 0).cracks, 0U);
}

TEST(Cracks, AreFoundWhereTheyAre) {
  // A single copy of the shared samples of one edge moved: a slit between two slabs.
  SnapshotDraft draft(ball(1, 16));
  float* values = draft.edit(Layer::Displacement, 0).plane();
  for (int t = 1; t < 16; ++t) values[sample_index(16, edge_point(16, 1, t))] -= 0.1F;
  const Vec3d middle = sample_position(draft.base(), 0, {0, 8});
  const auto slit = draft.finish();
  Camera camera;
  camera.eye = middle * 3 + Vec3d{0.8, -0.5, 0.7};
  EXPECT_GT(coverage(*slit, camera, 0).cracks, 20U);
  // An open sheet is nothing but a crack.
  const auto sheet = displaced(plane_shell(3, 8), [](Vec3d) { return 0.5; });
  const auto found = coverage(*sheet, framing({{0, 0, 0}, {1, 0, 1}}, 0, 60, 1.5), 0);
  EXPECT_GT(found.cracks, 1000U);
  EXPECT_EQ(found.cracks, found.covered);
}

/// A shape that no border between slabs of different n may show on.
TEST(Mixed, LooksLikeTheSameShapeOnOneGrid) {
  const auto bump = [](Vec3d d) { return 0.03 * std::sin(5 * d.x) * std::cos(4 * d.y); };
  const auto field = [&](Vec3d p) { return std::clamp(((1 + bump(normalized(p))) / length(p) - 0.8) / 0.4, 0.0, 1.0); };
  const DrawSettings settings = small_settings();
  const Picture one = draw(*displaced(sphere_shell(3, 32), field), front(), settings);
  const Picture mixed = draw(*displaced(mixed_shell(*sphere_shell(3, 1), 8, 2), field), front(), settings);
  EXPECT_GT(psnr(one, mixed), 42);
}

TEST(Mixed, AnEditLeavesTheSamePictureAsAFreshRenderer) {
  const auto before = displaced(mixed_shell(*sphere_shell(2, 1), 2, 4), [](Vec3d) { return 0.5; });
  const SlabMesh& mesh = before->slab_mesh();
  const DrawSettings settings = small_settings();
  draw(*before, front(), settings);
  SnapshotDraft draft(before);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    bool near = false;
    const int n = mesh.intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i)
        if (length(sample_position(*before, s, {i, j}) - Vec3d{0.3, 0.1, 0.95}) < 0.2) {
          draft.edit(Layer::Displacement, s).plane()[sample_index(n, {i, j})] -= 0.2F;
          near = true;
        }
    if (near) constrain(mesh, Layer::Displacement, s, draft.edit(Layer::Displacement, s));
  }
  const auto after = draft.finish();
  ASSERT_TRUE(validate(*after));
  const Picture kept = draw(*after, front(), settings);
  EXPECT_LT(renderer().stats().tiles_uploaded, 60U);
  auto fresh = FrameRenderer::create();
  ASSERT_TRUE(fresh);
  EXPECT_EQ(kept.rgb, try_draw(*fresh, *after, front(), settings)->rgb);
}

TEST(Holes, ShowWhatLiesBehind) {
  const auto one = ball(2, 16);
  const auto shell = mixed_shell(*sphere_shell(2, 1), 4, 3);
  for (const auto& whole : {one, displaced(shell, [](Vec3d) { return 0.5; })}) {
    const auto through = with_hole(whole, [](Vec3d p) { return std::abs(p.z) > 0.8; });
    const auto front_only = with_hole(whole, [](Vec3d p) { return p.z > 0.8; });
    DrawSettings settings = small_settings();
    const Pixel full = pixel(draw(*whole, front(), settings), 160, 90);
    const Picture tunnel = draw(*through, front(), settings);
    EXPECT_EQ(renderer().stats().triangles, tessellate(*through).triangles.size());
    const Pixel background = pixel(tunnel, 10, 90);
    EXPECT_LT(difference(pixel(tunnel, 160, 90), background), 40);
    EXPECT_GT(difference(full, background), 60);
    const Pixel inner = pixel(draw(*front_only, front(), settings), 160, 90);
    EXPECT_GT(difference(inner, background), 15) << "the inside of the far side";
    EXPECT_EQ(full, pixel(draw(*whole, front(), settings), 160, 90)) << "the hole is closed again";
    settings.level = 2;
    draw(*through, front(), settings);
    // The rim of a hole is made of the finest triangles at every level.
    EXPECT_GT(renderer().stats().triangles, tessellate(*through, 2).triangles.size());
    EXPECT_LT(renderer().stats().triangles, tessellate(*through).triangles.size());
  }
}

TEST(Levels, CoarserLooksAlikeAndCostsLess) {
  const auto model = ball(3, 32, [](Vec3d d) { return 0.02 * std::sin(5 * d.x) * std::cos(4 * d.y); });
  DrawSettings settings = small_settings();
  const Picture full = draw(*model, front(), settings);
  EXPECT_EQ(renderer().stats().triangles, 512U * 1024U);
  settings.level = 1;
  const Picture half = draw(*model, front(), settings);
  EXPECT_EQ(renderer().stats().triangles, 512U * 256U);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 0U);
  settings.level = 3;
  const Picture coarse = draw(*model, front(), settings);
  EXPECT_EQ(renderer().stats().triangles, 512U * 16U);
  EXPECT_GT(psnr(full, half), 42);
  EXPECT_GT(psnr(full, coarse), 32);
  EXPECT_LT(psnr(full, coarse), psnr(full, half));
}

TEST(Levels, AnOddGridIsDrawnInFull) {
  const auto model = ball(1, 15, rough);
  DrawSettings settings = small_settings();
  const Picture full = draw(*model, front(), settings);
  settings.level = 4;
  EXPECT_EQ(full.rgb, draw(*model, front(), settings).rgb);
  EXPECT_EQ(renderer().stats().triangles, 32U * 225U);
}

TEST(Upload, OnlyWhatChanged) {
  const auto before = ball(2, 16);
  const DrawSettings settings = small_settings();
  draw(*before, front(), settings);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 128U);
  draw(*before, front(), settings);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 0U);

  SnapshotDraft draft(before);
  draft.edit(Layer::Displacement, 7).plane()[sample_index(16, {5, 5})] -= 0.05F;
  const auto inside = draft.finish();
  draw(*inside, front(), settings);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 1U);

  // Beside an edge the normals of the slab beyond it change too.
  draft.edit(Layer::Displacement, 9).plane()[sample_index(16, {5, 1})] -= 0.05F;
  const auto beside = draft.finish();
  draw(*beside, front(), settings);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 2U);

  // Going back is a change of the same two tiles.
  draw(*inside, front(), settings);
  EXPECT_EQ(renderer().stats().tiles_uploaded, 2U);
}

TEST(Upload, AnEditLeavesTheSamePictureAsAFreshRenderer) {
  const auto before = coloured(ball(2, 16), 8, [](Vec3d p) { return Vec3f{p.x > 0 ? 1.0F : 0.2F, 0.4F, 0.4F}; });
  const DrawSettings settings = small_settings();
  draw(*before, front(), settings);
  SnapshotDraft draft(before);
  for (SlabId s = 0; s < before->slab_mesh().slab_count(); ++s)
    for (int j = 0; j <= 16; ++j)
      for (int i = 0; i + j <= 16; ++i)
        if (length(sample_position(*before, s, {i, j}) - Vec3d{0.3, 0.1, 0.95}) < 0.2) {
          draft.edit(Layer::Displacement, s).plane()[sample_index(16, {i, j})] -= 0.2F;
          draft.edit(Layer::Colour, s).set(2, sample_index(8, {i / 2, j / 2}), 1);
        }
  const auto after = draft.finish();
  const Picture kept = draw(*after, front(), settings);
  EXPECT_GT(renderer().stats().tiles_uploaded, 2U);
  EXPECT_LT(renderer().stats().tiles_uploaded, 60U);
  auto fresh = FrameRenderer::create();
  ASSERT_TRUE(fresh);
  EXPECT_EQ(kept.rgb, try_draw(*fresh, *after, front(), settings)->rgb);
}

TEST(Upload, AnEditThatIsOutOfThePictureStillChangesStudioLight) {
  // The camera sees the floor beside the ball, where its shadow lies, and the ball's lower half only.
  const auto before = ball(2, 16);
  SnapshotDraft draft(before);
  for (SlabId s = 0; s < before->slab_mesh().slab_count(); ++s)
    for (int k = 0; k < static_cast<int>(sample_count(16)); ++k)
      if (before->slab_mesh().box(s).centre().y > 0.7) draft.edit(Layer::Displacement, s).plane()[k] = 0.9F;
  const auto after = draft.finish();
  DrawSettings settings = small_settings();
  settings.ground = true;
  Camera low = front();
  low.eye = {0, 0.3, 5};
  low.target = {0, -1, 0};
  low.field_of_view = 14;
  Frame frame = settings.frame(low);
  std::vector<std::uint32_t> words(std::size_t{320} * 180);
  auto with = FrameRenderer::create();
  ASSERT_TRUE(with && with->draw(*before, frame, words, 320));
  const auto rect = with->draw(*after, frame, words, 320);
  ASSERT_TRUE(rect);
  EXPECT_EQ(*rect, (PixelRect{0, 0, 320, 180}));
  EXPECT_TRUE(with->draw(*after, frame, words, 320)->empty());
}

TEST(Upload, AnotherModelAnotherColourGridAndBack) {
  const auto plain = ball(1, 15), fine = ball(2, 16);
  const auto red = coloured(plain, 4, [](Vec3d) { return Vec3f{0.9F, 0.1F, 0.1F}; });
  const auto green = coloured(plain, 64, [](Vec3d) { return Vec3f{0.1F, 0.9F, 0.1F}; });
  const DrawSettings settings = small_settings();
  const Picture first = draw(*plain, front(), settings);
  const Pixel r = pixel(draw(*red, front(), settings), 160, 90);
  EXPECT_GT(r[0], 2 * r[1]);
  const Pixel g = pixel(draw(*green, front(), settings), 160, 90);
  EXPECT_GT(g[1], 2 * g[0]);
  draw(*fine, front(), settings);
  EXPECT_EQ(first.rgb, draw(*plain, front(), settings).rgb);
}

TEST(Edit, ChangesThePictureWhereItIsAndNowhereElse) {
  const Vec3d at = normalized(Vec3d{0.25, 0.2, 1});
  const auto before = ball(3, 16);
  const auto after = ball(3, 16, [&](Vec3d d) { return -0.08 * std::max(0.0, 1 - length(d - at) / 0.15); });
  DrawSettings settings = small_settings();
  settings.lights = 16;
  const Camera camera = front();
  const Picture a = draw(*before, camera, settings), b = draw(*after, camera, settings);
  const Place middle = project(camera, 320, 180, at);
  int near = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      const int d = difference(pixel(a, x, y), pixel(b, x, y));
      if (std::hypot(x - middle.x, y - middle.y) > 20) {
        ASSERT_LE(d, 3) << x << ' ' << y;
      } else {
        near += d > 15 ? 1 : 0;
      }
    }
  EXPECT_GT(near, 50);
}

}  // namespace
}  // namespace relief::testing
