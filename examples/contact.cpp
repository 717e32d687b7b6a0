// Draws what the surface contact point does at an ear, at a crease, at a slab border, and when a carving lands under
// the tip: sections of models, ways of the tool, contact points and forces. Writes contact-*.svg into the folder that
// is named, or where it is started. Everything in them is the libraries' own answer.
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/edit/editor.h>
#include <relief/haptics/servo.h>
#include <relief/mesh/samples.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using relief::SnapshotPtr;
using relief::Vec3d;

/// A plane through a model, and the window of it that a picture shows; model units.
struct Section {
  Vec3d origin, right, up;  ///< the middle of the window; two unit vectors
  double width = 1;
  [[nodiscard]] Vec3d at(double x, double y) const { return origin + right * x + up * y; }
  [[nodiscard]] double height(Vec3d p) const { return dot(p - origin, cross(right, up)); }
};

/// Where the plane cuts triangles: lines from one to the next, closed where the surface is.
std::vector<std::vector<Vec3d>> cut(const std::vector<Vec3d>& positions,
                                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                                    const Section& section) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<double> heights;
  heights.reserve(positions.size());
  for (const Vec3d p : positions) heights.push_back(section.height(p));
  std::map<Edge, Edge>
      next;  // from the edge over which the plane comes into a triangle to the one over which it leaves
  for (const auto& t : triangles) {
    Edge in, out;
    int crossed = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if ((heights[a] < 0) == (heights[b] < 0)) continue;
      (heights[a] < 0 ? in : out) = std::minmax(a, b);
      ++crossed;
    }
    if (crossed == 2) next[in] = out;
  }
  const auto place = [&](Edge e) {
    const double a = heights[e.first], b = heights[e.second];
    return positions[e.first] + (positions[e.second] - positions[e.first]) * (a / (a - b));
  };
  std::vector<std::vector<Vec3d>> lines;
  while (!next.empty()) {
    std::vector<Vec3d>& line = lines.emplace_back();
    Edge edge = next.begin()->first;
    for (auto found = next.begin(); found != next.end(); found = next.find(edge)) {
      line.push_back(place(edge));
      edge = found->second;
      next.erase(found);
    }
    line.push_back(place(edge));
  }
  return lines;
}

std::vector<std::vector<Vec3d>> cut(const relief::Snapshot& model, const Section& section) {
  const relief::Tessellation surface = tessellate(model);
  return cut(surface.positions, surface.triangles, section);
}

/// One SVG file.
class Picture {
 public:
  static constexpr double kWide = 720, kHigh = 400;
  static constexpr std::string_view kInk = "#57534e", kClay = "#d9cdbf", kTool = "#2563eb", kPoint = "#dc2626",
                                    kForce = "#15803d", kSlab = "#a8a29e";

  explicit Picture(const Section& section) : section_(section) {}

  void material(const std::vector<std::vector<Vec3d>>& outline) {
    std::string path;
    for (const auto& line : outline) path += way(line) += 'Z';
    add(fmt::format(R"(<path d="{}" fill="{}" fill-rule="evenodd" stroke="{}" stroke-width="1.6"/>)", path, kClay,
                    kInk));
  }
  void line(const std::vector<Vec3d>& points, std::string_view colour, double width = 1.4,
            std::string_view dashes = "") {
    if (points.size() < 2) return;
    add(fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="{:.1f}" stroke-dasharray="{}"/>)",
                    way(points), colour, width, dashes));
  }
  void dot_at(Vec3d p, std::string_view colour, double radius = 3.2) {
    const auto [x, y] = pixel(p);
    circle(x, y, radius, colour);
  }
  /// From a place along the force, so many pixels per newton.
  void force(Vec3d from, Vec3d newton, double pixels = 34) {
    const auto [x, y] = pixel(from);
    const double dx = dot(newton, section_.right) * pixels, dy = -dot(newton, section_.up) * pixels;
    const double size = std::hypot(dx, dy);
    if (size < 2) return;
    const double ux = dx / size, uy = dy / size;
    const auto point = [&](double along, double aside) {
      return fmt::format("{:.1f} {:.1f}", x + ux * along - uy * aside, y + uy * along + ux * aside);
    };
    add(fmt::format(R"(<path d="M{}L{}" stroke="{}" stroke-width="1.8"/><path d="M{}L{}L{}Z" fill="{}"/>)", point(0, 0),
                    point(size - 5, 0), kForce, point(size, 0), point(size - 7, 3.2), point(size - 7, -3.2), kForce));
  }
  /// Where the tool was, where the contact point was, and the force.
  void moment(const relief::ServoSample& felt) {
    if (felt.contact) line({felt.cursor, felt.contact_point}, kPoint, 1, "3 2");
    force(felt.cursor, felt.force);
    dot_at(felt.cursor, kTool);
    if (felt.contact) dot_at(felt.contact_point, kPoint);
  }
  void text(double x, double y, std::string_view words) {
    add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="{}">{}</text>)", x, y, kInk, words));
  }
  /// What the colours mean.
  void legend() {
    const std::array<std::pair<std::string_view, const char*>, 3> entries = {
        {{kTool, "tool"}, {kPoint, "surface contact point"}, {kForce, "force on the hand"}}};
    add(fmt::format(R"(<rect x="0" y="{:.1f}" width="{:.1f}" height="34" fill="#fafaf9"/>)", kHigh - 34, kWide));
    double x = 16;
    for (const auto& [colour, words] : entries) {
      circle(x, kHigh - 16, 4, colour);
      text(x + 10, kHigh - 11, words);
      x += 40 + 8.0 * static_cast<double>(std::string_view(words).size());
    }
  }
  void circle(double x, double y, double radius, std::string_view colour) {
    add(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}"/>)", x, y, radius, colour));
  }
  void add(std::string_view element) { body_ += fmt::format("  {}\n", element); }
  [[nodiscard]] bool save(const std::filesystem::path& file, std::string_view label) const {
    std::ofstream out(file);
    out << fmt::format(
        R"svg(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" font-family="sans-serif" font-size="14" role="img" aria-label="{2}">
  <clipPath id="frame"><rect width="{0}" height="{1}" rx="8"/></clipPath>
  <g clip-path="url(#frame)">
  <rect width="{0}" height="{1}" fill="#fafaf9"/>
{3}  </g>
</svg>
)svg",
        kWide, kHigh, label, body_);
    return out.good();
  }

 private:
  [[nodiscard]] std::array<double, 2> pixel(Vec3d p) const {
    const double scale = kWide / section_.width;
    return {kWide / 2 + dot(p - section_.origin, section_.right) * scale,
            kHigh / 2 - dot(p - section_.origin, section_.up) * scale};
  }
  [[nodiscard]] std::string way(const std::vector<Vec3d>& points) const {
    std::string path;
    for (const Vec3d p : points) {
      const auto [x, y] = pixel(p);
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x, y);
    }
    return path;
  }

  Section section_;
  std::string body_;
};

/// A hand without weight that leads the tool along places in the model, 1 ms apart.
class Hand {
 public:
  explicit Hand(const relief::Snapshot& model)
      : space_(relief::fit_workspace(device_, model.slab_mesh().bounds())),
        servo_({.workspace = space_, .force = {.damping = 0, .guard = false}}, device_) {}
  relief::ServoSample at(const relief::Snapshot& model, Vec3d place) {
    return servo_.step(model, {.t = t_ += 1e-3, .position = space_.to_device(place), .velocity = {}});
  }

 private:
  relief::DeviceInfo device_ = {.max_force = 20};
  relief::Workspace space_;
  relief::Servo servo_;
  double t_ = 0;
};

/// Leads the tool along straight pieces between places of the section and draws every so many ticks.
void lead(Picture& picture, const relief::Snapshot& model, const Section& section,
          const std::vector<std::array<double, 2>>& places, double step, int apart) {
  Hand hand(model);
  std::vector<Vec3d> way, points;
  std::vector<relief::ServoSample> shown;
  int tick = 0;
  for (std::size_t k = 0; k + 1 < places.size(); ++k) {
    const Vec3d a = section.at(places[k][0], places[k][1]), b = section.at(places[k + 1][0], places[k + 1][1]);
    const int steps = std::max(1, static_cast<int>(length(b - a) / step));
    for (int i = 0; i < steps; ++i, ++tick) {
      const relief::ServoSample felt = hand.at(model, a + (b - a) * (double(i) / steps));
      way.push_back(felt.cursor);
      if (felt.contact) points.push_back(felt.contact_point);
      if (tick % apart == apart / 2) shown.push_back(felt);
    }
  }
  picture.line(way, Picture::kTool, 1.6);
  picture.line(points, Picture::kPoint, 2.2);
  for (const relief::ServoSample& felt : shown) picture.moment(felt);
}

SnapshotPtr sample(const char* name) {
  const auto mesh = relief::make_sample(name, 60'000);
  if (!mesh) return nullptr;
  const auto made = relief::convert(*mesh, {.slabs = 200, .intervals = 32});
  return made ? made->model.head : nullptr;
}

/// Floors, ceilings and walls of the slabs, cut by the plane.
std::vector<std::vector<Vec3d>> cut_slabs(const relief::SlabMesh& mesh, const Section& section) {
  std::vector<std::vector<Vec3d>> lines;
  for (relief::SlabId s = 0; s < mesh.slab_count(); ++s) {
    const relief::SlabCorners c = mesh.corners(s);
    const std::vector<Vec3d> corners = {c.inner[0], c.inner[1], c.inner[2], c.outer[0], c.outer[1], c.outer[2]};
    std::vector<std::array<std::uint32_t, 3>> sides = {{0, 2, 1}, {3, 4, 5}};
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t m = (k + 1) % 3;
      sides.push_back({k, m, m + 3});
      sides.push_back({k, m + 3, k + 3});
    }
    for (auto& line : cut(corners, sides, section)) lines.push_back(std::move(line));
  }
  return lines;
}

bool ear(const relief::Snapshot& head, const std::filesystem::path& folder) {
  const Section section = {{26, 57, -5.5}, {1, 0, 0}, {0, 0, -1}, 26};
  Picture picture(section);
  picture.material(cut(head, section));
  lead(picture, head, section, {{1.9, -3.8}, {-0.8, 3.4}, {-0.2, 3.4}, {2.6, -3.8}}, 0.02, 40);
  picture.legend();
  return picture.save(folder / "contact-ear.svg",
                      "The tool goes through an ear; the contact point stays on the face that it came from");
}

bool crease(const relief::Snapshot& pumpkin, const std::filesystem::path& folder) {
  const Section section = {{3, 45, -50}, {1, 0, 0}, {0, 0, -1}, 46};
  Picture picture(section);
  picture.material(cut(pumpkin, section));
  lead(picture, pumpkin, section, {{-12, 10}, {-12, 0}, {14, 0}, {14, 10}}, 0.05, 36);
  picture.legend();
  return picture.save(folder / "contact-crease.svg", "The tool slides over a crease below the surface");
}

bool border(const relief::Snapshot& pumpkin, const std::filesystem::path& folder) {
  const Section section = {{56, 45, -2}, {0, 0, -1}, {1, 0, 0}, 46};
  Picture picture(section);
  picture.material(cut(pumpkin, section));
  for (const auto& line : cut_slabs(pumpkin.slab_mesh(), section)) picture.line(line, Picture::kSlab, 1);
  lead(picture, pumpkin, section, {{-10, 6}, {-10, 0}, {12, 0}, {12, 6}}, 0.05, 40);
  picture.legend();
  return picture.save(folder / "contact-border.svg", "The tool slides from slab to slab");
}

/// The tool rests; after 20 ticks a dab takes half of what is above it away. Beside the section, the force.
bool carving(const SnapshotPtr& pumpkin, const std::filesystem::path& folder) {
  const Section section = {{60, 45, -2}, {0, 0, -1}, {1, 0, 0}, 18};
  Picture picture(section);
  Hand hand(*pumpkin);
  const Vec3d tool =
      section.at(0, -2.8 + dot(relief::closest_point(*pumpkin, section.origin).position - section.origin, section.up));
  for (double above = 3; above > 0; above -= 0.02) hand.at(*pumpkin, tool + section.up * above);
  const relief::ServoSample before = hand.at(*pumpkin, tool);
  relief::Editor editor(pumpkin);
  editor.begin_stroke({.tool = relief::Tool::Carve, .radius = 5});
  editor.dab({.slab = before.at.slab,
              .contact = before.contact_point,
              .cursor = before.contact_point - before.normal * 1.4,
              .normal = before.normal});
  editor.end_stroke();
  std::vector<double> force;
  relief::ServoSample after = before;
  constexpr int kDab = 20, kTicks = 140;
  for (int k = 0; k < kTicks; ++k) {
    after = hand.at(k < kDab ? *pumpkin : *editor.head(), tool);
    force.push_back(length(after.force));
  }
  picture.material(cut(*editor.head(), section));
  for (const auto& line : cut(*pumpkin, section)) picture.line(line, Picture::kSlab, 1.4, "5 4");
  picture.moment(before);
  picture.moment(after);
  constexpr double kLeft = 430, kBase = 136;
  std::string trace;
  for (std::size_t k = 0; k < force.size(); ++k)
    trace += fmt::format("{}{:.1f} {:.1f}", k == 0 ? 'M' : 'L', kLeft + 10 + 1.8 * static_cast<double>(k),
                         kBase - 110 * force[k]);
  picture.add(fmt::format(R"(<rect x="{0}" y="12" width="280" height="150" rx="6" fill="#ffffff" fill-opacity="0.9"/>)",
                          kLeft));
  picture.add(
      fmt::format(R"(<path d="M{0} {1}H{2}" stroke="{3}"/><path d="{4}" fill="none" stroke="{5}" stroke-width="2"/>)",
                  kLeft + 10, kBase, kLeft + 270, Picture::kInk, trace, Picture::kForce));
  picture.text(kLeft + 10, 32, fmt::format("force, {:.2f} N to {:.2f} N", force.front(), force.back()));
  picture.text(kLeft + 10 + 1.8 * kDab, kBase + 15, fmt::format("the dab; then {} ms", kTicks - kDab));
  picture.legend();
  return picture.save(folder / "contact-carving.svg",
                      "A carving lands under the resting tool; the force falls smoothly");
}

}  // namespace

int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : ".";
  const SnapshotPtr head = sample("head"), pumpkin = sample("pumpkin");
  if (!head || !pumpkin) return 1;
  return ear(*head, folder) && crease(*pumpkin, folder) && border(*pumpkin, folder) && carving(pumpkin, folder) ? 0 : 1;
}
