// Draws what holds the tool: a contact point at an edge, past the middle of a thin part and beside its edge, and a ball
// over a groove. Each picture is a section through a body that lies along z. Outlines, contact points and forces are
// the libraries' own answers; grey is what another rule would do. Writes contact-*.svg into the folder that is named,
// or where it is started.
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/core/tessellate.h>
#include <relief/haptics/servo.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

using relief::SnapshotPtr;
using relief::Vec3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSection = 0.01;  // z of the plane that is drawn: off the corners of the bodies' triangles

Vec3d at(double x, double y) { return {x, y, kSection}; }

using Polygon = std::vector<std::array<double, 2>>;
using Triangles = std::vector<std::array<Vec3d, 3>>;

/// What the polygon sweeps out between z = -half_length and half_length. All of it can be seen from the middle; its
/// corners go counter-clockwise in x and y.
Triangles swept(const Polygon& polygon, double half_length, std::array<double, 2> middle = {0, 0}) {
  Triangles triangles;
  const auto [x, y] = middle;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const auto [ax, ay] = polygon[k];
    const auto [bx, by] = polygon[(k + 1) % polygon.size()];
    const Vec3d a = {ax, ay, -half_length}, b = {bx, by, -half_length};
    const Vec3d c = {bx, by, half_length}, d = {ax, ay, half_length};
    triangles.insert(triangles.end(),
                     {{a, b, c}, {a, c, d}, {b, a, {x, y, -half_length}}, {d, c, {x, y, half_length}}});
  }
  return triangles;
}

/// The triangles converted, after each was cut in four, so many times.
SnapshotPtr converted(Triangles triangles, int times) {
  for (; times > 0; --times) {
    Triangles finer;
    for (const auto& [a, b, c] : triangles) {
      const Vec3d ab = (a + b) * 0.5, bc = (b + c) * 0.5, ca = (c + a) * 0.5;
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  relief::TriangleMesh mesh;
  for (const auto& corners : triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  const auto made = relief::convert(mesh, {.slabs = 100, .intervals = 16});
  return made ? made->model.head : nullptr;
}

SnapshotPtr solid(const Polygon& polygon, double half_length, int times) {
  return converted(swept(polygon, half_length), times);
}

struct Outline {
  std::vector<Vec3d> points;
  bool closed = true;  ///< else it goes from rim to rim of a sheet
};

/// Where the plane of the section cuts the surface.
std::vector<Outline> outlines(const relief::Snapshot& model) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  const relief::Tessellation surface = tessellate(model);
  const auto height = [&](std::uint32_t corner) { return surface.positions[corner].z - kSection; };
  std::map<Edge, Edge> next;  // from the edge over which the plane comes into a triangle to that over which it leaves
  for (const auto& t : surface.triangles) {
    Edge in, out;
    int crossed = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if ((height(a) < 0) == (height(b) < 0)) continue;
      (height(a) < 0 ? in : out) = std::minmax(a, b);
      ++crossed;
    }
    if (crossed == 2) next[in] = out;
  }
  std::set<Edge> entered;
  for (const auto& [in, out] : next) entered.insert(out);
  std::vector<Outline> lines;
  while (!next.empty()) {
    const auto rim = std::ranges::find_if(next, [&](const auto& over) { return !entered.contains(over.first); });
    Outline& line = lines.emplace_back();
    line.closed = rim == next.end();
    const auto add = [&](const Edge& edge) {
      const Vec3d a = surface.positions[edge.first], b = surface.positions[edge.second];
      line.points.push_back(a + (b - a) * (height(edge.first) / (height(edge.first) - height(edge.second))));
    };
    Edge edge = (line.closed ? next.begin() : rim)->first;
    for (auto found = next.find(edge); found != next.end(); found = next.find(edge)) {
      add(edge);
      edge = found->second;
      next.erase(found);
    }
    if (!line.closed) add(edge);
  }
  return lines;
}

/// A window of the plane, so many model units wide; with its legend below it is one SVG file.
class Picture {
 public:
  static constexpr double kWide = 720, kHigh = 364, kFoot = 36;
  static constexpr std::string_view kPaper = "#fafaf9", kInk = "#44403c", kClay = "#d9cdbf", kTool = "#2563eb",
                                    kPoint = "#dc2626", kForce = "#15803d", kOther = "#8a817a";

  /// The window is `width` model units wide, and so many pixels wide and high.
  Picture(Vec3d middle, double width, double wide = kWide, double high = kHigh)
      : middle_(middle), scale_(wide / width), wide_(wide), high_(high) {}

  /// What closed lines bound is clay; a sheet is a line.
  void body(const relief::Snapshot& model) {
    std::string path;
    for (const auto& [points, closed] : outlines(model)) {
      if (closed)
        path += way(points) += 'Z';
      else
        line(points, kInk, 2.4);
    }
    add(fmt::format(R"(<path d="{}" fill="{}" stroke="{}" stroke-width="1.6"/>)", path, kClay, kInk));
  }
  void line(const std::vector<Vec3d>& points, std::string_view colour, double width = 1.4,
            std::string_view dashes = "none") {
    if (points.size() < 2) return;
    add(fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="{:.1f}" stroke-dasharray="{}"/>)",
                    way(points), colour, width, dashes));
  }
  void dot_at(Vec3d p, std::string_view colour) {
    const auto [x, y] = pixel(p);
    circle(x, y, 3.6, colour);
  }
  /// Not filled.
  void ring_at(Vec3d p, std::string_view colour) {
    const auto [x, y] = pixel(p);
    add(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="4" fill="{}" stroke="{}" stroke-width="1.6"/>)", x, y, kPaper,
                    colour));
  }
  /// An arrow that is so many pixels long.
  void arrow(Vec3d from, Vec3d way, double size, std::string_view colour) {
    const auto [x, y] = pixel(from);
    const double far = std::hypot(way.x, way.y), ux = way.x / far, uy = -way.y / far;
    const auto point = [&](double along, double aside) {
      return fmt::format("{:.1f} {:.1f}", x + ux * along - uy * aside, y + uy * along + ux * aside);
    };
    add(fmt::format(R"(<path d="M{}L{}" stroke="{}" stroke-width="2"/><path d="M{}L{}L{}Z" fill="{}"/>)", point(0, 0),
                    point(size - 6, 0), colour, point(size, 0), point(size - 8, 3.8), point(size - 8, -3.8), colour));
  }
  /// Where the tool was, where the contact point was, and the force: so many pixels per newton.
  void moment(const relief::ServoSample& felt, double pixels) {
    if (felt.contact) line({felt.cursor, felt.contact_point}, kPoint, 1, "3 2");
    if (const double size = length(felt.force) * pixels; size > 8) arrow(felt.cursor, felt.force, size, kForce);
    dot_at(felt.cursor, kTool);
    if (felt.contact) dot_at(felt.contact_point, kPoint);
  }
  /// The outline of a ball.
  void ball(Vec3d centre, double radius, std::string_view colour) {
    const auto [x, y] = pixel(centre);
    add(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="none" stroke="{}" stroke-width="1.6"/>)", x, y,
                    radius * scale_, colour));
  }
  /// Beginning at a place.
  void text(Vec3d place, std::string_view words) {
    const auto [x, y] = pixel(place);
    add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="{}">{}</text>)", x, y, kInk, words));
  }
  /// What the colours mean: `held` is red, `other` grey.
  void legend(std::string_view other, std::string_view held = "contact point") {
    add(fmt::format(R"(<rect y="{}" width="{}" height="{}" fill="{}"/>)", high_, wide_, kFoot, kPaper));
    double x = 18;
    for (const auto& [colour, words] : std::array<std::pair<std::string_view, std::string_view>, 4>{
             {{kTool, "tool"}, {kPoint, held}, {kForce, "force on the hand"}, {kOther, other}}}) {
      if (words.empty()) continue;
      circle(x, high_ + kFoot / 2, 4.5, colour);
      add(fmt::format(R"(<text x="{:.1f}" y="{:.1f}" fill="{}">{}</text>)", x + 11, high_ + kFoot / 2 + 5, kInk,
                      words));
      x += 46 + 7.6 * static_cast<double>(words.size());
    }
  }
  /// Another picture with its upper left corner here, and what it shows in words under it.
  void panel(const Picture& other, double left, double top, std::string_view words) {
    add(fmt::format(R"(<svg x="{0}" y="{1}" width="{2}" height="{3}">
{4}  </svg>
  <rect x="{0}" y="{1}" width="{2}" height="{3}" fill="none" stroke="#e2ddd6"/>
  <text x="{5}" y="{6}" fill="{7}" font-size="14">{8}</text>)",
                    left, top, other.wide_, other.high_, other.body_, left + 8, top + other.high_ + 19, kInk, words));
  }
  [[nodiscard]] bool save(const std::filesystem::path& file, std::string_view label) const {
    std::ofstream out(file);
    out << fmt::format(
        R"svg(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {0} {1}" font-family="sans-serif" font-size="15" role="img" aria-label="{2}">
  <clipPath id="frame"><rect width="{0}" height="{1}" rx="8"/></clipPath>
  <g clip-path="url(#frame)">
  <rect width="{0}" height="{1}" fill="{3}"/>
{4}  </g>
</svg>
)svg",
        wide_, high_ + kFoot, label, kPaper, body_);
    return out.good();
  }

 private:
  void add(std::string_view element) { body_ += fmt::format("  {}\n", element); }
  void circle(double x, double y, double radius, std::string_view colour) {
    add(fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="{}"/>)", x, y, radius, colour));
  }
  [[nodiscard]] std::array<double, 2> pixel(Vec3d p) const {
    return {wide_ / 2 + (p.x - middle_.x) * scale_, high_ / 2 - (p.y - middle_.y) * scale_};
  }
  /// Through the places, but for those that are within half a pixel of the last.
  [[nodiscard]] std::string way(const std::vector<Vec3d>& points) const {
    std::string path;
    std::array<double, 2> last = {};
    for (const Vec3d p : points) {
      const auto [x, y] = pixel(p);
      if (!path.empty() && &p != &points.back() && std::hypot(x - last[0], y - last[1]) < 0.5) continue;
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? 'M' : 'L', x, y);
      last = {x, y};
    }
    return path;
  }

  Vec3d middle_;
  double scale_;  ///< pixels per model unit
  double wide_, high_;
  std::string body_;
};

/// A hand without weight leads the tool along straight pieces, by `step` in each millisecond. What was felt in each.
std::vector<relief::ServoSample> led(const relief::Snapshot& model, const std::vector<Vec3d>& corners, double step,
                                     double radius = 0) {
  const relief::DeviceInfo device = {.max_force = 1000, .max_stiffness = 1000, .max_force_rate = 1e6};
  const relief::Workspace space = relief::fit_workspace(device, model.slab_mesh().bounds());
  relief::Servo servo(
      {.workspace = space, .force = {.damping = 0, .exact_normals = true, .guard = false}, .tool = {.radius = radius}},
      device);
  std::vector<relief::ServoSample> felt;
  double t = 0;
  for (std::size_t k = 0; k + 1 < corners.size(); ++k) {
    const Vec3d a = corners[k], way = corners[k + 1] - a;
    const int steps = std::max(1, static_cast<int>(length(way) / step));
    for (int i = 0; i < steps; ++i)
      felt.push_back(servo.step(
          model, {.t = t += 1e-3, .position = space.to_device(a + way * (double(i) / steps)), .velocity = {}}));
  }
  return felt;
}

/// Both ways, and `count` moments of them at even distances in time while there is contact.
void draw(Picture& picture, const std::vector<relief::ServoSample>& felt, std::size_t count, double pixels) {
  std::vector<Vec3d> tool;
  std::vector<std::vector<Vec3d>> points(1);  // one line per contact
  std::vector<relief::ServoSample> touching;
  for (const relief::ServoSample& now : felt) {
    tool.push_back(now.cursor);
    if (!now.contact) {
      if (!points.back().empty()) points.emplace_back();
      continue;
    }
    points.back().push_back(now.contact_point);
    touching.push_back(now);
  }
  picture.line(tool, Picture::kTool, 1.6);
  for (const auto& line : points) picture.line(line, Picture::kPoint, 2.4);
  for (std::size_t k = 0; k < count; ++k) picture.moment(touching[touching.size() * (2 * k + 1) / (2 * count)], pixels);
}

/// A prism of six sides, an edge of it on top.
bool edge(const std::filesystem::path& folder) {
  Polygon hexagon;
  for (int k = 0; k < 6; ++k) hexagon.push_back({0.5 * std::sin(-k * kPi / 3), 0.5 * std::cos(-k * kPi / 3)});
  const SnapshotPtr prism = solid(hexagon, 0.3, 4);
  if (!prism) return false;
  // At this depth below both sides.
  constexpr double kDeep = 0.06, kAway = 0.3;
  const double slope = std::sqrt(1.0 / 3), top = 0.5 - kDeep * 2 * slope;
  const Vec3d in = at(-kAway, top - kAway * slope), corner = at(0, top), end = at(kAway, top - kAway * slope);
  const Vec3d up = at(0, 0.15) - at(0, 0);
  const auto felt = led(*prism, {in + up, in, corner, end, end + up}, 4e-4);
  Picture picture(at(0, 0.4), 0.9);
  picture.body(*prism);
  // A rule that lets the contact point round no edge of 60 degrees holds it there.
  for (const double x : {0.12, 0.19, 0.26})
    picture.line({at(x, top - x * slope), at(0, 0.5)}, Picture::kOther, 1.4, "2 3");
  draw(picture, felt, 10, 12);
  picture.ring_at(at(0, 0.5), Picture::kOther);
  picture.text(at(-0.07, 0.53), "here it would stick");
  picture.legend("stuck: deeper and deeper");
  return picture.save(folder / "contact-edge.svg",
                      "The tool slides under an edge of a prism, and the contact point rounds the edge with it");
}

/// A plate that is thinner than the tool is deep.
bool thin(const std::filesystem::path& folder) {
  const SnapshotPtr plate = solid({{-0.5, -0.06}, {0.5, -0.06}, {0.5, 0.06}, {-0.5, 0.06}}, 0.4, 3);
  if (!plate) return false;
  const auto felt = led(*plate, {at(-0.25, 0.2), at(-0.25, -0.14), at(0.25, -0.14), at(0.25, 0.2)}, 4e-4);
  Picture picture(at(0, 0.01), 0.9);
  picture.body(*plate);
  picture.line({at(-0.5, 0), at(0.5, 0)}, Picture::kInk, 1, "8 4 2 4");
  for (const double x : {-0.15, -0.05, 0.05, 0.15}) {
    const Vec3d tool = at(x, -0.14), nearest = relief::closest_point(*plate, tool).position;
    picture.line({tool, nearest}, Picture::kOther, 1.2, "2 3");
    picture.ring_at(nearest, Picture::kOther);
  }
  draw(picture, felt, 9, 10);
  picture.text(at(0.32, 0.01), "middle");
  picture.legend("nearest place: out at the back");
  return picture.save(folder / "contact-thin.svg",
                      "The tool is pressed through a plate; the contact point stays on the face that it went in by");
}

/// A rounded finger, pressed near its middle and beside its edge.
bool side(const std::filesystem::path& folder) {
  Polygon oval;
  for (int k = 0; k < 64; ++k) oval.push_back({0.2 * std::cos(k * kPi / 32), 0.13 * std::sin(k * kPi / 32)});
  const SnapshotPtr finger = solid(oval, 0.4, 1);
  if (!finger) return false;
  Picture picture(at(0, 0), 0.8);
  picture.body(*finger);
  picture.line({at(-0.2, 0), at(0.2, 0)}, Picture::kInk, 1, "8 4 2 4");
  draw(picture, led(*finger, {at(-0.05, 0.19), at(-0.05, -0.16)}, 4e-4), 5, 10);
  draw(picture, led(*finger, {at(0.14, 0.19), at(0.14, -0.16)}, 4e-4), 7, 10);
  picture.text(at(-0.36, 0.16), "held on the face pressed");
  picture.text(at(0.17, 0.16), "rolls round the edge");
  picture.text(at(0.22, -0.007), "middle");
  picture.legend("");
  return picture.save(folder / "contact-side.svg",
                      "Pressed near the middle the contact point holds; beside the edge it goes to the other side");
}

/// A groove that is too narrow at its foot for the ball of a tool.
bool groove(const std::filesystem::path& folder) {
  const SnapshotPtr block =
      solid({{-0.5, -0.2}, {0.5, -0.2}, {0.5, 0.3}, {0.1, 0.3}, {0, 0.1}, {-0.1, 0.3}, {-0.5, 0.3}}, 0.3, 3);
  if (!block) return false;
  constexpr double kRadius = 0.06, kHigh = 0.2;
  const auto felt = led(*block, {at(-0.3, 0.5), at(-0.3, kHigh), at(0.3, kHigh), at(0.3, 0.5)}, 4e-4, kRadius);
  Picture picture(at(0, 0.28), 0.9);
  picture.body(*block);
  std::vector<Vec3d> tool, centres;
  std::vector<std::array<Vec3d, 2>> touching;
  for (const relief::ServoSample& now : felt) {
    tool.push_back(now.cursor);
    if (!now.contact) continue;
    // Without friction and damping the force points from the hand's place to the centre of the ball.
    const double size = length(now.force);
    centres.push_back(size > 0 ? now.cursor + now.force * (now.depth / size) : now.cursor);
    touching.push_back({now.cursor, centres.back()});
  }
  picture.line(tool, Picture::kTool, 1.6);
  picture.line(centres, Picture::kPoint, 2.4);
  constexpr std::size_t kMoments = 7;
  for (std::size_t k = 0; k < kMoments && !touching.empty(); ++k) {
    const auto [hand, centre] = touching[touching.size() * (2 * k + 1) / (2 * kMoments)];
    if (length(centre - hand) > 0) picture.arrow(hand, centre - hand, 46, Picture::kForce);
    picture.ball(centre, kRadius, Picture::kPoint);
    picture.dot_at(centre, Picture::kPoint);
    picture.dot_at(hand, Picture::kTool);
  }
  picture.legend("", "centre of the ball");
  return picture.save(
      folder / "contact-ball.svg",
      "A ball is led over a groove: its centre stays a radius away from the surface, on both sides at once");
}

Polygon box(double left, double bottom, double right, double top) {
  return {{left, bottom}, {right, bottom}, {right, top}, {left, top}};
}

Polygon oval(double wide, double high, int corners) {
  Polygon polygon;
  for (int k = 0; k < corners; ++k) {
    const double angle = k * 2 * kPi / corners;
    polygon.push_back({wide * std::cos(angle), high * std::sin(angle)});
  }
  return polygon;
}

/// An arch: half of a tube's wall, without a thickness. Its face is outside.
Triangles arch(double radius, double half_length) {
  Triangles triangles;
  constexpr int kPieces = 24;
  for (int k = 0; k < kPieces; ++k) {
    const double from = k * kPi / kPieces, to = (k + 1) * kPi / kPieces;
    const auto corner = [&](double angle, double z) {
      return Vec3d{radius * std::cos(angle), radius * std::sin(angle), z};
    };
    const Vec3d a = corner(from, -half_length), b = corner(to, -half_length);
    const Vec3d c = corner(to, half_length), d = corner(from, half_length);
    triangles.insert(triangles.end(), {{a, b, c}, {a, c, d}});
  }
  return triangles;
}

/// Places where two answers are right, or none that all hands would expect: eight sections.
bool ambiguous(const std::filesystem::path& folder) {
  constexpr double kWide = 354, kHigh = 196, kAside = 366, kDown = 228;
  Picture all(at(0, 0), 1, Picture::kWide, 4 * kDown);
  int panels = 0;
  // `other`: where the contact point could be as well at the end of the way.
  const auto panel = [&](const SnapshotPtr& model, Vec3d middle, double width, const std::vector<Vec3d>& corners,
                         std::string_view words,
                         Vec3d (*other)(const relief::Snapshot&, const relief::ServoSample&) = nullptr) {
    if (!model) return false;
    Picture picture(middle, width, kWide, kHigh);
    picture.body(*model);
    const auto felt = led(*model, corners, 1e-4);
    if (other != nullptr) {
      const Vec3d place = other(*model, felt.back());
      picture.line({felt.back().cursor, place}, Picture::kOther, 1.2, "2 3");
      picture.ring_at(place, Picture::kOther);
    }
    draw(picture, felt, 8, 8);
    all.panel(picture, panels % 2 * kAside, panels / 2 * kDown, words);
    ++panels;
    return true;
  };
  const auto both = [](Triangles one, const Triangles& other) {
    one.insert(one.end(), other.begin(), other.end());
    return converted(std::move(one), 3);
  };
  const SnapshotPtr finger = solid(oval(0.2, 0.13, 64), 0.4, 1), rod = solid(oval(0.12, 0.12, 64), 0.4, 1);
  const double slope = std::tan(kPi / 12), side = std::sqrt(0.75);
  const SnapshotPtr wedge = solid({{0.4, 0}, {-0.6, slope}, {-0.6, -slope}}, 0.4, 3);
  const SnapshotPtr plate = solid(box(-0.3, -0.02, 0.3, 0.02), 0.3, 3);
  const SnapshotPtr roof =
      solid({{0.4 * side, -0.3}, {0.4 * side, 0.2}, {0, 0.4}, {-0.4 * side, 0.2}, {-0.4 * side, -0.3}}, 0.3, 3);
  const SnapshotPtr sheets =
      both(swept(box(-0.4, 0.06, 0.05, 0.1), 0.3, {-0.17, 0.08}), swept(box(-0.4, -0.16, 0.4, -0.04), 0.3, {0, -0.1}));
  const SnapshotPtr hole =
      both(swept(box(-0.4, -0.03, -0.05, 0.03), 0.3, {-0.2, 0}), swept(box(0.1, -0.03, 0.4, 0.03), 0.3, {0.25, 0}));
  const SnapshotPtr shell = converted(arch(0.25, 0.3), 2);
  const bool drawn =
      panel(finger, at(0, 0), 0.8, {at(0.14, 0.2), at(0.14, -0.07)}, "A finger, off its middle: contact rolls off") &&
      panel(rod, at(0, 0), 0.7, {at(0, 0.17), at(0, -0.06), at(0.07, -0.06)}, "A rod, past its middle: either side",
            [](const relief::Snapshot& model, const relief::ServoSample& last) {
              return relief::closest_point(model, last.cursor).position;
            }) &&
      panel(wedge, at(0.2, 0), 0.7, {at(0.2, 0.14), at(0.2, -0.08), at(0.5, -0.08)},
            "A wedge, past its edge: contact ends") &&
      panel(plate, at(0.2, -0.05), 0.5, {at(0.24, 0.06), at(0.3, -0.14)},
            "A plate, aslant: contact creeps to the rim") &&
      panel(roof, at(0, 0.25), 0.6, {at(0, 0.5), at(0, 0.1)}, "Straight into an edge: either side",
            [](const relief::Snapshot&, const relief::ServoSample& last) {
              return at(-last.contact_point.x, last.contact_point.y);
            }) &&
      panel(sheets, at(0, -0.02), 0.7, {at(-0.1, 0.16), at(-0.1, -0.08), at(0.25, -0.08)},
            "Off one sheet: contact lands on the next") &&
      panel(hole, at(0, 0), 0.7, {at(-0.15, 0.12), at(-0.15, -0.1), at(0.05, -0.1), at(0.25, -0.01)},
            "Through a hole: held by the back") &&
      panel(shell, at(0, 0.1), 0.8, {at(-0.1, 0.32), at(-0.1, 0.15), at(-0.2, 0.0), at(-0.2, -0.1)},
            "Over an open rim: contact ends");
  all.legend("as right");
  return drawn && all.save(folder / "contact-ambiguous.svg",
                           "Eight places where contact may go one of two ways, and the way that it takes");
}

}  // namespace

int main(int count, char** words) {
  const std::filesystem::path folder = count > 1 ? words[1] : ".";
  return edge(folder) && thin(folder) && side(folder) && groove(folder) && ambiguous(folder) ? 0 : 1;
}
