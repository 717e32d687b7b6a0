// S20 and S21: the force against what is known: recorded motion, and surfaces in closed form at any scale and place.
#include "acceptance/acceptance.h"
#include "support/data.h"
#include "support/driver.h"
#include "support/held_tools.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <string>
#include <vector>

namespace relief::acceptance {
namespace {

using testing::Driver;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr double kStiffness = 400;

/// Nearest place of an ideal surface.
using Nearest = Vec3d (*)(Vec3d);

Vec3d on_sphere(Vec3d p) { return normalized(p); }
Vec3d on_torus(Vec3d p) {
  const Vec3d ring = normalized(Vec3d{p.x, 0, p.z}) * 2;
  return ring + normalized(p - ring) * 0.8;
}
Vec3d on_plane(Vec3d p) { return {p.x, 0.02 * p.x + 0.01 * p.z, p.z}; }

// The displaced sheet y = wave(x).
double wave(double x) { return 0.01 * std::sin(8 * x); }
Vec3d on_wave(Vec3d p) {
  double x = p.x;
  for (int k = 0; k < 40; ++k) {
    const double slope = 0.08 * std::cos(8 * x), bend = -0.64 * std::sin(8 * x), off = wave(x) - p.y;
    x -= (x - p.x + slope * off) / (1 + slope * slope + bend * off);
  }
  return {x, wave(x), p.z};
}
Vec3d nearest_on_plane(Vec3d p) {
  const Vec3d n = normalized(Vec3d{-0.02, 1, -0.01});
  return p - n * dot(p - on_plane(p), n);
}

/// The law in closed form: by how much the tool, whose origin is at `cursor`, is pushed, model units. `out` is outwards
/// there.
Vec3d ideal_push(Nearest nearest, const testing::HeldTool& held, Vec3d cursor, Vec3d out) {
  if (held.points.empty()) {
    // To the surface, or to the one that is the ball's radius above it.
    const Vec3d way = nearest(cursor) - cursor, n = normalized(way) * (dot(way, out) < 0 ? -1.0 : 1.0);
    return way + n * held.radius;
  }
  // Along the gradient of half the square of the depths' 16-norm.
  double deepest = 0, norm = 0;
  for (const Vec3d p : held.points) deepest = std::max(deepest, dot(nearest(cursor + p) - cursor - p, out));
  Vec3d push;
  for (const Vec3d p : held.points) {
    const Vec3d way = nearest(cursor + p) - cursor - p;
    if (dot(way, out) <= 0) continue;
    const double share = length(way) / deepest;
    norm += std::pow(share, 16);
    push += normalized(way) * std::pow(share, 15);
  }
  return push * (deepest * std::pow(norm, 2.0 / 16 - 1));
}

struct Errors {
  double force = 0, angle = 0;  ///< share, rad
};

/// Presses at places of a surface along its own normal, and compares with the ideal one.
Errors against(const Snapshot& model, Nearest nearest, const testing::HeldTool& held, double least, double most,
               int presses, double margin, bool exact) {
  const SlabMesh& mesh = model.slab_mesh();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  ServoSettings settings = testing::settings_with(kStiffness);
  settings.force.exact_normals = exact;
  settings.tool = held.tool();
  Errors worst;
  for (int k = 0; k < presses; ++k) {
    const SurfacePoint place =
        surface_point(model, static_cast<SlabId>(unit(random) * mesh.slab_count()), unit(random) / 2, unit(random) / 2);
    const Vec3d p = place.position;
    if (margin > 0 && std::max(std::abs(p.x - 0.5), std::abs(p.z - 0.5)) > 0.5 - margin) continue;
    const Vec3d cursor = p + place.normal * (held.radius - least - (most - least) * unit(random));
    Driver hand(settings, testing::strong_device());
    static_cast<void>(hand.at(model, p + place.normal * (held.radius + 0.01)));
    ServoSample felt = hand.at(model, cursor);
    for (int tick = 0; tick < 200; ++tick) felt = hand.at(model, cursor);
    const Vec3d ideal =
        ideal_push(nearest, held, cursor, place.normal) * (kStiffness * settings.workspace.metres_per_unit);
    worst.force = std::max(worst.force, std::abs(length(felt.force) / length(ideal) - 1));
    worst.angle = std::max(worst.angle, std::atan2(length(cross(felt.force, ideal)), dot(felt.force, ideal)));
  }
  return worst;
}

/// Largest difference of the forces of one motion over one shape, in another unit and at another place; N.
double scaled_difference(const testing::HeldTool& held, double scale, Vec3d centre) {
  const SnapshotPtr here = testing::displaced(
      testing::sphere_shell(2, 32), [](Vec3d p) { return 0.5 + 0.1 * std::sin(7 * p.x) * std::cos(5 * p.y); });
  const SlabMesh& shell = here->slab_mesh();
  SnapshotDraft draft(Snapshot::make(testing::mapped_shell(shell, [&](Vec3d p) { return p * scale + centre; })));
  for (SlabId s = 0; s < shell.slab_count(); ++s)
    draft.put(Layer::Displacement, s, std::make_shared<const Tile>(here->tile(Layer::Displacement, s)));
  const SnapshotPtr there = draft.finish();
  ServoSettings settings = testing::settings_with(kStiffness, 1, 0.3);
  settings.tool = held.tool();
  Driver a(settings, testing::strong_device());
  settings.workspace = {.metres_per_unit = 0.1 / scale, .device_origin = {}, .model_origin = centre};
  testing::HeldTool scaled = held;
  scaled.radius *= scale;
  for (Vec3d& p : scaled.points) p *= scale;
  settings.tool = scaled.tool();
  Driver b(settings, testing::strong_device());
  double worst = 0, most = 0;
  for (int k = 0; k < 6000 / held.dear; ++k) {
    const double turn = 1e-3 * k;
    const Vec3d cursor = normalized(Vec3d{std::sin(turn), 0.4 * std::sin(2.3 * turn), std::cos(turn)}) *
                         (held.radius + 0.99 + 0.06 * std::cos(9 * turn));
    const Vec3d f = a.at(*here, cursor).force, g = b.at(*there, cursor * scale + centre).force;
    worst = std::max(worst, length(f - g));
    most = std::max(most, length(f));
  }
  return most > 0.5 ? worst : std::nan("");
}

}  // namespace

void ground_truth(Report& report) {
  const int presses = report.long_form() ? 100'000 : 2'000;
  const auto sheet = [](double (*height)(Vec3d)) {
    return testing::displaced(testing::plane_shell(8, 64, 0.05), [=](Vec3d p) { return 0.5 + 10 * height(p); });
  };
  const struct {
    const char* name;
    SnapshotPtr model;
    Nearest nearest;
    double least, most, margin;
  } surfaces[] = {
      {"sphere", testing::fine_sphere(), on_sphere, 0.03, 0.08, 0},
      {"plane", sheet([](Vec3d p) { return on_plane(p).y; }), nearest_on_plane, 0.005, 0.03, 0.1},
      {"waves", sheet([](Vec3d p) { return wave(p.x); }), on_wave, 0.02, 0.03, 0.1},
      {"torus", testing::shaped(testing::torus_shell(24, 16, 64), testing::torus_field), on_torus, 0.04, 0.08, 0},
  };
  // Balls and rigid tools of 10 mm.
  const auto tools = testing::held_tools(0.1);
  for (const testing::HeldTool& held : tools)
    for (const auto& s : surfaces) {
      const std::string what = std::string(s.name) + held.name;
      const auto errors = [&](bool exact) {
        return against(*s.model, s.nearest, held, s.least, s.most, presses / held.dear, s.margin, exact);
      };
      const Errors law = errors(false);
      report.at_most(what + ": force off by", law.force, 1e-3);
      if (held.is_point()) {
        report.at_most(what + ": direction off by", law.angle / kDegree, 0.1, "degrees");
        report.shown("    with exact normals, direction off by", errors(true).angle / kDegree, "degrees");
      } else {  // it is that of the micro-triangles
        report.shown(what + ": direction off by", law.angle / kDegree, "degrees");
      }
    }
  for (const testing::HeldTool& held : tools) {
    const auto scaled = [&](const char* what, double scale, Vec3d centre) {
      report.at_most(what + held.name + ": force differs by", scaled_difference(held, scale, centre), 1e-4, "N");
    };
    scaled("the same model in millimetres", 1000, {});
    scaled("in kilometres", 1e-3, {});
    scaled("a thousand diagonals from the origin", 1, {2000, -3000, 1000});
    scaled("in millimetres, far from the origin", 1000, {4e6, 1e6, -2e6});
  }
}

namespace {

/// A recorded trial: place of the tool, and the force that was measured there, both in the world's axes.
struct Recorded {
  std::vector<double> t;
  std::vector<Vec3d> place, force;
};

Vec3d rotated(const std::array<double, 4>& q, Vec3d v) {  // q: w x y z
  const Vec3d u = {q[1], q[2], q[3]};
  const Vec3d twice = cross(u, v) * 2;
  return v + twice * q[0] + cross(u, twice);
}

/// The sensor's axes in the tool's. The files do not say how it sat there; but in all trials its force lies along its
/// z, and the path across the tool's y, and seated like this the force lies across the path in all of them.
Vec3d seated(Vec3d sensor) { return {sensor.x, sensor.z, -sensor.y}; }

/// One row per new pose of the tracker; the force is the mean of the rows since the last one.
Recorded read_trial(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::string header;
  std::getline(file, header);
  Recorded trial;
  std::array<double, 14> row{};
  Vec3d sum;
  int count = 0;
  for (;;) {
    for (double& x : row) file >> x;
    if (!file) break;
    const Vec3d place = {row[1], row[2], row[3]};
    sum += rotated({row[4], row[5], row[6], row[7]}, seated({row[8], row[9], row[10]}));
    ++count;
    if (!trial.place.empty() && trial.place.back() == place) continue;
    trial.t.push_back(row[0]);
    trial.place.push_back(place);
    trial.force.push_back(sum / count);
    sum = {};
    count = 0;
  }
  return trial;
}

std::vector<Vec3d> smoothed(const std::vector<Vec3d>& values, int reach) {
  std::vector<Vec3d> result;
  const int count = static_cast<int>(values.size());
  for (int k = 0; k < count; ++k) {
    Vec3d sum;
    double weight = 0;
    for (int j = std::max(0, k - reach); j <= std::min(count - 1, k + reach); ++j) {
      const double w = reach + 1 - std::abs(k - j);
      sum += values[static_cast<std::size_t>(j)] * w;
      weight += w;
    }
    result.push_back(sum / weight);
  }
  return result;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(q * double(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

/// A ribbon along the path of a trial, 40 mm wide, facing the measured force; of slabs 20 mm thick either way.
SnapshotPtr ribbon(const std::vector<Vec3d>& path, const std::vector<Vec3d>& normals) {
  std::vector<Fibre> fibres;
  std::vector<SlabMesh::Face> slabs;
  const auto count = static_cast<FibreId>(path.size());
  for (FibreId k = 0; k < count; ++k) {
    const Vec3d along = normalized(path[std::min(k + 1, count - 1)] - path[k > 0 ? k - 1 : 0]);
    const Vec3d n = normals[k], across = normalized(cross(along, n));
    for (const double side : {-0.02, 0.02}) {
      const Vec3d p = path[k] + across * side;
      fibres.push_back({p - n * 0.02, p + n * 0.02});
    }
    if (k == 0) continue;
    const FibreId a = 2 * (k - 1), b = a + 1, c = a + 2, d = a + 3;
    slabs.push_back({{a, b, c}, 8});
    slabs.push_back({{b, d, c}, 8});
  }
  auto mesh = SlabMesh::make(std::move(fibres), slabs);
  return mesh ? Snapshot::make(std::make_shared<const SlabMesh>(*std::move(mesh))) : nullptr;
}

}  // namespace

void recorded_motion(Report& report) {
  const std::filesystem::path folder = testing::data_folder() / "contour";
  std::error_code none;
  if (!std::filesystem::exists(folder, none)) return report.skipped("no test data");
  // The trials come without the contour's own mesh. So the surface is what the trial itself says of it: the path of the
  // tool, smoothed, as a ribbon that faces the measured force. The hand goes as deep under it as that force asks of the
  // spring, at each tick as the tracker's 30 Hz are interpolated.
  std::vector<double> off_path, angle, naive_path, naive_angle;
  int trials = 0, lost = 0;
  double askew = 0;
  for (const char letter : {'a', 'b', 'c', 'd', 'e', 'f'})
    for (const char number : {'1', '2'}) {
      const Recorded trial = read_trial(folder / ("demo_" + std::string(1, letter) + "_" + number + ".dat"));
      if (trial.place.size() < 20) continue;
      ++trials;
      const std::vector<Vec3d> path = smoothed(trial.place, 8), felt = smoothed(trial.force, 12);
      // The part of the force across the path; friction lies along it.
      std::vector<Vec3d> normals;
      std::vector<double> along_path;
      for (std::size_t k = 0; k < path.size(); ++k) {
        const Vec3d along = normalized(path[std::min(k + 1, path.size() - 1)] - path[k > 0 ? k - 1 : 0]);
        normals.push_back(normalized(felt[k] - along * dot(felt[k], along)));
        along_path.push_back(std::abs(dot(normalized(felt[k]), along)));
      }
      askew = std::max(askew, quantile(along_path, 0.5));
      // Fewer, longer slabs than the tracker has poses.
      std::vector<Vec3d> few_places, few_normals;
      for (std::size_t k = 0; k < path.size(); k += 4) {
        few_places.push_back(path[k]);
        few_normals.push_back(normals[k]);
      }
      const SnapshotPtr model = ribbon(few_places, few_normals);
      if (!model) continue;
      for (const bool naive : {false, true}) {
        ServoSettings settings = testing::settings_with(4000, 0, 0, 1);
        settings.force.paper_contact = naive;
        Driver hand(settings, testing::strong_device());
        for (int in = 10; in >= 0; --in) static_cast<void>(hand.at(*model, path[2] + normals[2] * (0.001 * in)));
        for (std::size_t k = 2; k + 6 < path.size(); ++k)
          for (int part = 0; part < 33; ++part) {
            const double share = part / 33.0;
            const auto between = [share](Vec3d a, Vec3d b) { return a + (b - a) * share; };
            const Vec3d force = between(trial.force[k], trial.force[k + 1]);
            const Vec3d place = between(path[k], path[k + 1]);
            const Vec3d n = normalized(between(normals[k], normals[k + 1]));
            const ServoSample sample = hand.at(*model, place - n * (length(force) / 4000));
            if (!sample.contact) {
              // Off the ribbon's edge where the path turns sharply: down to it again.
              if (!naive) ++lost;
              hand = Driver(settings, testing::strong_device());
              static_cast<void>(hand.at(*model, place + n * 0.001));
            }
            if (k < 4) continue;
            const double a = sample.contact
                                 ? std::atan2(length(cross(sample.force, force)), dot(sample.force, force)) / kDegree
                                 : 180;
            (naive ? naive_angle : angle).push_back(a);
            (naive ? naive_path : off_path).push_back(length(sample.contact_point - place) * 1e3);
          }
      }
    }
  report.at_least("trials", trials, 12);
  report.at_most("share of the force along the path, p50 of the worst trial", askew, 0.25);
  report.shown("ticks", double(angle.size()));
  report.shown("contact lost over an edge of the ribbon and taken up again", lost);
  for (const double q : {0.5, 0.95}) {
    const std::string which = q < 0.9 ? "p50" : "p95";
    report.shown("contact point off the tool's path, " + which, quantile(off_path, q), "mm");
    report.shown("    the paper's contact", quantile(naive_path, q), "mm");
    report.shown("force off the measured direction, friction included, " + which, quantile(angle, q), "degrees");
    report.shown("    the paper's contact", quantile(naive_angle, q), "degrees");
  }
}

}  // namespace relief::acceptance
