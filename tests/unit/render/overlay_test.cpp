// What is drawn over the model is where it must be, and nowhere else.
#include "render_support.h"

#include <relief/render/overlay.h>

namespace relief::testing {
namespace {

bool reddish(Pixel c) { return c[0] > 60 && c[0] > 2 * c[1] && c[0] > 2 * c[2]; }
bool greenish(Pixel c) { return c[1] > 60 && 3 * c[1] > 4 * c[0] && 3 * c[1] > 4 * c[2]; }

template <typename Which>
int count(const Picture& p, Which&& which) {
  int found = 0;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) found += which(pixel(p, x, y)) ? 1 : 0;
  return found;
}

TEST(SlabWires, FollowTheEdgesOfTheSlabs) {
  const auto model = ball(2, 16);
  DrawSettings settings = small_settings();
  settings.width = 640;
  settings.height = 360;
  const Camera camera = front(16.0 / 9, 10, 15);
  const Picture without = draw(*model, camera, settings);
  settings.slab_wires = true;
  const Picture with = draw(*model, camera, settings);
  const Vec3d towards = normalized(camera.eye);
  int edges = 0, middles = 0;
  for (SlabId s = 0; s < model->slab_mesh().slab_count(); ++s) {
    const Vec3d edge = sample_position(*model, s, edge_point(16, 0, 8)), middle = sample_position(*model, s, {5, 5});
    if (dot(normalized(middle), towards) < 0.7) continue;
    ++edges, ++middles;
    EXPECT_GT(difference(pixel_at(with, camera, edge), pixel_at(without, camera, edge)), 25) << "slab " << s;
    EXPECT_EQ(difference(pixel_at(with, camera, middle), pixel_at(without, camera, middle)), 0) << "slab " << s;
  }
  EXPECT_GT(edges, 10);
}

TEST(Maps, GoFromBlueToOrangeAndHaveALegend) {
  const auto model = ball(2, 16, [](Vec3d d) { return 0.15 * d.x; });
  DrawSettings settings = small_settings();
  settings.height = 360;
  settings.width = 640;
  settings.map = Look::Map::Displacement;
  const Camera camera = front();
  const Picture picture = draw(*model, camera, settings);
  const Pixel low = pixel_at(picture, camera, normalized(Vec3d{-0.8, 0.1, 0.6}) * 0.88);
  const Pixel high = pixel_at(picture, camera, normalized(Vec3d{0.9, 0.1, 0.4}) * 1.13);
  EXPECT_GT(low[2], low[0] + 30);
  EXPECT_GT(high[0], high[2] + 30);
  // The scale stands in the lower left corner, orange above blue, with words in ink to its right.
  int orange = 1000, blue = -1, ink = 0;
  for (int y = 180; y < 360; ++y) {
    const Pixel bar = pixel(picture, 22, y);
    if (bar[0] > bar[2] + 60) orange = std::min(orange, y);
    if (bar[2] > bar[0] + 60) blue = std::max(blue, y);
    for (int x = 30; x < 100; ++x) ink += pixel(picture, x, y)[1] > 190 ? 1 : 0;
  }
  EXPECT_LT(orange + 100, blue);
  EXPECT_GT(ink, 50);
}

HandOverlay touching_front() {
  HandOverlay hand;
  hand.cursor = {0, 0, 0.97};
  hand.contact_point = {0, 0, 1};
  hand.force = {0, 2, 0};
  hand.tool_radius = 0.2;
  hand.contact = true;
  return hand;
}

TEST(Hand, ShowsCursorRingToolAndForce) {
  const auto model = ball();
  DrawSettings settings = small_settings();
  settings.width = 640;
  settings.height = 360;
  const Camera camera = front();
  const Picture without = draw(*model, camera, settings);
  HandOverlay hand = touching_front();
  settings.hand = hand;
  const Picture with = draw(*model, camera, settings);
  // The arrow is 2 / 3.3 of a fifth of what the camera sees at that distance.
  const double view = 2 * (camera.eye.z - 0.97) * std::tan(15 * std::numbers::pi / 180), size = 0.2 * view * 2 / 3.3;
  EXPECT_TRUE(greenish(pixel_at(with, camera, {0, 0.6 * size, 1})));
  EXPECT_FALSE(greenish(pixel_at(with, camera, {0, 1.2 * size, 1})));
  EXPECT_FALSE(greenish(pixel_at(with, camera, {0, -0.5 * size, 1})));
  // The ring of the contact, a tool radius around the surface contact point.
  const Vec3d on_ring = normalized(Vec3d{-0.2, 0, 0.98});
  const Pixel ring = pixel_at(with, camera, on_ring);
  EXPECT_GT(ring[0], ring[2] + 50);
  EXPECT_GT(difference(ring, pixel_at(without, camera, on_ring)), 40);
  // Far from the hand nothing changes but its shadow, which is small.
  EXPECT_LE(difference(pixel_at(with, camera, {-0.8, -0.3, 0.5}), pixel_at(without, camera, {-0.8, -0.3, 0.5})), 4);

  hand.contact = false;
  hand.cursor = {0, 0, 1.4};
  hand.force = {};
  hand.tool_radius = 0;
  settings.hand = hand;
  const Picture free = draw(*model, camera, settings);
  EXPECT_TRUE(reddish(pixel_at(free, camera, hand.cursor)));
  EXPECT_EQ(count(free, greenish), 0);
}

TEST(Hand, TheStylusStandsOutsideTheSurfaceAndClearOfTheForce) {
  const detail::Eye eye{.at = {0, 0, 5}, .right = {1, 0, 0}, .up = {0, 1, 0}, .forward = {0, 0, -1}};
  const Vec3d to_eye = {0, 0, 1};
  const auto in_picture = [](Vec3d d) { return std::hypot(d.x, d.y); };
  for (int azimuth = 0; azimuth < 360; azimuth += 5)
    for (int off = 0; off <= 180; off += 5) {
      const double a = azimuth * std::numbers::pi / 180, t = off * std::numbers::pi / 180;
      const Vec3d out = {std::sin(t) * std::cos(a), std::sin(t) * std::sin(a), std::cos(t)};
      const Vec3d lean = detail::stylus_lean(out, eye, to_eye);
      EXPECT_NEAR(length(lean), 1, 1e-9);
      EXPECT_GT(dot(lean, out), 0.6) << azimuth << ' ' << off;
      if (off > 110) continue;
      EXPECT_GT(in_picture(lean), 0.5) << azimuth << ' ' << off;
      if (in_picture(out) < 0.4) continue;
      EXPECT_LT(lean.x * out.x + lean.y * out.y, 0.85 * in_picture(lean) * in_picture(out)) << azimuth << ' ' << off;
    }
}

TEST(Hand, StylusAndForceAreSeenWhereverTheSurfaceIsTouched) {
  const auto model = ball();
  DrawSettings settings = small_settings();
  settings.width = 640;
  settings.height = 360;
  Camera camera = front();
  camera.eye = camera.eye * 1.5;  // room for the stylus all around
  const auto dark = [](Pixel c) { return *std::max_element(c.begin(), c.end()) < 75; };
  const int without = count(draw(*model, camera, settings), dark);
  // To the left, the right, above and below, the rim's surface faces across the way the eye looks.
  for (const Vec3d out :
       {Vec3d{-1, 0, 0.2}, {1, 0, 0.2}, {0, 1, 0.2}, {0, -1, 0.2}, {0.88, 0.46, 0.2}, {-0.88, -0.46, 0.2}, {0, 0, 1}}) {
    HandOverlay hand;
    hand.contact_point = normalized(out);
    hand.cursor = hand.contact_point * 0.98;
    hand.force = hand.contact_point * 3.3;
    hand.contact = true;
    settings.hand = hand;
    const Picture picture = draw(*model, camera, settings);
    EXPECT_GT(count(picture, greenish), 60) << out.x << ' ' << out.y;
    EXPECT_GT(count(picture, dark) - without, 700) << out.x << ' ' << out.y;
    // A weak force is still seen beside the tip.
    settings.hand->force = hand.contact_point * 0.05;
    EXPECT_GT(count(draw(*model, camera, settings), greenish), 20) << out.x << ' ' << out.y;
  }
}

TEST(Hand, IsFaintBehindTheModel) {
  const auto model = ball();
  DrawSettings settings = small_settings();
  const Camera camera = front();
  const Picture without = draw(*model, camera, settings);
  HandOverlay hand;
  hand.cursor = {0.1, 0, -1.3};
  settings.hand = hand;
  const Picture behind = draw(*model, camera, settings);
  const Pixel a = pixel_at(without, camera, hand.cursor), b = pixel_at(behind, camera, hand.cursor);
  EXPECT_GT(difference(a, b), 8);
  EXPECT_LT(difference(a, b), 110);
  EXPECT_FALSE(reddish(b));
  hand.cursor = {0.1, 0, 1.3};
  settings.hand = hand;
  EXPECT_TRUE(reddish(pixel_at(draw(*model, camera, settings), camera, hand.cursor)));
}

TEST(Hand, TheArrowEndsAtAFifthOfThePicture) {
  const auto model = ball();
  DrawSettings settings = small_settings();
  HandOverlay hand = touching_front();
  const auto green_with = [&](double newtons) {
    hand.force = {0, newtons, 0};
    settings.hand = hand;
    return count(draw(*model, front(), settings), greenish);
  };
  const int half = green_with(1.65), full = green_with(3.3);
  EXPECT_GT(half, 10);
  EXPECT_GT(full, half);
  EXPECT_EQ(full, green_with(33));
}

}  // namespace
}  // namespace relief::testing
