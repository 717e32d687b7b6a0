#include <relief/session/contact_sound.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relief {
namespace {

constexpr float kPower = 0.1F;        // W of sliding that are 63 % of the loudest
constexpr float kDullest = 400;       // Hz, upper end of the friction's band at rest
constexpr float kBrightest = 6000;    // Hz, that much more at any speed
constexpr float kBrightSpeed = 0.1F;  // m/s at which it is half way there
constexpr float kRumble = 150;        // Hz, lower end of the band
constexpr float kForm = 60;           // Hz, below which a height is the model's form
constexpr float kRough = 2e-3F;       // m/s of height that make a loud texture
constexpr float kCrackles = 4000;     // per metre of way
constexpr float kCrackle = 2e-3F;     // s, of one
constexpr float kSilent = 1e-4F;      // level that is none: 80 dB below full scale
constexpr float kFrictionShare = 0.6F, kTextureShare = 0.6F, kCrackleShare = 0.9F;

/// Share by which a one-pole filter of this time constant (s) follows in one sample.
float follows(double seconds) noexcept {
  return static_cast<float>(-std::expm1(-1.0 / (seconds * ContactSound::kRate)));
}
/// Returns the same for a corner frequency, Hz.
float corner(float hertz) noexcept {
  return -std::expm1(-2 * 3.14159265F * hertz / static_cast<float>(ContactSound::kRate));
}

/// m, of the surface above the inner end of its fibre.
double height_at(const Snapshot& model, SlabId slab, double u, double v, double metres) noexcept {
  const SlabCorners corners = model.slab_mesh().corners(slab);
  const Vec3d fibre = (corners.outer[0] - corners.inner[0]) * (1 - u - v) + (corners.outer[1] - corners.inner[1]) * u +
                      (corners.outer[2] - corners.inner[2]) * v;
  return displacement_at(model, slab, u, v) * length(fibre) * metres;
}

}  // namespace

SoundTick SoundTicks::next(const ServoSample& sample, const Snapshot& model, double metres_per_unit,
                           bool carving) noexcept {
  SoundTick tick;
  const bool known = sample.contact && sample.at.slab < model.slab_mesh().slab_count();
  if (!known) {
    touched_ = false;
    return tick;
  }
  tick.contact = true;
  tick.carving = carving;
  tick.force = static_cast<float>(std::max(0.0, dot(sample.force, sample.normal)));
  const double height = height_at(model, sample.at.slab, sample.at.u, sample.at.v, metres_per_unit);
  const double dt = sample.t - t_;
  // Another cage has other numbers and heights.
  if (std::exchange(cage_, model.slab_mesh().number()) != model.slab_mesh().number()) touched_ = false;
  if (touched_ && dt > 0) {
    const Vec3d way = sample.contact_point - point_;
    tick.slip = static_cast<float>(length(way - sample.normal * dot(way, sample.normal)) * metres_per_unit / dt);
    for (std::size_t k = 0; k < SoundTick::kPlaces; ++k) {
      const double share = static_cast<double>(k + 1) / SoundTick::kPlaces;
      // Over a border of slabs the way is not straight in u and v, and its texture is left out.
      const double here = at_.slab == sample.at.slab ? height_at(model, at_.slab, at_.u + (sample.at.u - at_.u) * share,
                                                                 at_.v + (sample.at.v - at_.v) * share, metres_per_unit)
                                                     : height_ + (height - height_) * share;
      tick.rises[k] = static_cast<float>(here - height_);
    }
  }
  touched_ = true;
  at_ = sample.at;
  point_ = sample.contact_point;
  t_ = sample.t;
  height_ = height;
  return tick;
}

ContactSound::ContactSound() : queue_(1024) {}

void ContactSound::tick(const SoundTick& tick) noexcept {
  if (queue_.push(tick)) pushed_.fetch_add(1, std::memory_order_release);
}

void ContactSound::next_tick() noexcept {
  const std::uint64_t waiting = pushed_.load(std::memory_order_acquire) - popped_;
  height_ -= now_.rises.back();
  for (std::uint64_t late = waiting > kBacklog ? waiting - kHold : 0; late > 0; --late)
    popped_ += queue_.pop(now_) ? 1U : 0U;
  if (queue_.pop(now_)) {
    ++popped_;
    idle_ = 0;
    return;
  }
  now_.rises.fill(0);
  if (++idle_ > kHold) now_ = {};
}

float ContactSound::noise() noexcept {
  random_ = random_ * 1664525U + 1013904223U;
  return static_cast<float>(static_cast<std::int32_t>(random_)) / 2147483648.0F;
}

float ContactSound::sample(std::size_t k) noexcept {
  static const float attack = follows(kAttack), release = follows(kRelease), rumble = corner(kRumble),
                     form = corner(kForm), fade = std::exp(-1 / (kCrackle * kRate));
  const float wanted = now_.contact ? -std::expm1(-now_.slip * now_.force / kPower) : 0.0F;
  level_ += (wanted - level_) * (wanted > level_ ? attack : release);
  grit_ += ((now_.contact && now_.carving ? 1.0F : 0.0F) - grit_) * attack;
  if (level_ < kSilent && wanted < kSilent) {
    level_ = low_ = rumble_ = crackle_ = form_ = 0;
    return 0;
  }

  const float upper = corner(kDullest + kBrightest * now_.slip / (now_.slip + kBrightSpeed));
  const float white = noise();
  low_ += (white - low_) * upper;
  rumble_ += (low_ - rumble_) * rumble;
  const float friction = (low_ - rumble_) * std::sqrt((2 - upper) / upper);  // as loud, whatever its band

  const float place = static_cast<float>(k) * SoundTick::kPlaces / kPerTick;
  const auto entry = static_cast<std::size_t>(place);
  const float from = entry == 0 ? 0.0F : now_.rises[entry - 1];
  const float height = from + (now_.rises[entry] - from) * (place - static_cast<float>(entry));
  const float rise = (height - std::exchange(height_, height)) * kRate;
  form_ += (rise - form_) * form;
  const float texture = std::tanh((rise - form_) / kRough * std::min(1.0F, now_.force));

  if (std::abs(noise()) * kRate < kCrackles * now_.slip) crackle_ = 1;
  crackle_ *= fade;
  const float crackle = crackle_ * noise() * grit_;
  return level_ * (kFrictionShare * friction + kTextureShare * texture + kCrackleShare * crackle);
}

void ContactSound::render(std::span<float> samples) noexcept {
  const float volume = std::clamp(volume_.load(std::memory_order_relaxed), 0.0F, 1.0F);
  static const float follow = follows(kAttack);
  for (float& out : samples) {
    if (at_ == 0) next_tick();
    gain_ += (volume - gain_) * follow;
    out = kLoudest * gain_ * std::tanh(sample(at_));
    at_ = (at_ + 1) % kPerTick;
  }
}

}  // namespace relief
