// Cages whose slabs are cut in four: no cracks, the look of the uncut one, and only what changed is made anew.
#include "render_support.h"
#include "support/cuts.h"

#include <relief/core/detail.h>
#include <relief/core/tessellate.h>
#include <relief/render/coverage.h>
#include <relief/render/display_cache.h>
#include <relief/render/gl_context.h>

#include <random>

namespace relief::testing {
namespace {

double rough(Vec3d d) { return 0.1 * std::sin(13 * d.x + 3) * std::cos(11 * d.y) + 0.04 * std::sin(60 * d.z); }
double smooth(Vec3d d) { return 0.03 * std::sin(5 * d.x) * std::cos(4 * d.y); }
double waves(Vec3d p) { return 0.5 + 0.35 * std::sin(9 * p.x + 7 * p.y - 5 * p.z); }

/// Closed models whose grids halve well, hardly, not at all, and mixed.
std::vector<SnapshotPtr> models() {
  return {ball(1, 32, rough), ball(2, 12, rough), ball(1, 15, rough),
          displaced(mixed_shell(*sphere_shell(1, 1), 2, 4), waves), displaced(torus_shell(12, 6, 8), waves)};
}

/// Small cells where a tool would work: slabs near a direction, level after level.
SnapshotPtr refined_at(const SnapshotPtr& model, Vec3d towards, double radius, int levels) {
  RandomCuts cuts(model);
  for (int level = 0; level < levels; ++level) {
    const SlabId count = cuts.model()->slab_mesh().slab_count();
    for (SlabId s = 0; s < count; ++s) {
      const SlabMesh& mesh = cuts.model()->slab_mesh();
      if (mesh.level(s) == level && length(normalized(mesh.box(s).centre()) - towards) < radius) cuts.cut(s);
    }
  }
  return cuts.model();
}

TEST(CutCage, HasNoCracksAtAnyLevelOfDetail) {
  for (const SnapshotPtr& model : models()) {
    const SnapshotPtr cut = cut_at_random(model, 40);
    Frame frame = small_frame(framing(surface_bounds(*model), 20, 40, 16.0 / 9));
    frame.width = 640;
    frame.height = 360;
    frame.tau = 0;
    for (frame.level = 0; frame.level < level_count(cut->slab_mesh()); ++frame.level) {
      const auto found = renderer().coverage(*cut, frame);
      ASSERT_TRUE(found) << found.error().message;
      EXPECT_EQ(found->cracks, 0U) << "level " << frame.level;
      EXPECT_GT(found->covered, 10000U);
      EXPECT_EQ(renderer().stats().triangles, tessellate(*cut, frame.level).triangles.size());
    }
  }
}

TEST(CutCage, HasNoCracksUnderTheMicroscope) {
  const SnapshotPtr model = ball(1, 16, rough);
  RandomCuts cuts(model);
  Vec3d place;
  for (int k = 0; k < 9; ++k) {
    const SlabMesh& mesh = cuts.model()->slab_mesh();
    const SlabId s = k == 0 ? 3 : mesh.slab_count() - 1;
    place = sample_position(*cuts.model(), s, {0, mesh.intervals(s) / 2});
    cuts.cut(s);
  }
  EXPECT_EQ(cuts.model()->slab_mesh().level(cuts.model()->slab_mesh().slab_count() - 1), 9);
  for (const double away : {1.0, 0.1, 0.01}) {
    Frame frame = small_frame({.eye = place + normalized(place + Vec3d{0.2, 0.1, -0.1}) * away, .target = place});
    frame.tau = 0;
    const auto found = renderer().coverage(*cuts.model(), frame);
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_EQ(found->cracks, 0U) << "from " << away;
    EXPECT_GT(found->covered, 3000U);
  }
}

TEST(CutCage, HasNoCracksWithAnotherLevelInEachSlab) {
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  std::mt19937 random(5);
  for (const SnapshotPtr& model : models())
    for (int round = 0; round < 3; ++round) {
      const SnapshotPtr cut = cut_at_random(model, 40);
      detail::DisplayCache cache;
      ASSERT_TRUE(cache.update(*cut));
      std::vector<std::uint8_t> levels(cut->slab_mesh().slab_count());
      for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random() % 7);
      const detail::DrawnLevels made = cache.detail(levels);
      const Camera camera = framing(surface_bounds(*cut), 33, 21, 16.0 / 9);
      const auto sums = detail::signed_coverage(cache, made, camera, 640, 360);
      ASSERT_TRUE(sums);
      EXPECT_EQ(sums->cracks, 0U);
      EXPECT_GT(sums->covered, 10000U);
    }
}

/// Pixels that differ by more than so many steps of 256.
std::size_t pixels_beyond(const Picture& a, const Picture& b, int steps) {
  std::size_t count = 0;
  for (int y = 0; y < a.height; ++y)
    for (int x = 0; x < a.width; ++x) count += difference(pixel(a, x, y), pixel(b, x, y)) > steps ? 1U : 0U;
  return count;
}

TEST(CutCage, LooksLikeTheUncutOne) {
  for (const int n : {32, 15}) {
    const SnapshotPtr plain = ball(1, n, n == 32 ? rough : smooth);
    const SnapshotPtr model =
        n == 15 ? plain : coloured(plain, 16, [](Vec3d p) { return Vec3f{p.x > 0 ? 0.8F : 0.4F, 0.5F, 0.4F}; });
    const SnapshotPtr cut = cut_at_random(model, 60);
    Frame frame = small_frame(front(16.0 / 9, 25, 15));
    frame.tau = 0;
    frame.samples = 4;
    for (const Look::Light light : {Look::Light::Matcap, Look::Light::Studio})
      for (const Look::Map map : {Look::Map::None, Look::Map::Displacement, Look::Map::Depth, Look::Map::Stretch}) {
        if (light == Look::Light::Studio && map != Look::Map::None) continue;
        if (n == 15 && map == Look::Map::Stretch) continue;  // its triangles become smaller
        frame.look.light = light;
        frame.look.lights = 6;
        frame.look.map = map;
        const auto before = renderer().picture(*model, frame), after = renderer().picture(*cut, frame);
        ASSERT_TRUE(before && after);
        // Between the samples of an odd grid the cut one has others, whose normals lie in between.
        EXPECT_LE(pixels_beyond(*before, *after, n == 32 ? 2 : 12), 60U)
            << "n " << n << " map " << int(map) << " light " << int(light);
        EXPECT_GT(psnr(*before, *after), n == 32 ? 50 : 40) << "n " << n << " map " << int(map);
      }
  }
}

TEST(CutCage, FinerGridsShowNoCreases) {
  const auto wave = [](Vec3d p) { return 0.5 + 0.1 * std::sin(7 * p.x) * std::cos(5 * p.z); };
  const SnapshotPtr model = displaced(plane_shell(2, 16), wave);
  Detail detail;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) detail.grids.push_back({Layer::Displacement, s, 64});
  const Result<SnapshotPtr> fine = with_detail(model, detail);
  ASSERT_TRUE(fine);
  // The judge: the same shape whose new samples lie on it, not on the old triangles.
  const SnapshotPtr shape = displaced(plane_shell(2, 64), wave);
  Frame frame = small_frame({.eye = {0.5, 1, 0.5}, .target = {0.5, 0, 0.5}, .up = {0, 0, 1}});
  frame.tau = 0;
  frame.samples = 4;
  frame.look.light = Look::Light::Matcap;
  const auto before = renderer().picture(*model, frame), after = renderer().picture(**fine, frame),
             wanted = renderer().picture(*shape, frame);
  ASSERT_TRUE(before && after && wanted);
  EXPECT_GT(psnr(*wanted, *after), psnr(*wanted, *before) - 1);
}

/// Some of a layer changed around a direction, alike in all copies.
SnapshotPtr dabbed(const SnapshotPtr& model, Layer layer, std::mt19937& random) {
  std::normal_distribution<double> any;
  const Vec3d middle = normalized(Vec3d{any(random), any(random), any(random)});
  const double radius = std::uniform_real_distribution(0.05, 0.25)(random);
  const float amount = std::uniform_real_distribution(-0.2F, 0.2F)(random);
  SnapshotDraft draft(model);
  const SlabMesh& mesh = model->slab_mesh();
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = model->intervals(layer, s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) {
        if (length(normalized(sample_position(mesh, s, n, {i, j}, 0.5)) - middle) > radius) continue;
        for (int c = 0; c < channels(layer); ++c) {
          Tile& tile = draft.edit(layer, s);
          const std::size_t k = sample_index(n, {i, j});
          tile.set(c, k, layer == Layer::Void ? 1.0F : std::clamp(tile.value(c, k) + amount, 0.1F, 0.9F));
        }
      }
  }
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const auto intervals_of = [&](SlabId slab) { return model->intervals(layer, slab); };
    bool edited = draft.now().shared_tile(layer, s) != model->shared_tile(layer, s);
    for (int edge = 0; edge < 3; ++edge)
      mesh.for_each_across(s, edge, [&](SlabId other) {
        edited = edited || draft.now().shared_tile(layer, other) != model->shared_tile(layer, other);
      });
    if (edited) constrain(mesh, layer, s, intervals_of, draft.edit(layer, s));
  }
  return draft.finish();
}

/// The picture of a renderer that knows nothing of the model yet, as far as slabs, buffers and index lists go.
Words fresh_picture(FrameRenderer& with, const Snapshot& model, const Frame& frame) {
  static const SnapshotPtr other = ball(0, 4, [](Vec3d) { return 0.01; }, {7, 0, 0});
  Words words(std::size_t{kWidth} * kHeight);
  EXPECT_TRUE(with.draw(*other, frame, words, kWidth, nullptr, true));
  const auto rect = with.draw(model, frame, words, kWidth, nullptr, true);
  EXPECT_TRUE(rect) << rect.error().message;
  return words;
}

/// The same cage but for one fibre, which is longer on its inner side, or turned; with the tiles that there were.
SnapshotPtr with_moved_fibre(const SnapshotPtr& model, FibreId moved, Vec3d inner) {
  const SlabMesh& mesh = model->slab_mesh();
  std::vector<Fibre> fibres(mesh.root_fibres().begin(), mesh.root_fibres().end());
  fibres[moved].inner = inner;
  std::vector<SlabMesh::Face> faces;
  for (const Slab& root : mesh.roots()) faces.push_back({root.fibres, root.intervals});
  const auto roots = SlabMesh::make(std::move(fibres), faces);
  EXPECT_TRUE(roots);
  const auto cut = roots->cut(mesh.cuts());
  EXPECT_TRUE(cut);
  std::vector<int> intervals;
  for (const Slab& slab : mesh.slabs()) intervals.push_back(slab.intervals);
  auto same = cut->refined(intervals);
  EXPECT_TRUE(same);
  return Snapshot::with_cage(*model, std::make_shared<const SlabMesh>(*std::move(same)), [&](Layer layer) {
    std::vector<TilePtr> tiles;
    for (SlabId s = 0; s < mesh.slab_count(); ++s) tiles.push_back(model->shared_tile(layer, s));
    return tiles;
  });
}

/// What may become of a model: cuts, finer grids of any layer, moved fibres, dabs, and any earlier state.
class Changes {
 public:
  Changes(SnapshotPtr start, unsigned seed) : random_(seed), states_{std::move(start)} {}

  SnapshotPtr next() {
    const SnapshotPtr head = states_.back();
    const SlabMesh& mesh = head->slab_mesh();
    SnapshotPtr made;
    const auto any = static_cast<SlabId>(random_() % mesh.slab_count());
    switch (random_() % 8) {
      case 0:
      case 1: {
        RandomCuts cuts(head, static_cast<std::uint32_t>(random_()));
        for (auto k = random_() % 3 + 1; k > 0; --k) cuts.cut_one(4);
        made = cuts.model();
        break;
      }
      case 2: {
        const Layer layer = random_() % 2 == 0 && head->has(Layer::Colour) ? Layer::Colour : Layer::Displacement;
        const auto finer = with_detail(head, {.cuts = {}, .grids = {{layer, any, 2 * head->intervals(layer, any)}}});
        made = finer ? *finer : head;
        break;
      }
      case 3: {
        const auto fibre = static_cast<FibreId>(random_() % mesh.root_fibres().size());
        made = with_moved_fibre(head, fibre, mesh.root_fibres()[fibre].inner * 0.96 + Vec3d{0.003, -0.002, 0.001});
        break;
      }
      case 4:
        made = states_[random_() % states_.size()];  // undone, or done again
        break;
      default: {
        constexpr std::array kLayers = {Layer::Displacement, Layer::Displacement, Layer::Colour, Layer::Mask,
                                        Layer::Void};
        const Layer layer = kLayers[random_() % kLayers.size()];
        made = head->has(layer) ? dabbed(head, layer, random_) : head;
      }
    }
    states_.push_back(made);
    return made;
  }

 private:
  std::mt19937 random_;
  std::vector<SnapshotPtr> states_;
};

TEST(CutCage, AChangeLeavesTheBitsOfAFreshPicture) {
  const auto plain = ball(2, 8, rough);
  const auto layered = [&] {
    SnapshotDraft draft(coloured(plain, 8, [](Vec3d p) { return Vec3f{p.x > 0 ? 0.8F : 0.4F, 0.5F, 0.4F}; }));
    draft.add_layer(Layer::Mask, 8, 0);
    draft.add_layer(Layer::Void, kOwnIntervals, 0);
    return draft.finish();
  }();
  const auto mixed = displaced(mixed_shell(*sphere_shell(2, 1), 1, 4), [](Vec3d) { return 0.5; });
  FrameRenderer kept = make_renderer(), fresh = make_renderer();
  Frame frame = small_frame(front(16.0 / 9, 25, 15));
  Words words(std::size_t{kWidth} * kHeight);
  int whole_frames = 0, drawn = 0, too_small = 0;
  unsigned seed = 1;
  for (const SnapshotPtr& start : {plain, layered, mixed})
    for (const Look::Map map : {Look::Map::None, Look::Map::Slabs, Look::Map::Stretch})
      for (const double tau : {0.0, 3.0}) {
        frame.samples = tau > 0 ? 4 : 1;
        frame.look.map = map;
        frame.look.slab_wires = map == Look::Map::Slabs;
        frame.tau = tau;
        Changes changes(start, seed++);
        ASSERT_TRUE(kept.draw(*start, frame, words, kWidth));
        for (int k = 0; k < 12; ++k) {
          const SnapshotPtr model = changes.next();
          const Words before = words;
          const auto rect = kept.draw(*model, frame, words, kWidth);
          ASSERT_TRUE(rect) << rect.error().message;
          const Words expected = fresh_picture(fresh, *model, frame);
          ASSERT_EQ(words, expected) << "seed " << seed << " change " << k << " map " << int(map) << " tau " << tau;
          EXPECT_EQ(pasted(before, words, *rect), words) << "written beyond the rectangle";
          whole_frames += kept.stats().everything ? 1 : 0;
          drawn += rect->empty() ? 0 : 1;
          if (!rect->empty() && pasted(before, words, shrunk(*rect, 8)) != expected) ++too_small;
        }
      }
  EXPECT_GT(drawn, 100);
  EXPECT_LT(whole_frames, drawn * 2 / 3);
  EXPECT_GT(too_small, 20) << "bounds that are 8 pixels too small are found out";
}

TEST(CutCage, AChangeInStudioLightLeavesTheBitsOfAFreshPicture) {
  FrameRenderer kept = make_renderer(), fresh = make_renderer();
  Frame frame = small_frame(front(16.0 / 9, 25, 15));
  frame.look.light = Look::Light::Studio;
  frame.look.lights = 6;
  frame.look.slab_wires = true;
  frame.tau = 0;
  Words words(std::size_t{kWidth} * kHeight);
  Changes changes(ball(2, 8, rough), 3);
  for (int k = 0; k < 8; ++k) {
    const SnapshotPtr model = changes.next();
    ASSERT_TRUE(kept.draw(*model, frame, words, kWidth));
    ASSERT_EQ(words, fresh_picture(fresh, *model, frame)) << "change " << k;
  }
}

TEST(CutCage, ARefineRebuildsItsSlabsOnly) {
  const SnapshotPtr model = ball(4, 8, rough);
  const SnapshotPtr cut = refined_at(model, normalized(Vec3d{0.2, 0.1, 1}), 0.08, 2);
  const SlabId added = cut->slab_mesh().slab_count() - model->slab_mesh().slab_count();
  ASSERT_GT(added, 20U);
  ASSERT_LT(added, 300U);
  Frame frame = small_frame(front());
  frame.tau = 0;
  FrameRenderer kept = make_renderer();
  Words words(std::size_t{kWidth} * kHeight);
  ASSERT_TRUE(kept.draw(*model, frame, words, kWidth));
  const std::uint64_t all = kept.stats().triangles;
  for (const SnapshotPtr& next : {cut, model, cut}) {
    const auto rect = kept.draw(*next, frame, words, kWidth);
    ASSERT_TRUE(rect);
    EXPECT_FALSE(rect->empty());
    EXPECT_FALSE(kept.stats().everything);
    EXPECT_LT(kept.stats().tiles_uploaded, 3 * added);
    EXPECT_LT(kept.stats().triangles * 4, all);
  }
}

TEST(CutCage, MostlyAnotherCageIsMadeAnew) {
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  const SnapshotPtr model = ball(2, 8, rough);
  RandomCuts few(model), most(model);
  few.cut(0);
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) most.cut(s);
  detail::DisplayCache cache;
  EXPECT_TRUE(cache.update(*model)->everything);
  EXPECT_FALSE(cache.update(*few.model())->everything);
  EXPECT_TRUE(cache.update(*most.model())->everything);
  EXPECT_TRUE(cache.update(*ball(2, 8, rough, {0.5, 0, 0}))->everything);
}

TEST(CutCage, BuffersDoNotGrowWithTheNumberOfChanges) {
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  const auto start = coloured(ball(2, 16, rough), 16, [](Vec3d) { return Vec3f{0.5F, 0.5F, 0.5F}; });
  // Refined, taken back, refined elsewhere, and grids that become finer and coarser.
  detail::DisplayCache cache;
  std::mt19937 random(9);
  std::uint64_t most = 0;
  for (int k = 0; k < 300; ++k) {
    const SnapshotPtr cut = cut_at_random(start, 1 + static_cast<int>(random() % 8));
    RandomCuts other(start, static_cast<std::uint32_t>(k));
    for (int c = 0; c < 6; ++c) other.cut_one(3);
    const auto s = static_cast<SlabId>(random() % start->slab_mesh().slab_count());
    const auto finer = with_detail(start, {.cuts = {}, .grids = {{Layer::Displacement, s, 128}}});
    ASSERT_TRUE(finer);
    for (const SnapshotPtr& model : {cut, start, other.model(), *finer}) ASSERT_TRUE(cache.update(*model));
    most = std::max(most, cache.gpu_bytes());
  }
  detail::DisplayCache fresh;
  ASSERT_TRUE(fresh.update(*start));
  constexpr std::uint64_t kForNewSlabs = 65536 * 12;  // of a chunk
  EXPECT_LT(most, 2 * fresh.gpu_bytes() + 3 * kForNewSlabs);
}

TEST(CutCage, SlabsBesideAFinerGridAreStitchedToItAlsoWithHoles) {
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  const auto shell = mixed_shell(*sphere_shell(1, 1), 2, 2);
  const auto start = with_hole(displaced(shell, [](Vec3d) { return 0.5; }), [](Vec3d p) { return p.z > 0.9; });
  detail::DisplayCache kept;
  ASSERT_TRUE(kept.update(*start));
  static_cast<void>(kept.detail(0));
  int differing = 0;
  for (SlabId s = 0; s < shell->slab_count(); ++s) {
    if (shell->intervals(s) == 8) continue;
    const auto finer = with_detail(start, {.cuts = {}, .grids = {{Layer::Displacement, s, 8}}});
    ASSERT_TRUE(finer);
    for (const SnapshotPtr& model : {*finer, start}) {
      ASSERT_FALSE(kept.update(*model)->everything);
      detail::DisplayCache fresh;
      ASSERT_TRUE(fresh.update(*model));
      const std::uint64_t triangles = fresh.triangle_count(fresh.detail(0));
      EXPECT_EQ(kept.triangle_count(kept.detail(0)), triangles) << "slab " << s;
      EXPECT_EQ(triangles, tessellate(*model).triangles.size());
    }
    for (int edge = 0; edge < 3; ++edge)
      shell->for_each_across(s, edge, [&](SlabId other) { differing += kept.slabs()[other].holed ? 1 : 0; });
  }
  EXPECT_GT(differing, 2) << "slabs with holes beside one whose grid changed";
}

TEST(CutCage, NewSlabsShareABuffer) {
  auto context = detail::GlContext::create();
  ASSERT_TRUE(context);
  const detail::GlContext::Scope scope(**context);
  RandomCuts cuts(ball(2, 16, rough));
  detail::DisplayCache cache;
  ASSERT_TRUE(cache.update(*cuts.model()));
  cuts.cut(0);
  ASSERT_TRUE(cache.update(*cuts.model()));
  const std::uint64_t after_first = cache.gpu_bytes();
  for (const SlabId s : {10U, 20U, 30U, 40U}) {
    cuts.cut(s);
    ASSERT_FALSE(cache.update(*cuts.model())->everything);
    EXPECT_EQ(cache.gpu_bytes(), after_first);
  }
}

TEST(CutCage, WiresOfCutsAreFainterThanThoseOfRoots) {
  const SnapshotPtr model = displaced(plane_shell(1, 16), [](Vec3d) { return 0.5; });
  RandomCuts cuts(model);
  cuts.cut(0);
  for (const Look::Light light : {Look::Light::Matcap, Look::Light::Studio}) {
    Frame frame = small_frame(framing({{0, 0, 0}, {1, 0, 1}}, 0, 80, 16.0 / 9));
    frame.tau = 0;
    frame.look.light = light;
    frame.look.lights = 6;
    frame.look.ground = false;
    frame.look.cavity = false;
    const auto bare = renderer().picture(*cuts.model(), frame);
    frame.look.slab_wires = true;
    const auto wired = renderer().picture(*cuts.model(), frame), uncut = renderer().picture(*model, frame);
    ASSERT_TRUE(bare && wired && uncut);
    // How much darker the darkest pixel near a point is.
    const auto darker = [&](const Picture& picture, Vec3d p) {
      int most = 0;
      const Place at = project(frame.camera, kWidth, kHeight, p);
      for (int y = -2; y <= 2; ++y)
        for (int x = -2; x <= 2; ++x) {
          const int px = static_cast<int>(at.x) + x, py = static_cast<int>(at.y) + y;
          most = std::max(most, pixel(*bare, px, py)[1] - pixel(picture, px, py)[1]);
        }
      return most;
    };
    const Slab& slab = model->slab_mesh().slabs()[0];
    const int shared = slab.neighbours[0] != kNoSlab ? 0 : slab.neighbours[1] != kNoSlab ? 1 : 2;
    const Vec3d root = sample_position(*model, 0, edge_point(16, shared, 5)),
                inner = sample_position(*model, 0, {8, 4}), away = sample_position(*model, 0, {5, 5});
    EXPECT_GT(darker(*wired, root), 60);
    EXPECT_NEAR(darker(*uncut, root), darker(*wired, root), 12);
    EXPECT_GT(darker(*wired, inner), 15);
    EXPECT_LT(darker(*wired, inner) * 3, darker(*wired, root) * 2);
    EXPECT_LT(darker(*uncut, inner), 5);
    EXPECT_LT(darker(*wired, away), 5);
  }
}

}  // namespace
}  // namespace relief::testing
