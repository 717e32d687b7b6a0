// What a contact sounds like, made of the same ticks as its force.
#pragma once

#include <relief/base/spsc_queue.h>
#include <relief/core/query.h>
#include <relief/haptics/servo.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

namespace relief {

/// One tick of 1 ms for the ear.
struct SoundTick {
  static constexpr std::size_t kPlaces = 16;  ///< places that are heard at a time

  bool contact = false;  ///< whether the tool touches
  bool carving = false;  ///< material is being changed
  float slip = 0;        ///< m/s of the contact point along the surface
  float force = 0;       ///< N along the normal
  /// m by which the displacement is higher than at the start of this tick's way, at evenly spaced places of it, the
  /// last one where the contact is now: texture up to 8 kHz, of which a servo of 1 kHz feels the part below 500 Hz.
  std::array<float, kPlaces> rises{};
};

/// Makes them of a servo's samples, one after the other. No allocation, no lock.
class SoundTicks {
 public:
  /// `model`: the one that was touched, or a newer one. Costs kPlaces displacement_at().
  [[nodiscard]] SoundTick next(const ServoSample& sample, const Snapshot& model, double metres_per_unit,
                               bool carving) noexcept;

 private:
  bool touched_ = false;
  std::uint64_t cage_ = 0;  ///< its number
  SlabCoord at_;
  Vec3d point_;  ///< model units, of the contact
  double t_ = 0;
  double height_ = 0;  ///< m
};

/// Synthesises mono samples of 48 kHz: the noise of friction, the texture that goes by, the crackle of carving. The
/// louder, the more power goes into sliding (slip times force). Silence is exactly zero. A start takes kAttack, an end
/// kRelease, so that neither clicks.
class ContactSound {
 public:
  static constexpr int kRate = 48'000;  ///< Hz
  static constexpr int kPerTick = 48;   ///< samples
  /// s, to 63 % of a change
  static constexpr double kAttack = 4e-3, kRelease = 20e-3;
  static constexpr int kHold = 20;         ///< ticks for which the last one lasts where none comes
  static constexpr int kBacklog = 100;     ///< ticks that may wait; then all but kHold of them are left out
  static constexpr float kLoudest = 0.8F;  ///< of full scale; no sample is above it

  ContactSound();

  /// One thread, wait-free.
  void tick(const SoundTick& tick) noexcept;
  /// 0..1. Any thread, wait-free.
  void set_volume(float volume) noexcept { volume_.store(volume, std::memory_order_relaxed); }
  /// The next samples. One thread, not necessarily that of tick(); wait-free.
  void render(std::span<float> samples) noexcept;

 private:
  void next_tick() noexcept;
  [[nodiscard]] float noise() noexcept;
  [[nodiscard]] float sample(std::size_t k) noexcept;

  SpscQueue<SoundTick> queue_;
  std::atomic<std::uint64_t> pushed_{0};
  std::atomic<float> volume_{1};
  // The thread of render() alone.
  std::uint64_t popped_ = 0;
  SoundTick now_;
  int idle_ = kHold + 1;  ///< ticks since the last one came
  std::size_t at_ = 0;    ///< sample of the tick
  std::uint32_t random_ = 1;
  float level_ = 0, grit_ = 0;  ///< smoothed: loudness, share of carving
  float low_ = 0, rumble_ = 0;  ///< of the friction's band
  float height_ = 0;            ///< m, of the last sample above the start of the tick's way
  float form_ = 0;              ///< m/s by which the form rises, without texture
  float crackle_ = 0, gain_ = 0;
};

}  // namespace relief
