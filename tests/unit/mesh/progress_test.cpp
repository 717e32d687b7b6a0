// Reading and writing of meshes: how far it is, and that it can be cancelled at any moment.
#include "mesh_checks.h"

#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <gtest/gtest.h>
#include <support/canceller.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <string>

namespace relief {
namespace {

using testing::TempFolder;

constexpr int kMostReports = 420;  // four parts at most, of some hundred each

/// Some thousand triangles with colours.
TriangleMesh torus() {
  TriangleMesh mesh = make_sample("torus", 4000).value();
  mesh.colours.assign(mesh.positions.size(), {10, 20, 30, 255});
  return mesh;
}

std::string number(double value) { return std::to_string(value) + " "; }

/// The formats that only are read, as text.
std::string as_off(const TriangleMesh& mesh) {
  std::string text =
      "OFF\n" + std::to_string(mesh.positions.size()) + " " + std::to_string(mesh.triangles.size()) + " 0\n";
  for (const Vec3d& p : mesh.positions) text += number(p.x) + number(p.y) + number(p.z) + "\n";
  for (const auto& [a, b, c] : mesh.triangles)
    text += "3 " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(c) + "\n";
  return text;
}
std::string as_text_stl(const TriangleMesh& mesh) {
  std::string text = "solid x\n";
  for (const Triangle& t : mesh.triangles) {
    text += "facet normal 0 0 1\nouter loop\n";
    for (const std::uint32_t k : t) {
      const Vec3d p = mesh.positions[k];
      text += "vertex " + number(p.x) + number(p.y) + number(p.z) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid x\n";
}
std::string as_text_ply(const TriangleMesh& mesh) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex " + std::to_string(mesh.positions.size()) +
                     "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
                     std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string off = as_off(mesh);
  return text + off.substr(off.find('\n', 4) + 1);
}
/// Polygons of many corners, which are cut after all is read.
std::string as_polygons() {
  std::string text;
  constexpr int kCorners = 200, kPolygons = 200;
  for (int z = 0; z < kPolygons; ++z) {
    for (int k = 0; k < kCorners; ++k) {
      const double turn = 6.2831853 * k / kCorners, r = k % 2 == 0 ? 1 : 2;
      text += "v " + number(r * std::cos(turn)) + number(r * std::sin(turn)) + number(z) + "\n";
    }
    text += "f";
    for (int k = kCorners; k > 0; --k) text += " -" + std::to_string(k);
    text += "\n";
  }
  return text;
}

/// Stops the reading of a file at every report.
void expect_it_stops_anywhere(const std::filesystem::path& file) {
  SCOPED_TRACE(file.filename().string());
  double last = -1;
  const auto whole = import_mesh(file, {.report = [&](std::string_view phase, double share) {
                                   EXPECT_EQ(phase, "import");
                                   EXPECT_GE(share, last);
                                   last = share;
                                 }});
  ASSERT_TRUE(whole.has_value()) << whole.error().message;
  EXPECT_EQ(last, 1);
  const int stops = testing::times_stopped([&](const Progress& p) { return testing::code(import_mesh(file, p)); },
                                           [] {}, kMostReports);
  EXPECT_GT(stops, 20);
}

TEST(ImportProgress, EveryFormatTellsItsShareAndStopsAtAnyMoment) {
  const TempFolder folder;
  const TriangleMesh mesh = torus();
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb", "a.3mf"}) {
    ASSERT_TRUE(export_mesh(mesh, folder / name).has_value());
    expect_it_stops_anywhere(folder / name);
  }
  expect_it_stops_anywhere(folder.put("t.off", as_off(mesh)));
  expect_it_stops_anywhere(folder.put("t.stl", as_text_stl(mesh)));
  expect_it_stops_anywhere(folder.put("t.ply", as_text_ply(mesh)));
  expect_it_stops_anywhere(folder.put("polygons.obj", as_polygons()));
  const auto packed = folder / "a.obj.gz";
  const std::string plain = testing::file_bytes(folder / "a.obj");
  gzFile out = gzopen(packed.c_str(), "wb");
  ASSERT_EQ(gzwrite(out, plain.data(), static_cast<unsigned>(plain.size())), static_cast<int>(plain.size()));
  ASSERT_EQ(gzclose(out), Z_OK);
  expect_it_stops_anywhere(packed);
}

TEST(ExportProgress, EveryFormatStopsAtAnyMomentAndLeavesNoHalfFile) {
  const TriangleMesh mesh = torus(), box = testing::box({0, 0, 0}, {1, 1, 1});
  for (const char* name : {"a.ply", "a.obj", "a.stl", "a.glb", "a.3mf"}) {
    SCOPED_TRACE(name);
    const TempFolder folder;
    const auto file = folder / name, other = folder / (std::string("b") + std::string(name).substr(1));
    ASSERT_TRUE(export_mesh(box, file).has_value());
    const std::string before = testing::file_bytes(file);
    const auto write = [&](const std::filesystem::path& to) {
      return testing::times_stopped([&](const Progress& p) { return testing::code(export_mesh(mesh, to, {}, p)); },
                                    [&] {
                                      EXPECT_EQ(testing::file_bytes(file), before) << "what stood there stays";
                                      EXPECT_EQ(folder.file_count(), 1U);
                                    },
                                    kMostReports);
    };
    EXPECT_GT(write(other), 50);
    std::filesystem::remove(other);
    EXPECT_GT(write(file), 50);
    EXPECT_EQ(import_mesh(file).value().triangles.size(), mesh.triangles.size());
  }
}

}  // namespace
}  // namespace relief
