#include "mesh_checks.h"

#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/mesh/repair.h>

#include <assimp/Importer.hpp>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gtest/gtest.h>

#include <cmath>

namespace relief {
namespace {

using testing::TempFolder;

/// A bumpy closed surface whose coordinates need every digit they can get, with colours of all kinds.
TriangleMesh bumpy(Vec3d centre, double size, bool as_float) {
  TriangleMesh mesh = testing::box({-1, -1, -1}, {1, 1, 1});
  for (int level = 0; level < 3; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
      if (fresh) mesh.positions.push_back(Vec3d((mesh.positions[a] + mesh.positions[b]) * 0.5));
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.triangles = std::move(finer);
  }
  for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
    const Vec3d p = normalized(mesh.positions[k]);
    Vec3d q = centre + p * (size * (1.0 + 0.1 * std::sin(7 * p.x) * std::cos(5 * p.y)));
    if (as_float) q = to_double(to_float(q));
    mesh.positions[k] = q;
    mesh.colours.push_back(
        {static_cast<std::uint8_t>(k), static_cast<std::uint8_t>(7 * k), static_cast<std::uint8_t>(255 - k), 255});
  }
  return mesh;
}

class RoundTrip : public ::testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static bool keeps_colour() { return std::string_view(GetParam()) != "stl"; }
  /// glTF is in metres, so a model unit of a millimetre comes back as 0.001.
  [[nodiscard]] static double scale() { return std::string_view(GetParam()) == "glb" ? 1e-3 : 1.0; }
};

TEST_P(RoundTrip, FloatModelComesBackWhole) {
  const TempFolder folder;
  const TriangleMesh mesh = bumpy({3, 4, 5}, 20, true);
  const auto file = folder / (std::string("m.") + GetParam());
  ASSERT_TRUE(export_mesh(mesh, file).has_value());
  EXPECT_EQ(folder.file_count(), 1U) << "something is left beside the file";
  auto read = import_mesh(file);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  if (std::string_view(GetParam()) == "stl") read = repair(*read).value().mesh;
  ASSERT_EQ(read->positions.size(), mesh.positions.size());
  ASSERT_EQ(read->triangles.size(), mesh.triangles.size());
  if (keeps_colour()) {
    EXPECT_EQ(read->triangles, mesh.triangles);
    EXPECT_EQ(read->colours, mesh.colours);
    for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
      const Vec3f want = to_float(mesh.positions[k]);
      const Vec3d got = read->positions[k] * (1.0 / scale());
      if (scale() == 1.0) {
        EXPECT_EQ(to_float(got), want) << k;
      } else {
        EXPECT_NEAR(length(got - mesh.positions[k]), 0.0, 1e-13 * 30) << k;
      }
    }
  } else {
    EXPECT_TRUE(read->colours.empty());
    EXPECT_NEAR(signed_volume(*read), signed_volume(mesh), 1e-9 * signed_volume(mesh));
  }
}

TEST_P(RoundTrip, FarFromTheOriginKeepsItsDetail) {
  const std::string_view format = GetParam();
  if (format == "stl") GTEST_SKIP() << "STL has single precision and no way round it";
  const TempFolder folder;
  const Vec3d centre = {500000.125, 4'400'000.5, 88.25};
  const TriangleMesh mesh = bumpy(centre, 0.5, false);
  const auto file = folder / ("far." + std::string(format));
  ASSERT_TRUE(export_mesh(mesh, file, {.unit = Unit::Metre, .double_positions = true}).has_value());
  const auto read = import_mesh(file);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  ASSERT_EQ(read->positions.size(), mesh.positions.size());
  for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
    if (format == "glb") {
      EXPECT_LT(length(read->positions[k] - mesh.positions[k]), 1e-7);  // float about the centre
    } else {
      EXPECT_EQ(read->positions[k], mesh.positions[k]);
    }
  }
}

TEST_P(RoundTrip, AnotherReaderAgrees) {
  const TempFolder folder;
  const TriangleMesh mesh = bumpy({3, 4, 5}, 20, true);
  const auto file = folder / (std::string("m.") + GetParam());
  ASSERT_TRUE(export_mesh(mesh, file, {.unit = Unit::Metre}).has_value());
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  ASSERT_NE(scene, nullptr) << importer.GetErrorString();
  ASSERT_EQ(scene->mNumMeshes, 1U);
  const aiMesh& other = *scene->mMeshes[0];
  ASSERT_EQ(other.mNumFaces, mesh.triangles.size());
  const bool linear = std::string_view(GetParam()) == "glb";
  for (unsigned f = 0; f < other.mNumFaces; ++f) {
    ASSERT_EQ(other.mFaces[f].mNumIndices, 3U);
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned v = other.mFaces[f].mIndices[k];
      const aiVector3D p = other.mVertices[v];
      const Vec3d want = mesh.positions[mesh.triangles[f][k]];
      EXPECT_NEAR(length(to_double(Vec3f{p.x, p.y, p.z}) - want), 0.0, 1e-5);
      // Assimp keeps 3MF colours as materials, not per vertex.
      if (!keeps_colour() || std::string_view(GetParam()) == "3mf") continue;
      ASSERT_TRUE(other.HasVertexColors(0));
      double red = double{other.mColors[0][v].r};
      if (linear) red = red <= 0.0031308 ? red * 12.92 : 1.055 * std::pow(red, 1 / 2.4) - 0.055;
      EXPECT_NEAR(red * 255, mesh.colours[mesh.triangles[f][k]].r, 0.51);
    }
  }
}

TEST(Export, PlySaysWhichTrianglesCloseOpenings) {
  const TempFolder folder;
  TriangleMesh mesh = {.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                       .triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}},
                       .colours = {}};
  for (const std::optional<std::size_t> from :
       {std::optional<std::size_t>(), std::optional<std::size_t>(2), std::optional<std::size_t>(3)}) {
    mesh.phantom_from = from;
    ASSERT_TRUE(export_mesh(mesh, folder / "m.ply", {.double_positions = true}));
    const auto back = import_mesh(folder / "m.ply");
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->phantom_from, from);
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, RoundTrip, ::testing::Values("ply", "obj", "stl", "glb", "3mf"),
                         [](const auto& format) { return std::string("format_").append(format.param); });

TEST(Export, UnitsAreWritten) {
  const TempFolder folder;
  const TriangleMesh mesh = testing::box({0, 0, 0}, {1, 2, 3});
  for (const Unit unit : {Unit::Millimetre, Unit::Centimetre, Unit::Metre}) {
    ASSERT_TRUE(export_mesh(mesh, folder / "u.glb", {.unit = unit}).has_value());
    const auto read = import_mesh(folder / "u.glb");
    ASSERT_TRUE(read.has_value());
    EXPECT_NEAR(bounds(*read).high.z, 3 * metres(unit), 1e-12);
    EXPECT_EQ(read->unit, Unit::Metre);
    ASSERT_TRUE(export_mesh(mesh, folder / "u.3mf", {.unit = unit}).has_value());
    const TriangleMesh other = import_mesh(folder / "u.3mf").value();
    EXPECT_EQ(bounds(other).high, (Vec3d{1, 2, 3})) << "3MF names the unit and scales nothing";
    EXPECT_EQ(other.unit, unit);
  }
}

TEST(Export, AModelKeepsItsSizeOverManyRoundTrips) {
  const TempFolder folder;
  const TriangleMesh mesh = bumpy({3, 4, 5}, 20, false);
  const double size = diagonal(bounds(mesh)) * 1e-3;  // metres
  for (const char* name : {"size.glb", "size.3mf"}) {
    TriangleMesh held = mesh;
    held.unit = Unit::Millimetre;
    for (int round = 0; round < 3; ++round) {
      ASSERT_TRUE(held.unit.has_value()) << name;
      ASSERT_TRUE(export_mesh(held, folder / name, {.unit = *held.unit}).has_value());
      auto read = import_mesh(folder / name);
      ASSERT_TRUE(read.has_value()) << read.error().message;
      held = repair(*read).value().mesh;
    }
    ASSERT_TRUE(held.unit.has_value()) << name;
    EXPECT_NEAR(diagonal(bounds(held)) * metres(*held.unit), size, 1e-6 * size) << name;
  }
  for (const char* name : {"size.ply", "size.obj", "size.stl"}) {
    ASSERT_TRUE(export_mesh(mesh, folder / name).has_value());
    EXPECT_EQ(import_mesh(folder / name).value().unit, std::nullopt) << name << " says nothing about units";
  }
}

TEST(Export, AlphaSurvivesWhereTheFormatHasIt) {
  const TempFolder folder;
  TriangleMesh mesh = testing::box({0, 0, 0}, {1, 2, 3});
  for (std::uint8_t k = 0; k < 8; ++k) mesh.colours.push_back({k, 0, 200, static_cast<std::uint8_t>(10 * k)});
  for (const char* name : {"a.ply", "a.glb", "a.3mf"}) {
    ASSERT_TRUE(export_mesh(mesh, folder / name).has_value());
    EXPECT_EQ(import_mesh(folder / name).value().colours, mesh.colours) << name;
  }
}

TEST(Export, ReplacesWholeFilesAndLeavesNothingOnFailure) {
  const TempFolder folder;
  const TriangleMesh mesh = testing::box({0, 0, 0}, {1, 1, 1});
  const auto file = folder.put("m.ply", "old");
  ASSERT_TRUE(export_mesh(mesh, file).has_value());
  EXPECT_EQ(import_mesh(file).value().triangles.size(), 12U);

  const auto unknown = export_mesh(mesh, folder / "m.xyz");
  ASSERT_FALSE(unknown.has_value());
  EXPECT_EQ(unknown.error().code, Errc::UnsupportedFormat);
  const auto nowhere = export_mesh(mesh, folder / "no/such/folder/m.ply");
  ASSERT_FALSE(nowhere.has_value());
  EXPECT_EQ(nowhere.error().code, Errc::Io);
  testing::expect_sentence(nowhere.error().message, "m.ply");
  TriangleMesh far = mesh;
  far.positions[0].x = 1e300;
  EXPECT_FALSE(export_mesh(far, folder / "far.stl").has_value());
  EXPECT_TRUE(export_mesh(far, folder / "far.obj").has_value());
  EXPECT_EQ(folder.file_count(), 2U);
}

TEST(Export, SameMeshSameBytes) {
  const TempFolder folder;
  const TriangleMesh mesh = bumpy({}, 1, false);
  for (const std::string extension : {"ply", "obj", "stl", "glb", "3mf"}) {
    ASSERT_TRUE(export_mesh(mesh, folder / ("1." + extension)).has_value());
    ASSERT_TRUE(export_mesh(mesh, folder / ("2." + extension)).has_value());
    EXPECT_EQ(testing::file_bytes(folder / ("1." + extension)), testing::file_bytes(folder / ("2." + extension)));
  }
}

}  // namespace
}  // namespace relief
