#include "matcaps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace relief::detail {

namespace {

/// From the surface to the light, in view space; what a white surface that faces it gives back.
struct Lamp {
  Vec3f towards;
  Vec3f colour;
  float wrap;  ///< how far round the terminator light still comes, 0..1: larger lamps and softer materials
};
constexpr std::array<Lamp, 3> kLamps = {{{{-0.62F, 0.55F, 0.56F}, {1.95F, 1.80F, 1.60F}, 0.10F},
                                         {{0.90F, -0.05F, 0.42F}, {0.13F, 0.14F, 0.16F}, 0.25F},
                                         {{0.62F, 0.50F, -0.60F}, {0.42F, 0.45F, 0.50F}, 0.0F}}};
constexpr Vec3f kSky = {0.150F, 0.160F, 0.180F}, kGround = {0.058F, 0.046F, 0.040F};

struct Material {
  std::string_view name;
  std::optional<Vec3f> colour;  ///< sRGB; that asked for where there is none
  float gloss, rough;           ///< strength of the highlight; its width, 0..1
  float soft;                   ///< added to each lamp's wrap: light that goes through the material
  Vec3f through;                ///< tint of what comes round the terminator, linear
  Vec3f rim;                    ///< added where the surface turns away, linear
  float metal;                  ///< 0..1: the highlight takes the material's colour, and the diffuse part goes
};
constexpr std::array<Material, 6> kMaterials = {{
    {"clay", std::nullopt, 0.035F, 0.55F, 0.06F, {1.0F, 0.78F, 0.60F}, {0.016F, 0.017F, 0.019F}, 0},
    {"red wax", Vec3f{0.60F, 0.17F, 0.12F}, 0.28F, 0.32F, 0.30F, {1.5F, 0.55F, 0.35F}, {0.060F, 0.014F, 0.010F}, 0},
    {"skin", Vec3f{0.82F, 0.62F, 0.52F}, 0.11F, 0.44F, 0.28F, {1.5F, 0.55F, 0.40F}, {0.060F, 0.034F, 0.028F}, 0},
    {"pearl", Vec3f{0.86F, 0.85F, 0.84F}, 0.42F, 0.24F, 0.15F, {0.9F, 0.8F, 1.1F}, {0.10F, 0.09F, 0.13F}, 0},
    {"dark bronze", Vec3f{0.37F, 0.27F, 0.17F}, 1.25F, 0.36F, 0, {1.0F, 0.9F, 0.8F}, {0.030F, 0.028F, 0.024F}, 0.75F},
    {"grey", Vec3f{0.62F, 0.62F, 0.62F}, 0.06F, 0.5F, 0.1F, {1.0F, 1.0F, 1.0F}, {0.012F, 0.012F, 0.012F}, 0},
}};

constexpr auto kNames = [] {
  std::array<std::string_view, kMaterials.size()> names{};
  for (std::size_t k = 0; k < names.size(); ++k) names[k] = kMaterials[k].name;
  return names;
}();

Vec3f times(Vec3f a, Vec3f b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
Vec3f mix(Vec3f a, Vec3f b, float t) { return a * (1 - t) + b * t; }

float linear(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }
Vec3f linear(Vec3f c) { return {linear(c.x), linear(c.y), linear(c.z)}; }

/// Returns the film curve and the sRGB curve after it, as kQuickLight's encode() in the shaders.
float encoded(float light) {
  const float s = std::sqrt(std::max(light, 0.0F));
  return (light * 5.5706F + s * 0.16275F) / (light * 4.7722F + s * 1.22847F + 1.0F);
}

std::uint32_t texel(Vec3f rgb, float a) {
  std::uint32_t word = 0;
  const std::array<float, 4> all = {rgb.x, rgb.y, rgb.z, a};
  for (std::size_t c = 0; c < 4; ++c)
    word |= static_cast<std::uint32_t>(std::lround(std::clamp(all[c], 0.0F, 1.0F) * 255)) << (8 * c);
  return word;
}

/// Light that a place receives, and the strength of its highlights.
struct Received {
  Vec3f diffuse;
  float gloss;
};

Received receive(const Material& m, Vec3f n) {
  Received sum{mix(kGround, kSky, 0.5F + 0.5F * n.y), 0};
  for (const Lamp& lamp : kLamps) {
    const Vec3f l = normalized(lamp.towards);
    const float nl = dot(n, l), wrap = lamp.wrap + m.soft;
    // Beyond the terminator the light has come through the material, and has its tint.
    const float around = std::max(0.0F, (nl + wrap) / (1 + wrap)), direct = std::max(nl, 0.0F);
    sum.diffuse += times(lamp.colour, Vec3f{1, 1, 1} * direct + m.through * std::max(0.0F, around * around - direct));
    const Vec3f h = normalized(l + Vec3f{0, 0, 1});
    const float nh = std::max(dot(n, h), 0.0F), a2 = m.rough * m.rough * m.rough * m.rough;
    const float d = nh * nh * (a2 - 1) + 1;
    sum.gloss += lamp.colour.y * m.gloss * 0.25F * a2 / (d * d) / (0.35F + m.rough) * std::min(1.0F, direct * 4);
  }
  return sum;
}

}  // namespace

std::span<const std::string_view> matcap_names() noexcept { return kNames; }

MatcapTables make_matcap(std::size_t material, Vec3f base) {
  const Material& m = kMaterials[material];
  const Vec3f albedo = linear(m.colour.value_or(base));
  MatcapTables tables;
  tables.finished.reserve(std::size_t{kMatcapEdge} * kMatcapEdge);
  tables.light.reserve(tables.finished.capacity());
  for (int y = 0; y < kMatcapEdge; ++y)
    for (int x = 0; x < kMatcapEdge; ++x) {
      Vec3f n = {2 * (static_cast<float>(x) + 0.5F) / kMatcapEdge - 1,
                 2 * (static_cast<float>(y) + 0.5F) / kMatcapEdge - 1, 0};
      const float flat = n.x * n.x + n.y * n.y;
      if (flat < 1)
        n.z = std::sqrt(1 - flat);
      else
        n = n / std::sqrt(flat);
      const Received got = receive(m, n);
      const float away = 1 - n.z, edge = away * away * away;
      const Vec3f shine = mix(Vec3f{1, 1, 1}, albedo * (1 / std::max({albedo.x, albedo.y, albedo.z, 0.05F})), m.metal);
      const Vec3f out = times(albedo, got.diffuse) * (1 - 0.6F * m.metal) + shine * got.gloss + m.rim * edge;
      tables.finished.push_back(texel({encoded(out.x), encoded(out.y), encoded(out.z)}, 1));
      const Vec3f light = got.diffuse * 0.25F;
      tables.light.push_back(texel({std::sqrt(light.x), std::sqrt(light.y), std::sqrt(light.z)}, std::sqrt(got.gloss)));
    }
  return tables;
}

}  // namespace relief::detail
