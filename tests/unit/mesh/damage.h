// Damaged files: whatever is done to a file, a reader gives a sound mesh or one sentence.
#pragma once

#include "mesh_checks.h"

#include <relief/mesh/import.h>
#include <relief/mesh/repair.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>

namespace relief::testing {

/// A sound mesh, or one sentence; returns whether it was a mesh.
inline bool survives(const std::filesystem::path& file) {
  auto soup = import_mesh(file);
  if (!soup) {
    expect_sentence(soup.error().message, file);
    return false;
  }
  for (const Triangle& t : soup->triangles) {
    for (const std::uint32_t corner : t) EXPECT_LT(corner, soup->positions.size()) << file;
  }
  EXPECT_TRUE(soup->colours.empty() || soup->colours.size() == soup->positions.size()) << file;
  EXPECT_TRUE(soup->material_of.empty() || soup->material_of.size() == soup->triangles.size()) << file;
  EXPECT_TRUE(soup->uvs.empty() || soup->uvs.size() == soup->triangles.size()) << file;
  for (const std::uint32_t material : soup->material_of) EXPECT_LT(material, soup->materials.size()) << file;
  for (std::size_t t = 0; t < soup->triangles.size(); ++t) {
    const Vec3f colour = colour_at(*soup, t, {0.25, 0.5, 0.25});
    EXPECT_TRUE(colour.x >= 0 && colour.x <= 1 && colour.y >= 0 && colour.y <= 1 && colour.z >= 0 && colour.z <= 1)
        << file;
  }
  const auto out = repair(*soup);
  if (!out) {
    expect_sentence(out.error().message, {});
    return false;
  }
  EXPECT_FALSE(out->mesh.empty()) << file;
  EXPECT_EQ(manifold_fault(out->mesh), "") << file;
  return true;
}

/// Deterministic damage: bytes changed, blocks cut out, doubled or overwritten, numbers made huge, ends cut off.
inline std::string damage(std::string bytes, std::uint64_t seed) {
  std::uint64_t state = seed * 0x9e3779b97f4a7c15ULL + 1;
  const auto random = [&](std::size_t below) -> std::size_t {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return below == 0 ? 0 : static_cast<std::size_t>(state >> 33U) % below;
  };
  const std::size_t changes = 1 + random(4);
  for (std::size_t k = 0; k < changes && !bytes.empty(); ++k) {
    const std::size_t at = random(bytes.size());
    const std::size_t length = std::min(bytes.size() - at, 1 + random(16));
    switch (random(7)) {
      case 0:
        bytes[at] = static_cast<char>(random(256));
        break;
      case 1:
        bytes.resize(at);
        break;
      case 2:
        bytes.erase(at, length);
        break;
      case 3:
        bytes.insert(at, bytes.substr(at, length));
        break;
      case 4:
        std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length, static_cast<char>(0xff));
        break;
      case 5: {
        const std::size_t digit = bytes.find_first_of("0123456789", at);
        if (digit != std::string::npos) bytes.insert(digit, random(2) == 0 ? "99999999" : "-");
        break;
      }
      default:
        bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << random(8)));
        break;
    }
  }
  return bytes;
}

/// Damages a sound file in many ways, and cuts it off at many places; `RELIEF_SOAK` makes it fifty times as many.
inline void expect_it_survives_damage(const TempFolder& folder, std::string_view name, const std::string& bytes) {
  ASSERT_TRUE(survives(folder.put(name, bytes))) << name;
  const std::uint64_t seeds = std::getenv("RELIEF_SOAK") != nullptr ? 20'000 : 400;
  int sentences = 0;
  for (std::uint64_t seed = 0; seed < seeds; ++seed)
    if (!survives(folder.put(name, damage(bytes, seed)))) ++sentences;
  for (std::size_t end = 0; end < bytes.size(); end += 1 + bytes.size() / 100)
    if (!survives(folder.put(name, std::string_view(bytes).substr(0, end)))) ++sentences;
  EXPECT_GT(sentences, 10) << name << ": the damage is too small to be seen";
}

}  // namespace relief::testing
