// Settings and machines that cannot give a picture say so; odd views give one all the same.
#include "render_support.h"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <thread>

namespace relief::testing {
namespace {

TEST(Limits, WrongSettingsAreNamed) {
  const auto model = ball(1, 4);
  const auto refused = [&](auto&& change, std::string_view word) {
    DrawSettings settings = small_settings();
    Camera camera = front();
    change(settings, camera);
    const auto picture = try_draw(renderer(), *model, camera, settings);
    ASSERT_FALSE(picture) << word;
    EXPECT_EQ(picture.error().code, Errc::InvalidArgument);
    EXPECT_NE(picture.error().message.find(word), std::string::npos) << picture.error().message;
    EXPECT_FALSE(renderer().coverage(*model, settings.frame(camera)));
  };
  refused([](DrawSettings& s, Camera&) { s.width = 0; }, "8192");
  refused([](DrawSettings& s, Camera&) { s.height = 8193; }, "8193");
  refused([](DrawSettings& s, Camera&) { s.supersample = 5; }, "samples");
  refused([](DrawSettings& s, Camera&) { s.lights = 0; }, "lights");
  refused([](DrawSettings& s, Camera&) { s.lights = 257; }, "lights");
  refused([](DrawSettings& s, Camera&) { s.level = -1; }, "level");
  refused([](DrawSettings&, Camera& c) { c.eye.x = std::numeric_limits<double>::quiet_NaN(); }, "camera");
  refused([](DrawSettings&, Camera& c) { c.eye = c.target; }, "camera");
  refused([](DrawSettings&, Camera& c) { c.up = {}; }, "camera");
  refused([](DrawSettings&, Camera& c) { c.field_of_view = 180; }, "field of view");
  refused(
      [](DrawSettings&, Camera& c) {
        c.parallel = true;
        c.view_height = 0;
      },
      "view height");
  refused(
      [](DrawSettings& s, Camera&) {
        s.hand = HandOverlay{};
        s.hand->force.x = std::numeric_limits<double>::infinity();
      },
      "force");
}

TEST(Limits, OddViewsGiveAPicture) {
  const auto model = ball(1, 4);
  DrawSettings settings = small_settings();
  settings.ground = true;
  settings.lights = 9;
  Camera above = front();
  above.eye = {0, 5, 0};
  Camera inside = front();
  inside.eye = {0, 0, 0.1};
  Camera away = front();
  away.target = away.eye * 2;
  for (const Camera& camera : {above, inside, away, front(16.0 / 9, 0, -90)}) draw(*model, camera, settings);
  settings.width = settings.height = 1;
  draw(*model, above, settings);
  const auto sheet = displaced(plane_shell(2, 4), [](Vec3d) { return 0.5; });
  draw(*sheet, front(), settings);
}

TEST(Limits, APictureInPartsHasNoSeam) {
  // At four sub-pixels an edge, 2200 pixels are more than one part holds; the ball lies over the border at 2048.
  const auto model = ball(2, 16);
  DrawSettings settings = small_settings();
  settings.width = 2200;
  settings.height = 48;
  settings.lights = 3;
  settings.ground = true;
  Camera camera;
  camera.eye = {0, 0, 5};
  const double focal = 24 / std::tan(15 * std::numbers::pi / 180);
  camera.target = camera.eye;
  camera.eye.x = -(2048.0 - 1100) / focal * 5;
  camera.target = camera.eye - Vec3d{0, 0, 5};
  settings.supersample = 4;
  const Picture parts = draw(*model, camera, settings);
  settings.supersample = 3;
  const Picture whole = draw(*model, camera, settings);
  EXPECT_GT(psnr(parts, whole), 38);
  int covered = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 2046; x < 2050; ++x) {
      EXPECT_LE(difference(pixel(parts, x, y), pixel(whole, x, y)), 30) << x << ' ' << y;
      covered += difference(pixel(parts, x, y), pixel(parts, 1500, y)) > 20 ? 1 : 0;
    }
  EXPECT_GT(covered, 30);
}

TEST(Cancel, APictureThatIsNotCancelledIsTheSame) {
  DrawSettings settings = small_settings();
  settings.width = 1000;
  settings.height = 600;
  settings.ground = true;
  settings.lights = 9;
  settings.hand = HandOverlay{
      .cursor = {0, 0, 0.97}, .contact_point = {0, 0, 1}, .force = {0, 0, 2}, .tool_radius = 0.2, .contact = true};
  // More triangles than are drawn between two questions.
  const auto model = ball(3, 32);
  const Picture expected = draw(*model, front(), settings);
  const std::atomic<bool> cancel = false;
  settings.cancel = &cancel;
  EXPECT_EQ(draw(*model, front(), settings).rgb, expected.rgb);
}

TEST(Cancel, EndsAPictureAndTheNextOneIsWhole) {
  auto made = FrameRenderer::create();
  ASSERT_TRUE(made);
  const auto model = ball(3, 32);
  DrawSettings settings = small_settings();
  settings.ground = true;
  const Picture expected = draw(*model, front(), settings);
  // Before the first tile, then at whatever the renderer is doing: the picture would take minutes.
  DrawSettings large = settings;
  large.width = large.height = 8192;
  large.supersample = 4;
  large.lights = 256;
  for (const int wait : {0, 30, 300, 900}) {
    std::atomic<bool> cancel = wait == 0;
    large.cancel = &cancel;
    std::jthread other([&] {
      std::this_thread::sleep_for(std::chrono::milliseconds(wait));
      cancel = true;
    });
    const auto picture = try_draw(*made, *model, front(1), large);
    ASSERT_FALSE(picture) << wait;
    EXPECT_EQ(picture.error().code, Errc::Cancelled) << picture.error().message;
    const auto next = try_draw(*made, *model, front(), settings);
    ASSERT_TRUE(next) << next.error().message;
    EXPECT_EQ(next->rgb, expected.rgb) << wait;
  }
}

TEST(Limits, SeveralRenderersWorkSideBySide) {
  const auto a = ball(1, 8), b = ball(2, 8);
  const DrawSettings settings = small_settings();
  const Picture expected = draw(*a, front(), settings);
  for (int round = 0; round < 3; ++round) {
    auto one = FrameRenderer::create(), two = FrameRenderer::create();
    ASSERT_TRUE(one && two);
    EXPECT_FALSE(one->device().empty());
    ASSERT_TRUE(try_draw(*two, *b, front(), settings));
    EXPECT_EQ(try_draw(*one, *a, front(), settings)->rgb, expected.rgb);
    *one = *std::move(two);
    EXPECT_EQ(try_draw(*one, *a, front(), settings)->rgb, expected.rgb);
  }
}

TEST(LimitsDeathTest, WithoutADriverThePackageIsNamed) {
  ::testing::GTEST_FLAG(death_test_style) = "threadsafe";
  EXPECT_EXIT(
      {
        ::setenv("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent", 1);
        ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent", 1);
        const auto made = FrameRenderer::create();
        if (made) std::exit(2);
        std::fprintf(stderr, "%s\n", made.error().message.c_str());
        std::exit(made.error().code == Errc::Io ? 0 : 3);
      },
      ::testing::ExitedWithCode(0), "install the package lib(gl1-mesa-dri|egl1)");
}

}  // namespace
}  // namespace relief::testing
