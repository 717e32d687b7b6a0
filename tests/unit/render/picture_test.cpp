// What a user sees: shape, colour, place, and that a picture is the same every time.
#include "render_support.h"

#include <png.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace relief::testing {
namespace {

TEST(Picture, SilhouetteOfABallIsTheAnalyticCircle) {
  const auto model = ball(2, 16);
  Camera camera;
  camera.eye = {3, 2, 4};
  DrawSettings settings = small_settings();
  settings.base_colour = {0.9F, 0.1F, 0.1F};
  const Picture picture = draw(*model, camera, settings);
  const double away = length(camera.eye), focal = 90 / std::tan(15 * std::numbers::pi / 180);
  const double radius = focal * std::tan(std::asin(1 / away));
  const Pixel nothing = pixel(picture, 0, 0);
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      const double r = std::hypot(x + 0.5 - 160, y + 0.5 - 90);
      const int d = difference(pixel(picture, x, y), nothing);
      if (r > radius + 1) {
        ASSERT_EQ(d, 0) << x << ' ' << y;
      } else if (r < radius - 1) {
        ASSERT_GT(d, 10) << x << ' ' << y;
      }
    }
}

TEST(Picture, EdgesAreSmooth) {
  const auto model = ball(2, 16);
  DrawSettings settings = small_settings();
  settings.base_colour = {0.95F, 0.95F, 0.95F};
  Camera camera;
  camera.eye = {0, 0, 5};
  const double radius = 90 / std::tan(15 * std::numbers::pi / 180) * std::tan(std::asin(0.2));
  // Of the pixels that the rim runs through, the share that is neither background nor model.
  const auto share_between = [&](int supersample) {
    settings.supersample = supersample;
    const Picture picture = draw(*model, camera, settings);
    const int outside = pixel(picture, 0, 0)[0];
    int rim = 0, between = 0;
    for (int k = 0; k < 360; ++k) {
      const double c = std::cos(k * std::numbers::pi / 180), s = std::sin(k * std::numbers::pi / 180);
      const auto at = [&](double r) {
        return pixel(picture, static_cast<int>(160 + r * c), static_cast<int>(90 - r * s))[0] - outside;
      };
      const double t = double(at(radius)) / at(radius - 3);
      ++rim;
      between += t > 0.2 && t < 0.8 ? 1 : 0;
    }
    return double(between) / rim;
  };
  EXPECT_LT(share_between(1), 0.1);
  EXPECT_GT(share_between(3), 0.3);
}

TEST(Picture, ColoursLandWhereTheyWerePainted) {
  const auto model = coloured(
      ball(), 32, [](Vec3d p) { return Vec3f{p.x > 0 ? 0.9F : 0.1F, p.y > 0 ? 0.9F : 0.1F, p.z > 0 ? 0.9F : 0.1F}; });
  const DrawSettings settings = small_settings();
  for (const double azimuth : {0.0, 90.0, 200.0, 310.0}) {
    const Camera camera = front(16.0 / 9, azimuth, 20);
    const Picture picture = draw(*model, camera, settings);
    const Vec3d back = normalized(camera.eye);
    int seen = 0;
    for (const Vec3d corner :
         {Vec3d{1, 1, 1}, {1, 1, -1}, {1, -1, 1}, {1, -1, -1}, {-1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}}) {
      const Vec3d p = normalized(corner);
      if (dot(p, back) < 0.45) continue;
      ++seen;
      const Pixel c = pixel_at(picture, camera, p);
      const int high = *std::max_element(c.begin(), c.end());
      for (std::size_t k = 0; k < 3; ++k)
        if (corner[k] > 0) {
          EXPECT_GT(c[k], 0.6 * high) << "azimuth " << azimuth << " channel " << k;
        } else if (corner.x > 0 || corner.y > 0 || corner.z > 0) {
          EXPECT_LT(c[k], 0.6 * high) << "azimuth " << azimuth << " channel " << k;
        }
    }
    EXPECT_GE(seen, 1);
  }
}

TEST(Picture, TheBaseColourServesWhereThereIsNoColour) {
  DrawSettings settings = small_settings();
  settings.base_colour = {0.2F, 0.3F, 0.9F};
  const Pixel c = pixel(draw(*ball(), front(), settings), 160, 90);
  EXPECT_GT(c[2], c[0] + 40);
  EXPECT_GT(c[2], c[1] + 40);
}

TEST(Picture, LightComesFromAboveAndShadowsLieOnTheFloor) {
  DrawSettings settings = small_settings();
  settings.lights = 24;
  settings.ground = true;
  const Camera camera = framing({{-1.5, -1, -1.5}, {1.5, 1, 1.5}}, 0, 15, 16.0 / 9);
  const Picture picture = draw(*ball(), camera, settings);
  const auto bright = [&](Vec3d p) {
    const Pixel c = pixel_at(picture, camera, p);
    return c[0] + c[1] + c[2];
  };
  EXPECT_GT(bright(normalized(Vec3d{-0.3, 0.6, 0.7})), bright(normalized(Vec3d{0.2, -0.6, 0.75})) + 60);
  // The floor right under the ball's front is darker than far away at its left.
  EXPECT_LT(bright({0.3, -1, 0.5}) + 60, bright({-2, -1, 1}));
}

/// A floor at y = 0 and a wall at z = 0, from x = -9 to 9, two slabs each.
SnapshotPtr floor_and_wall() {
  std::vector<Fibre> fibres;
  for (const double x : {-9.0, 9.0}) {
    fibres.push_back({{x, -0.1, -0.1}, {x, 0.1, 0.1}});
    fibres.push_back({{x, -0.1, 3}, {x, 0.1, 3}});
    fibres.push_back({{x, 3, -0.1}, {x, 3, 0.1}});
  }
  constexpr int kIntervals = 8;
  std::vector<SlabMesh::Face> faces;
  for (const std::array<FibreId, 3> f : {std::array<FibreId, 3>{0, 1, 4}, {0, 4, 3}, {0, 3, 5}, {0, 5, 2}})
    faces.push_back({f, kIntervals});
  auto mesh = SlabMesh::make(std::move(fibres), faces);
  return displaced(std::make_shared<const SlabMesh>(*std::move(mesh)), [](Vec3d) { return 0.5; });
}

// Near an edge like theirs, look-ups around a pixel lie beyond the other face, in its shadow. As the scene goes on to
// both sides, what a row shows changes slowly.
TEST(Picture, InAHollowEdgeTheShadowIsEven) {
  DrawSettings settings = small_settings();
  settings.lights = 64;
  Camera camera;
  camera.target = {0, 0, 0};
  camera.eye = {0, 0.2, 0.4};
  const Picture picture = draw(*floor_and_wall(), camera, settings);
  int most = 0, darkest = 255, brightest = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x + 1 < picture.width; ++x) {
      most = std::max(most, difference(pixel(picture, x, y), pixel(picture, x + 1, y)));
      darkest = std::min(darkest, pixel(picture, x, y)[1]);
      brightest = std::max(brightest, pixel(picture, x, y)[1]);
    }
  EXPECT_LT(most, 12);
  EXPECT_GT(brightest, darkest + 30) << "there is shadow in the edge";
}

TEST(Picture, IsTheSameTwiceAndFromAnotherRenderer) {
  const auto model = coloured(ball(), 8, [](Vec3d p) { return Vec3f{float(0.5 + 0.4 * p.x), 0.5F, 0.3F}; });
  DrawSettings settings = small_settings();
  settings.ground = true;
  const Picture first = draw(*model, front(), settings);
  EXPECT_EQ(first.rgb, draw(*model, front(), settings).rgb);
  auto other = FrameRenderer::create();
  ASSERT_TRUE(other) << other.error().message;
  const auto again = try_draw(*other, *model, front(), settings);
  ASSERT_TRUE(again);
  EXPECT_EQ(first.rgb, again->rgb);
}

TEST(Picture, FarFromTheOriginItIsTheSame) {
  const auto bump = [](Vec3d d) { return 0.02 * std::sin(20 * d.x) * std::cos(17 * d.y); };
  const Vec3d far = {1e6, -2e6, 3e6};
  const DrawSettings settings = small_settings();
  const Camera camera = front(16.0 / 9, 30, 20);
  Camera moved = camera;
  moved.eye += far;
  moved.target += far;
  EXPECT_GT(psnr(draw(*ball(2, 16, bump), camera, settings), draw(*ball(2, 16, bump, far), moved, settings)), 42);
}

/// A frame in light for sculpting, without the gradient.
Picture sculpt(const Snapshot& model, const Camera& camera, const DrawSettings& settings) {
  Frame frame = settings.frame(camera);
  frame.samples = 1;
  frame.look.light = Look::Light::Matcap;
  frame.look.legend = false;
  frame.look.top = frame.look.bottom = {0.4F, 0.4F, 0.4F};
  auto picture = renderer().picture(model, frame);
  if (!picture) {
    ADD_FAILURE() << picture.error().message;
    return Picture{1, 1, {0, 0, 0}};
  }
  return *std::move(picture);
}

TEST(Legend, LeavesFreeWhatItIsToldTo) {
  const auto model = ball(2, 16, [](Vec3d d) { return 0.05 * std::sin(9 * d.x); });
  Frame frame = small_settings().frame(front());
  frame.samples = 1;
  frame.look.light = Look::Light::Matcap;
  frame.look.map = Look::Map::Displacement;
  const auto with = [&](bool legend, int left) {
    frame.look.legend = legend;
    frame.look.legend_left = left;
    auto picture = renderer().picture(*model, frame);
    EXPECT_TRUE(picture);
    return picture ? *std::move(picture) : Picture{1, 1, {0, 0, 0}};
  };
  const Picture without = with(false, 0);
  /// The first column that the legend changes.
  const auto first = [&](const Picture& picture) {
    for (int x = 0; x < picture.width; ++x)
      for (int y = 0; y < picture.height; ++y)
        if (pixel(picture, x, y) != pixel(without, x, y)) return x;
    return picture.width;
  };
  const int usual = first(with(true, 0));
  EXPECT_LT(usual, 20);
  EXPECT_EQ(first(with(true, 64)), usual + 64);
}

TEST(Sculpting, ShowsTheSameShapeAsThePicture) {
  const auto model = ball(2, 16, [](Vec3d d) { return 0.05 * std::sin(9 * d.x); });
  DrawSettings settings = small_settings();
  settings.supersample = 1;
  settings.base_colour = {0.9F, 0.2F, 0.2F};
  const Picture full = draw(*model, front(), settings), frame = sculpt(*model, front(), settings);
  const Pixel nothing = pixel(full, 0, 0), behind = pixel(frame, 0, 0);
  int covered = 0, differ = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) {
      const bool in_full = difference(pixel(full, x, y), nothing) > 0;
      covered += in_full ? 1 : 0;
      differ += in_full != (difference(pixel(frame, x, y), behind) > 0) ? 1 : 0;
    }
  EXPECT_GT(covered, 3000);
  // The two are turned over against each other, so a rim may fall on either side of a pixel's middle.
  EXPECT_LE(differ, 4);
}

/// A ball with a colour and a dent, in triangles of about the given number of pixels.
SnapshotPtr coloured_ball(int n) {
  return coloured(ball(2, n, [](Vec3d d) { return 0.03 * std::sin(7 * d.x + 5 * d.y); }), 16,
                  [](Vec3d p) { return Vec3f{p.x > 0 ? 0.8F : 0.3F, 0.5F, p.y > 0 ? 0.7F : 0.3F}; });
}

TEST(Sculpting, LargeAndSmallTrianglesAreLitAlike) {
  const DrawSettings settings = small_settings();
  DrawSettings large = settings;
  large.width *= 4;
  large.height *= 4;
  const auto model = coloured_ball(16);
  const Camera camera = framing(*model, 30, 15, 16.0 / 9);
  const Picture at_corners = sculpt(*model, camera, settings), at_pixels = sculpt(*model, camera, large);
  double sum = 0;
  for (int y = 0; y < 180; ++y)
    for (int x = 0; x < 320; ++x) sum += difference(pixel(at_corners, x, y), pixel(at_pixels, 4 * x + 2, 4 * y + 2));
  EXPECT_LT(sum / (320 * 180), 3);
}

TEST(Maps, DepthShowsWhereTheFibresEnd) {
  const auto model = ball(2, 16, [](Vec3d d) { return std::clamp(0.4 * d.x, -0.3, 0.3); });
  DrawSettings settings = small_settings();
  settings.map = Look::Map::Depth;
  for (const bool full : {true, false}) {
    const Camera camera = framing(*model, 0, 0, 16.0 / 9);
    const Picture picture = full ? draw(*model, camera, settings) : sculpt(*model, camera, settings);
    // Cividis: blue where there is none left, yellow half way.
    const auto yellow = [&](Vec3d way) {
      const Vec3d at = normalized(way) * (1 + std::clamp(0.4 * normalized(way).x, -0.2, 0.2));
      const Pixel c = pixel_at(picture, camera, at);
      return c[0] - c[2];
    };
    EXPECT_LT(yellow({-0.8, 0.05, 0.6}), 0) << full;
    EXPECT_LT(yellow({0.8, 0.05, 0.6}), 0) << full;
    EXPECT_GT(yellow({0, 0.1, 1}), 50) << full;
  }
}

TEST(Sculpting, OverlaysLieWhereTheyLieInThePicture) {
  const auto model = coloured_ball(16);
  const Camera camera = framing(*model, 20, 15, 16.0 / 9);
  DrawSettings wires = small_settings(), map = wires;
  wires.slab_wires = true;
  map.map = Look::Map::Slabs;
  for (const DrawSettings& overlay : {wires, map}) {
    const auto changed = [&](const Picture& with, const Picture& without) {
      std::vector<bool> mask;
      for (int y = 0; y < 180; ++y)
        for (int x = 0; x < 320; ++x) mask.push_back(difference(pixel(with, x, y), pixel(without, x, y)) > 40);
      return mask;
    };
    const std::vector<bool> full = changed(draw(*model, camera, overlay), draw(*model, camera, small_settings()));
    const std::vector<bool> seen = changed(sculpt(*model, camera, overlay), sculpt(*model, camera, small_settings()));
    int both = 0, either = 0;
    for (std::size_t k = 0; k < full.size(); ++k) {
      both += full[k] && seen[k] ? 1 : 0;
      either += full[k] || seen[k] ? 1 : 0;
    }
    EXPECT_GT(either, 500);
    EXPECT_GT(both, 0.6 * either) << overlay.slab_wires;
  }
}

TEST(Sculpting, AnOpenSheetIsSeenFromBothSides) {
  const auto sheet = displaced(plane_shell(2, 8), [](Vec3d) { return 0.5; });
  DrawSettings settings = small_settings();
  settings.base_colour = {0.9F, 0.2F, 0.2F};
  const Box3d box = surface_bounds(*sheet);
  for (const double elevation : {60.0, -60.0}) {
    const Camera camera = framing(box, 0, elevation, 16.0 / 9);
    const Pixel c = pixel_at(sculpt(*sheet, camera, settings), camera, box.centre());
    EXPECT_GT(c[0], c[1] + 30) << elevation;
  }
}

TEST(Sculpting, IsTheSameTwice) {
  const auto model = coloured_ball(16);
  DrawSettings settings = small_settings();
  settings.ground = true;
  const Picture first = sculpt(*model, front(), settings);
  settings.slab_wires = true;
  sculpt(*model, front(), settings);
  settings.slab_wires = false;
  EXPECT_EQ(first.rgb, sculpt(*model, front(), settings).rgb);
}

TEST(Framing, FillsThePictureWithTheSurfaceItself) {
  // Long, bent and far from the origin, in a shell much larger than itself.
  const Vec3d centre = {100, 200, -300};
  for (const int n : {1, 5, 15, 32}) {
    const auto model = ball(2, n, [](Vec3d d) { return 0.15 * d.x - 0.1 * d.y * d.y; }, centre);
    for (const double aspect : {0.4, 1.0, 1.78, 4.0})
      for (const double azimuth : {0.0, 35.0, 200.0})
        for (const double elevation : {-60.0, 15.0, 90.0})
          for (const Vec3d up : {Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
            const Camera camera = framing(*model, azimuth, elevation, aspect, up);
            Box3d seen;
            for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s)
              for (int j = 0; j <= n; ++j)
                for (int i = 0; i + j <= n; ++i) {
                  const Place at =
                      project(camera, static_cast<int>(10000 * aspect), 10000, sample_position(*model, s, {i, j}));
                  seen.add(Vec3d{at.x / (5000 * aspect) - 1, at.y / 5000 - 1, 0});
                }
            const Vec3d size = seen.high - seen.low;
            EXPECT_NEAR(std::max(size.x, size.y), 2 / 1.08, 0.02) << aspect << ' ' << azimuth << ' ' << elevation;
            EXPECT_NEAR(size.x > size.y ? seen.low.x + seen.high.x : seen.low.y + seen.high.y, 0, 0.02);
            EXPECT_LT(std::max({-seen.low.x, -seen.low.y, seen.high.x, seen.high.y}), 0.95);
          }
  }
}

TEST(Framing, SeesTheWholeBox) {
  const Box3d box = {{-3, 1, 10}, {5, 2, 30}};
  for (const double aspect : {0.4, 1.0, 1.78, 4.0})
    for (const double azimuth : {0.0, 35.0, 90.0, 200.0})
      for (const double elevation : {-60.0, 0.0, 25.0, 90.0})
        for (const Vec3d up : {Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}) {
          const Camera camera = framing(box, azimuth, elevation, aspect, up);
          double outermost = 0;
          for (unsigned k = 0; k < 8; ++k) {
            const Vec3d p = {(k & 1U) != 0 ? 5.0 : -3.0, (k & 2U) != 0 ? 2.0 : 1.0, (k & 4U) != 0 ? 30.0 : 10.0};
            const Place at = project(camera, static_cast<int>(1000 * aspect), 1000, p);
            outermost = std::max({outermost, std::abs(at.x / (500 * aspect) - 1), std::abs(at.y / 500 - 1)});
          }
          EXPECT_LE(outermost, 1.0) << aspect << ' ' << azimuth << ' ' << elevation;
          EXPECT_GT(outermost, 0.85) << aspect << ' ' << azimuth << ' ' << elevation;
        }
}

TEST(Framing, AzimuthCountsFromZToX) {
  const Box3d box = {{-1, -1, -1}, {1, 1, 1}};
  EXPECT_GT(framing(box, 0, 0, 1).eye.z, 3);
  EXPECT_GT(framing(box, 90, 0, 1).eye.x, 3);
  EXPECT_GT(framing(box, 0, 90, 1).eye.y, 3);
  EXPECT_LT(framing(box, 0, 0, 1, {0, 0, 1}).eye.y, -3);
  EXPECT_GT(framing(box, 90, 0, 1, {0, 0, 1}).eye.x, 3);
}

TEST(LookingAt, HasThePointInTheMiddleAndTheWidthAcross) {
  const Box3d box = {{-3, 1, 10}, {5, 2, 30}};
  for (const Vec3d point : {Vec3d{1, 1.5, 20}, Vec3d{-3, 2, 10}, Vec3d{40, 0, 0}})
    for (const double width : {1e-3, 0.5, 20.0, 500.0})
      for (const double aspect : {0.4, 1.78})
        for (const double azimuth : {0.0, 35.0, 200.0})
          for (const double elevation : {-60.0, 0.0, 89.9}) {
            const Camera camera = looking_at(point, width, box, azimuth, elevation, aspect);
            const Vec3d forward = normalized(camera.target - camera.eye), right = normalized(cross(forward, camera.up));
            const int high = 1000, wide = static_cast<int>(high * aspect);
            const auto at = [&](Vec3d p) { return project(camera, wide, high, p); };
            EXPECT_NEAR(at(point).x, 0.5 * wide, 1e-6);
            EXPECT_NEAR(at(point).y, 0.5 * high, 1e-6);
            EXPECT_NEAR(at(point - right * (0.5 * width)).x, 0, 1e-6 * wide);
            EXPECT_NEAR(at(point + right * (0.5 * width)).x, wide, 1e-6 * wide);
            EXPECT_LE(camera.field_of_view, 30 + 1e-9);
            for (unsigned k = 0; k < 8; ++k) {
              const Vec3d corner = {(k & 1U) != 0 ? 5.0 : -3.0, (k & 2U) != 0 ? 2.0 : 1.0, (k & 4U) != 0 ? 30.0 : 10.0};
              EXPECT_GT(dot(corner - camera.eye, forward), 0) << "the eye is in the box";
            }
          }
}

TEST(LookingAt, ABallIsAsWideInThePictureAsItMustBe) {
  const Vec3d centre = {10, -20, 5};
  const auto model = ball(3, 16, [](Vec3d) { return 0; }, centre);
  DrawSettings settings = small_settings();
  settings.base_colour = {0.9F, 0.1F, 0.1F};
  const double aspect = static_cast<double>(settings.width) / settings.height;
  for (const double width : {3.0, 6.0}) {
    const Camera camera = looking_at(centre, width, model->slab_mesh().bounds(), 20, 10, aspect);
    const Picture picture = sculpt(*model, camera, settings);
    // Along the middle row the ball is red, and what is behind it is grey.
    const auto red = [&](int x) {
      const Pixel p = pixel(picture, x, picture.height / 2);
      return p[0] - p[2] > 20;
    };
    int left = 0, right = picture.width - 1;
    while (left < right && !red(left)) ++left;
    while (left < right && !red(right)) --right;
    // What is seen of a ball of radius 1 from so far away is a little nearer than its middle.
    const double away = length(camera.eye - centre), seen = 2 * away / std::sqrt(away * away - 1);
    EXPECT_NEAR(right - left + 1, seen / width * picture.width, 2.5) << width;
    EXPECT_NEAR(left + right + 1, picture.width, 2.5) << width;
  }
}

TEST(Framing, SurfaceBoundsHoldTheSurfaceTightly) {
  const Box3d box = surface_bounds(*ball(2, 16, {5, 6, 7}));
  EXPECT_NEAR(box.low.x, 4, 1e-6);
  EXPECT_NEAR(box.high.y, 7, 1e-6);
  EXPECT_NEAR(box.high.z, 8, 1e-6);
}

class PngFile : public ::testing::Test {
 protected:
  PngFile() { std::filesystem::create_directories(folder); }
  ~PngFile() override { std::filesystem::remove_all(folder); }
  const std::filesystem::path folder =
      std::filesystem::path(::testing::TempDir()) / ("relief-png-" + std::to_string(::getpid()));
};

TEST_F(PngFile, ReadsBackWhatWasSaved) {
  const Picture picture{3, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 1, 2, 3, 4, 5, 6, 7, 8, 9}};
  const std::filesystem::path file = folder / "a b.png";
  ASSERT_TRUE(save_png(picture, file));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&image, file.c_str()), 0);
  EXPECT_EQ(image.width, 3U);
  EXPECT_EQ(image.height, 2U);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> back(PNG_IMAGE_SIZE(image));
  ASSERT_NE(png_image_finish_read(&image, nullptr, back.data(), 0, nullptr), 0);
  EXPECT_EQ(back, picture.rgb);
}

TEST_F(PngFile, CancelledIsNoFile) {
  const Picture picture{2, 1, {1, 2, 3, 4, 5, 6}};
  std::atomic<bool> cancel = false;
  const std::filesystem::path file = folder / "stays.png";
  ASSERT_TRUE(save_png(picture, file, &cancel));
  cancel = true;
  const Status cancelled = save_png(picture, folder / "gone.png", &cancel);
  ASSERT_FALSE(cancelled);
  EXPECT_EQ(cancelled.error().code, Errc::Cancelled);
  std::filesystem::remove(file);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(PngFile, SaysWhichFileItCannotWriteAndLeavesNothing) {
  const Picture picture{1, 1, {1, 2, 3}};
  const Status missing = save_png(picture, folder / "no" / "where.png");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::Io);
  EXPECT_NE(missing.error().message.find("where.png"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

}  // namespace
}  // namespace relief::testing
