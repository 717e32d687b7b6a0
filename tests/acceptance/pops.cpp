// S8: the contact point changes sides by legal ways only.
#include "acceptance/acceptance.h"
#include "support/contact_runs.h"
#include "support/driver.h"

#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>
#include <relief/mesh/samples.h>

#include <cmath>
#include <string>
#include <vector>

namespace relief::acceptance {
namespace {

struct Scene {
  std::string name;
  SnapshotPtr model;
};

SnapshotPtr formed(const std::shared_ptr<const SlabMesh>& shell, double (*radius)(Vec3d)) {
  return testing::shaped(shell, [=](Vec3d p) { return length(p) - radius(p * (1 / length(p))); });
}

/// A disc, 0.2 mm thick where its diagonal is 0.15 m, and thinner towards its sharp rim.
SnapshotPtr disc() {
  constexpr double kHalf = 0.5 * 0.2e-3 / 0.15 * 2.83;
  return testing::displaced(
      testing::mapped_shell(*testing::sphere_shell(2, 32), [](Vec3d p) { return Vec3d{p.x, kHalf * p.y, p.z}; }),
      [](Vec3d) { return 0.5; });
}
/// A finger along x: 6 mm thick and 7.5 mm wide where its diagonal is 0.15 m.
SnapshotPtr finger() {
  return testing::displaced(
      testing::mapped_shell(*testing::sphere_shell(2, 32), [](Vec3d p) { return Vec3d{p.x, 0.04 * p.y, 0.05 * p.z}; }),
      [](Vec3d) { return 0.5; });
}
/// Eight sharp points, hollow between them.
double cusps(Vec3d way) {
  const double peak = std::max({std::abs(way.x + way.y + way.z), std::abs(way.x + way.y - way.z),
                                std::abs(way.x - way.y + way.z), std::abs(way.x - way.y - way.z)}) /
                      std::sqrt(3.0);
  return 0.3 + 0.8 * std::pow(peak, 24);
}

/// Two spheres that touch in one point.
SnapshotPtr touching() {
  std::vector<Fibre> fibres;
  std::vector<SlabMesh::Face> faces;
  for (const double side : {-1.0, 1.0}) {
    const auto one = testing::sphere_shell(2, 32, 0.8, 1.0, {side, 0, 0});
    const auto first = static_cast<FibreId>(fibres.size());
    fibres.insert(fibres.end(), one->fibres().begin(), one->fibres().end());
    for (const Slab& s : one->slabs())
      faces.push_back({{s.fibres[0] + first, s.fibres[1] + first, s.fibres[2] + first}, s.intervals});
  }
  auto mesh = SlabMesh::make(std::move(fibres), faces);
  if (!mesh) return nullptr;
  return Snapshot::make(std::make_shared<const SlabMesh>(*std::move(mesh)), 1);
}

/// Needles: every sample at its own height, so that micro-triangles are slivers, up to thirty times as long as wide.
SnapshotPtr needles() {
  return testing::displaced(testing::sphere_shell(2, 32), [](Vec3d p) {
    const double a = std::sin(1e4 * p.x + 2e4 * p.y + 3e4 * p.z) * 4096;
    return 0.1 + 0.8 * (a - std::floor(a));
  });
}

std::vector<Scene> scenes() {
  std::vector<Scene> all = {{"disc of 0.2 mm", disc()},
                            {"finger of 6 mm", finger()},
                            {"cusps", formed(testing::sphere_shell(2, 32, 0.2, 1.2), cusps)},
                            {"spheres that touch", touching()}};
  for (const std::string name : {"bowl", "head"})
    if (const auto mesh = make_sample(name, 30'000))
      if (const auto made = convert(*mesh, {.slabs = 200, .intervals = 32}))
        all.push_back({"sample " + name, made->model.head});
  all.push_back({"needles", needles()});
  return all;
}

}  // namespace

void pops(Report& report) {
  // A part has some of the scenes, and of these all: what is rare in a scene is judged by many runs.
  const std::vector<Scene> all = scenes();
  std::vector<Scene> list;
  const Part part = report.part();
  for (auto k = static_cast<std::size_t>(part.number - 1); k < all.size(); k += static_cast<std::size_t>(part.of))
    list.push_back(all[k]);
  const double of_scene = (report.long_form() ? 1e8 : 4e5) / double(all.size());
  const double wanted = of_scene * double(list.size());
  double frames = 0, compared = 0, deeper = 0;
  for (const Scene& scene : list) {
    const testing::ContactRuns done =
        testing::judged_runs(*scene.model, testing::is_closed(scene.model->slab_mesh()), long(of_scene));
    frames += double(done.pressed);
    report.at_most(scene.name + ": illegal ticks" + (done.first.empty() ? "" : " (" + done.first + ")"),
                   double(done.bad()), 0);
    compared += double(done.compared);
    deeper += double(done.deeper);
    report.at_most(scene.name + ": ticks outside thin places over 1.05 times as deep as a god-object",
                   double(done.deeper) / double(std::max(done.compared, 1L)), 1e-3);
  }
  report.shown("pressed frames that were judged", frames);
  report.at_least("pressed frames that were judged, of those wanted", frames / wanted, 1);
  report.at_least("of these, outside thin places", compared / frames, 0.2);
  report.at_most("of those, over 1.05 times as deep as a god-object", deeper / std::max(compared, 1.0), 1e-3);

  // Balls of 0.6 mm and 3 mm where the diagonal is 0.15 m.
  frames = compared = deeper = 0;
  for (const double share : {0.004, 0.02})
    for (const Scene& scene : list) {
      const double radius = share * testing::TriangleSoup(*scene.model).size();
      const testing::ContactRuns done = testing::judged_ball_runs(*scene.model, radius, long(of_scene / 8));
      frames += double(done.pressed);
      const std::string what = scene.name + ", ball of " + (share > 0.01 ? "2" : "0.4") + " %";
      report.at_most(what + ": illegal ticks" + (done.first.empty() ? "" : " (" + done.first + ")"), double(done.bad()),
                     0);
      report.shown("    most that it was in a triangle, of its radius", done.overlap);
      compared += double(done.compared);
      deeper += double(done.deeper);
      report.at_most(what + ": ticks outside thin places over 1.05 times as deep as a god-object",
                     double(done.deeper) / double(std::max(done.compared, 1L)), 1e-3);
      report.shown("    most, of the god-object's depth", done.most_times);
    }
  report.shown("pressed frames of balls that were judged", frames);
  report.at_least("pressed frames of balls that were judged, of those wanted", frames / (wanted / 4), 1);
  report.at_least("of these of balls, outside thin places", compared / frames, 0.2);
  report.at_most("of those, balls over 1.05 times as deep as a god-object", deeper / std::max(compared, 1.0), 1e-3);
}

}  // namespace relief::acceptance
