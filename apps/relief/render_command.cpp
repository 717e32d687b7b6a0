// render: a picture of a model.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/file/model_file.h>
#include <relief/render/renderer.h>

#include <fmt/format.h>

#include <charconv>
#include <map>
#include <memory>
#include <optional>

namespace relief::cli {

namespace {

constexpr double kLeastWidth = 1e-9;  // model units

struct RenderOptions {
  std::string model, out, size = "1280x720", view = "front", at, look_at;
  std::vector<std::string> overlays;
  double tool_radius = 0, width = 0;
  DrawSettings draw;
};

/// "WxH". Error: InvalidArgument.
Status parse_size(const std::string& text, DrawSettings& draw) {
  const char* const end = text.data() + text.size();
  const auto [x, width_error] = std::from_chars(text.data(), end, draw.width);
  if (width_error == std::errc{} && x != end && *x == 'x') {
    const auto [rest, height_error] = std::from_chars(x + 1, end, draw.height);
    if (height_error == std::errc{} && rest == end && draw.width >= 16 && draw.height >= 16 && draw.width <= 8192 &&
        draw.height <= 8192)
      return {};
  }
  return fail(Errc::InvalidArgument,
              fmt::format("--size takes WxH with 16 to 8192 pixels each, not \"{}\"", printable(text, 40)));
}

/// A named view or "azimuth,elevation" in degrees.
Result<std::pair<double, double>> parse_view(const std::string& text) {
  static const std::map<std::string, std::pair<double, double>> views = {
      {"front", {0, 12}}, {"back", {180, 12}},    {"right", {90, 12}}, {"left", {-90, 12}},
      {"top", {0, 89.9}}, {"bottom", {0, -89.9}}, {"corner", {35, 22}}};
  if (const auto named = views.find(text); named != views.end()) return named->second;
  const std::size_t comma = text.find(',');
  double azimuth = 0, elevation = 0;
  if (comma != std::string::npos) {
    const char* const end = text.data() + text.size();
    const auto a = std::from_chars(text.data(), text.data() + comma, azimuth);
    const auto e = std::from_chars(text.data() + comma + 1, end, elevation);
    if (a.ec == std::errc{} && a.ptr == text.data() + comma && e.ec == std::errc{} && e.ptr == end &&
        std::abs(azimuth) <= 360 && std::abs(elevation) < 90)
      return std::pair{azimuth, elevation};
  }
  return fail(
      Errc::InvalidArgument,
      fmt::format("--view takes front, back, left, right, top, bottom, corner, or azimuth,elevation in degrees, not "
                  "\"{}\"",
                  printable(text, 40)));
}

std::string is_vector(const char* option, const std::string& text) {
  const auto parsed = parse_vector(option, text);
  return parsed ? std::string() : parsed.error().message;
}

Status run_render(RenderOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.out}, {o.model}));
  RELIEF_CHECK(check_no_model({o.out}));
  RELIEF_CHECK(parse_size(o.size, o.draw));
  RELIEF_TRY(const auto angles, parse_view(o.view));
  o.draw.cancel = context.progress.cancel;
  for (const std::string& overlay : o.overlays) {
    o.draw.slab_wires = o.draw.slab_wires || overlay == "slabs";
    o.draw.heat_map = o.draw.heat_map || overlay == "heat";
  }
  std::optional<NothingWritten> nothing_written(std::in_place);
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  const Snapshot& head = *file.model().head;
  if (!o.at.empty()) {
    RELIEF_TRY(const Vec3d cursor, parse_vector("--at", o.at));
    LocateHint hint;
    HandOverlay hand{
        .cursor = cursor, .contact_point = cursor, .force = {}, .tool_radius = o.tool_radius, .contact = false};
    if (const auto contact = probe(head, cursor, hint); contact && contact->touching()) {
      const ForceSettings law;
      const double metres_per_unit = fit_workspace({}, file.model()).metres_per_unit;
      hand.contact = true;
      hand.contact_point = cursor + contact->surface.normal * contact->depth;
      hand.force = contact->surface.normal * std::min(law.stiffness * contact->depth * metres_per_unit, 3.3);
    }
    o.draw.hand = hand;
  }
  const double aspect = static_cast<double>(o.draw.width) / o.draw.height;
  Camera camera = framing(head, angles.first, angles.second, aspect);
  if (!o.look_at.empty()) {
    RELIEF_TRY(const Vec3d point, parse_vector("--look-at", o.look_at));
    camera = looking_at(point, o.width, head.slab_mesh().bounds(), angles.first, angles.second, aspect);
  }
  context.progress("render", 0.1);
  RELIEF_TRY(Renderer renderer, Renderer::create());
  RELIEF_TRY(const Picture picture, renderer.draw(head, camera, o.draw));
  nothing_written.reset();
  context.progress("save", 0.95);
  RELIEF_CHECK(save_png(picture, o.out, o.draw.cancel));
  const DrawStats& stats = renderer.stats();
  if (context.json) {
    nlohmann::ordered_json json;
    json["file"] = o.out;
    json["width"] = picture.width;
    json["height"] = picture.height;
    json["triangles"] = stats.triangles;
    json["cpu_seconds"] = stats.cpu_seconds;
    json["device"] = renderer.device();
    print_json(json);
  } else {
    print(fmt::format("{}: {}x{}, {} triangles, {:.1f} CPU s on {}\n", o.out, picture.width, picture.height,
                      stats.triangles, stats.cpu_seconds, renderer.device()));
  }
  return {};
}

}  // namespace

void add_render(CLI::App& app, Context& context) {
  auto o = std::make_shared<RenderOptions>();
  CLI::App* c = app.add_subcommand("render", "Draw a picture of a model, without a screen");
  c->footer(
      "Examples:\n"
      "  relief render pumpkin.relief -o pumpkin.png --size 1920x1080 --view corner\n"
      "  relief render pumpkin.relief -o wart.png --view 20,10 --look-at 2.5,40,54 --width 30");
  c->add_option("MODEL", o->model, "The model")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "The picture, OUT.png")->required()->check(has_extension({".png"}));
  c->add_option("--size", o->size, "Width x height in pixels (default 1280x720)")->check([](const std::string& text) {
    DrawSettings ignored;
    const Status parsed = parse_size(text, ignored);
    return parsed ? std::string() : parsed.error().message;
  });
  c->add_option("--view", o->view,
                "front (from +z, the default), back, left, right, top, bottom, corner, or azimuth,elevation in degrees "
                "(azimuth 0 from +z, 90 from +x; y is up)")
      ->check([](const std::string& text) {
        const auto parsed = parse_view(text);
        return parsed ? std::string() : parsed.error().message;
      });
  CLI::Option* look_at =
      c->add_option("--look-at", o->look_at, "Look at x,y,z (model units) instead of the whole model; needs --width")
          ->check([](const std::string& text) { return is_vector("--look-at", text); });
  CLI::Option* width = c->add_option("--width", o->width,
                                     "Model units across the picture's width, at the distance of the point looked at")
                           ->check(in_range(kLeastWidth, 1e12));
  look_at->needs(width);
  width->needs(look_at);
  c->add_option("--overlay", o->overlays, "slabs (wires), heat (displacement); may be given more than once")
      ->check(CLI::IsMember({"slabs", "heat"}))
      ->delimiter(',');
  c->add_option("--at", o->at, "Show the hand with its cursor at x,y,z (model units): tool, contact point, force")
      ->check([](const std::string& text) { return is_vector("--at", text); });
  c->add_option("--tool-radius", o->tool_radius, "Radius of the shown tool sphere, model units")
      ->check(in_range(0, 1e12));
  c->add_option("--level", o->draw.level, "Level of detail: every 2^k-th sample (default 0)")->check(CLI::Range(0, 7));
  c->add_option("--supersample", o->draw.supersample, "Sub-pixels per edge, 1 to 4 (default 2)")
      ->check(CLI::Range(1, 4));
  c->add_option("--lights", o->draw.lights, "Lights of the soft box, 1 to 256 (default 64)")->check(CLI::Range(1, 256));
  finish_command(*c, context, [o, &context] { return run_render(*o, context); });
}

}  // namespace relief::cli
