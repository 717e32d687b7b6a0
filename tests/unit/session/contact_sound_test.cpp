#include "support/shells.h"

#include <relief/session/contact_sound.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <span>
#include <thread>
#include <vector>

namespace relief {
namespace {

constexpr std::size_t kTick = ContactSound::kPerTick;

SoundTick sliding(float slip, float force) { return {.contact = true, .carving = false, .slip = slip, .force = force}; }

/// What a sound makes of so many of the tick.
std::vector<float> after(ContactSound& sound, const SoundTick& tick, int count) {
  std::vector<float> samples(kTick * static_cast<std::size_t>(count));
  for (int k = 0; k < count; ++k) {
    sound.tick(tick);
    sound.render(std::span(samples).subspan(kTick * static_cast<std::size_t>(k), kTick));
  }
  return samples;
}

double loudness(std::span<const float> samples) {
  double sum = 0;
  for (const float s : samples) sum += double{s} * double{s};
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

double largest(std::span<const float> samples) {
  double most = 0;
  for (const float s : samples) most = std::max(most, std::abs(double{s}));
  return most;
}

/// RMS after it has settled.
double steady(const SoundTick& tick) {
  ContactSound sound;
  after(sound, tick, 100);
  return loudness(after(sound, tick, 400));
}

TEST(ContactSound, IsSilentWithoutContactAndWhereNothingSlides) {
  ContactSound sound;
  std::vector<float> samples(4800, 1.0F);
  sound.render(samples);
  EXPECT_EQ(largest(samples), 0) << "before any tick";
  EXPECT_EQ(largest(after(sound, {}, 100)), 0);
  EXPECT_EQ(largest(after(sound, sliding(0, 2), 100)), 0) << "pressed, at rest";
  EXPECT_EQ(largest(after(sound, sliding(0.2F, 0), 100)), 0) << "sliding without force";
  EXPECT_GT(largest(after(sound, sliding(0.2F, 2), 100)), 0.05) << "both";
}

TEST(ContactSound, IsTheLouderTheMorePowerGoesIntoSliding) {
  double last = 0;
  for (const float power : {0.001F, 0.003F, 0.01F, 0.03F, 0.1F, 0.3F}) {
    const double now = steady(sliding(0.1F, power / 0.1F));
    EXPECT_GT(now, 1.2 * last) << power << " W";
    last = now;
  }
  // Of small powers in proportion: 1 - exp(-p) is p.
  EXPECT_NEAR(steady(sliding(0.05F, 0.04F)) / steady(sliding(0.05F, 0.02F)), 2, 0.1);
  EXPECT_NEAR(steady(sliding(0.2F, 0.1F)) / steady(sliding(0.05F, 0.4F)), 1, 0.15) << "the same power";
}

TEST(ContactSound, NeitherBeginsNorEndsWithAClick) {
  ContactSound sound;
  const SoundTick tick = sliding(0.2F, 2);
  const std::vector<float> start = after(sound, tick, 200);
  const double full = largest(std::span(start).last(4800));
  ASSERT_GT(full, 0.1);
  // 0.1 ms is a fortieth of the attack.
  EXPECT_LT(largest(std::span(start).first(5)), 0.06 * full);
  EXPECT_LT(loudness(std::span(start).first(48)), 0.3 * loudness(std::span(start).last(4800)));
  const std::vector<float> end = after(sound, {}, 400);
  EXPECT_GT(loudness(std::span(end).first(48)), 0.5 * loudness(std::span(start).last(4800))) << "no sudden end";
  EXPECT_LT(largest(std::span(end).subspan(4800, 480)), 0.02 * full) << "0.1 s later";
  EXPECT_EQ(largest(std::span(end).last(480)), 0) << "at last it is silent";
}

TEST(ContactSound, IsBoundedWhateverComes) {
  ContactSound sound;
  SoundTick wild = sliding(1e30F, 1e30F);
  wild.carving = true;
  for (std::size_t k = 0; k < SoundTick::kPlaces; ++k) wild.rises[k] = k % 2 == 0 ? 1e6F : -1e6F;
  const std::vector<float> samples = after(sound, wild, 200);
  for (const float s : samples) ASSERT_LE(std::abs(s), ContactSound::kLoudest);
  EXPECT_GT(largest(samples), 0.3);
  const std::vector<float> rest = after(sound, sliding(0.1F, 1), 500);
  EXPECT_TRUE(std::ranges::all_of(rest, [](float s) { return std::isfinite(s); }));
  EXPECT_LT(largest(std::span(rest).last(4800)), 0.8);
}

TEST(ContactSound, TextureAndCarvingAreHeard) {
  const SoundTick plain = sliding(0.05F, 0.3F);
  SoundTick carving = plain;
  carving.carving = true;
  EXPECT_GT(steady(carving), 1.02 * steady(plain));
  // A wave of 1 kHz and 5 um, whose rise is 0 at both ends of the tick.
  SoundTick textured = plain;
  for (std::size_t k = 0; k < SoundTick::kPlaces; ++k)
    textured.rises[k] = 5e-6F * std::sin(2 * std::numbers::pi_v<float> * static_cast<float>(k + 1) / 16);
  ContactSound sound;
  after(sound, textured, 100);
  const std::vector<float> samples = after(sound, textured, 500);
  const auto line = [&](std::span<const float> of, double hertz) {
    double in = 0, out = 0;
    for (std::size_t k = 0; k < of.size(); ++k) {
      const double turn = 2 * std::numbers::pi * hertz * static_cast<double>(k) / ContactSound::kRate;
      in += double{of[k]} * std::cos(turn);
      out += double{of[k]} * std::sin(turn);
    }
    return std::hypot(in, out);
  };
  EXPECT_GT(line(samples, 1000), 10 * line(samples, 1370));
  ContactSound smooth;
  after(smooth, plain, 100);
  EXPECT_GT(line(samples, 1000), 5 * line(after(smooth, plain, 500), 1000));
}

TEST(ContactSound, OutlastsAShortGapAndFallsSilentAfterALongOne) {
  ContactSound sound;
  const SoundTick tick = sliding(0.2F, 2);
  after(sound, tick, 100);
  std::vector<float> gap(kTick * 10);
  sound.render(gap);
  EXPECT_GT(loudness(gap), 0.5 * steady(tick));
  std::vector<float> rest(kTick * 500);
  sound.render(rest);
  EXPECT_EQ(rest.back(), 0);
}

TEST(ContactSound, CatchesUpWhereTicksHaveWaited) {
  ContactSound sound;
  for (int k = 0; k < 900; ++k) sound.tick(sliding(0.2F, 2));
  for (int k = 0; k < 5; ++k) sound.tick({});
  // Of 905 only 20 are still played: then it is silent.
  std::vector<float> samples(kTick * 300);
  sound.render(samples);
  EXPECT_EQ(samples.back(), 0);
}

TEST(ContactSound, VolumeZeroIsSilentAndComesWithoutAClick) {
  ContactSound sound;
  const SoundTick tick = sliding(0.2F, 2);
  after(sound, tick, 200);
  sound.set_volume(0);
  const std::vector<float> samples = after(sound, tick, 200);
  EXPECT_GT(loudness(std::span(samples).first(24)), 0.1);
  EXPECT_LT(largest(std::span(samples).last(480)), 1e-6);
}

TEST(ContactSound, IsFedFromAnotherThread) {
  ContactSound sound;
  std::atomic<bool> over{false};
  std::thread feeder([&] {
    for (int k = 0; k < 20'000; ++k) sound.tick(sliding(0.1F, 1));
    over = true;
  });
  std::vector<float> samples(480);
  while (!over) {
    sound.render(samples);
    for (const float s : samples) ASSERT_LE(std::abs(s), ContactSound::kLoudest);
  }
  feeder.join();
}

// ---- From the servo's samples

TEST(SoundTicks, TellSlipForceAndTexture) {
  // A plane with waves of 0.1 and 0.002 high, in x only.
  const SnapshotPtr model = testing::displaced(
      testing::plane_shell(2, 128), [](Vec3d p) { return 0.5 + 0.01 * std::sin(2 * std::numbers::pi * p.x / 0.1); });
  constexpr double kMetres = 0.1;
  const auto at = [&](int k) {
    const SurfacePoint on = closest_point(*model, {0.2 + 1e-3 * k, 0, 0.1});
    ServoSample s;
    s.t = k * 1e-3;
    s.contact = true;
    s.at = {on.slab, on.u, on.v, on.alpha};
    s.contact_point = on.position;
    s.normal = {0, 1, 0};
    s.force = {0.7, 1.5, 0};
    return s;
  };
  SoundTicks ticks;
  const SoundTick first = ticks.next(at(0), *model, kMetres, false);
  EXPECT_TRUE(first.contact);
  EXPECT_EQ(first.slip, 0);
  EXPECT_EQ(first.rises.back(), 0);
  double height = 0, low = 0, high = 0;
  for (int k = 1; k <= 100; ++k) {
    const SoundTick tick = ticks.next(at(k), *model, kMetres, true);
    EXPECT_NEAR(tick.slip, 1e-3 * kMetres / 1e-3, 0.1 * kMetres) << k;
    EXPECT_FLOAT_EQ(tick.force, 1.5F);
    EXPECT_TRUE(tick.carving);
    height += double{tick.rises.back()};
    low = std::min(low, height);
    high = std::max(high, height);
  }
  // One whole wave: 0.01 of the slab's depth of 0.2, both ways, in m.
  EXPECT_NEAR(height, 0, 1e-6);
  EXPECT_NEAR(high, 0.01 * 0.2 * kMetres, 1e-5);
  EXPECT_NEAR(low, -0.01 * 0.2 * kMetres, 1e-5);
  ServoSample off = at(101);
  off.contact = false;
  EXPECT_FALSE(ticks.next(off, *model, kMetres, true).contact);
  EXPECT_EQ(ticks.next(at(150), *model, kMetres, false).slip, 0) << "a new contact has slid nowhere";
}

}  // namespace
}  // namespace relief
