// Small meshes, files for them, and the question whether a mesh is an oriented manifold.
#pragma once

#include <relief/mesh/triangle_mesh.h>

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relief::testing {

/// A folder of its own for each test, gone at the end.
class TempFolder {
 public:
  TempFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("relief-mesh-" + std::to_string(::getpid()) + "-" +
               ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  [[nodiscard]] std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
  std::filesystem::path put(std::string_view name, std::string_view bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }
  [[nodiscard]] std::size_t file_count() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path path_;
};

inline std::string file_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// An axis-aligned box with outward triangles.
inline TriangleMesh box(Vec3d low, Vec3d high) {
  TriangleMesh mesh;
  for (unsigned k = 0; k < 8; ++k) {
    mesh.positions.push_back(
        {(k & 1U) != 0 ? high.x : low.x, (k & 2U) != 0 ? high.y : low.y, (k & 4U) != 0 ? high.z : low.z});
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline void append(TriangleMesh& mesh, const TriangleMesh& more, bool turned = false) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(), more.positions.begin(), more.positions.end());
  for (const auto& [a, b, c] : more.triangles) {
    mesh.triangles.push_back(turned ? Triangle{first + a, first + c, first + b}
                                    : Triangle{first + a, first + b, first + c});
  }
}

/// Empty when every edge has one triangle or two that run through it in opposite directions and every vertex has one
/// fan; else what is wrong.
inline std::string manifold_fault(const TriangleMesh& mesh) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::map<Edge, std::uint32_t> leaving;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (a >= mesh.positions.size()) return "a corner without a position";
      if (a == b) return "a repeated corner";
      if (!leaving.emplace(Edge{a, b}, t).second) return "two triangles run the same way along an edge";
    }
  }
  // Around each vertex, a triangle (v, b, c) leads to the one that leaves v along c; one walk must see them all.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> wings(mesh.positions.size());
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) wings[t[k]].emplace_back(t[(k + 1) % 3], t[(k + 2) % 3]);
  for (std::size_t v = 0; v < wings.size(); ++v) {
    if (wings[v].empty()) return "an unused vertex";
    std::map<std::uint32_t, std::uint32_t> next(wings[v].begin(), wings[v].end());
    std::map<std::uint32_t, std::uint32_t> before;
    for (const auto& [b, c] : wings[v]) before[c] = b;
    std::uint32_t start = wings[v][0].first;
    for (std::size_t k = 0; k < wings[v].size() && before.contains(start); ++k) start = before[start];
    std::size_t seen = 0;
    for (std::uint32_t at = start; next.contains(at) && seen <= wings[v].size(); ++seen) {
      const std::uint32_t then = next[at];
      next.erase(at);
      at = then;
    }
    if (seen != wings[v].size()) return "a vertex with several fans";
  }
  return {};
}

inline double area(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    sum += 0.5 * length(cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]));
  }
  return sum;
}

/// One line, at most 500 bytes, no control characters, and it names the file.
inline void expect_sentence(const std::string& message, const std::filesystem::path& file) {
  EXPECT_FALSE(message.empty());
  EXPECT_LE(message.size(), 500U) << message;
  for (const char c : message) EXPECT_FALSE(static_cast<unsigned char>(c) < 0x20 || c == 0x7f) << message;
  EXPECT_NE(message.find(file.extension().string()), std::string::npos) << message;
}

}  // namespace relief::testing
