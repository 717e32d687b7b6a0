// render: a picture of a model.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/core/query.h>
#include <relief/file/model_file.h>
#include <relief/render/frame.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

namespace relief::cli {

namespace {

constexpr double kLeastWidth = 1e-9;  // model units

struct RenderOptions {
  std::string model, out, size = "1280x720", view = "front", camera, at, look_at, look = "studio", matcap, map, colour,
                          background;
  std::vector<std::string> overlays;
  double tool_radius = 0, width = 0, parallel = 0;
  int supersample = 0;
  bool no_cavity = false, no_colours = false, no_mask = false, no_legend = false, no_ground = false;
  Frame frame;
};

/// "WxH". Error: InvalidArgument.
Status parse_size(const std::string& text, Frame& draw) {
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

/// So many numbers with commas between them. Error: InvalidArgument.
template <std::size_t Count>
Result<std::array<double, Count>> parse_numbers(const char* option, const std::string& text) {
  std::array<double, Count> numbers{};
  const char *at = text.data(), *const end = at + text.size();
  for (std::size_t k = 0; k < Count; ++k) {
    const auto [next, error] = std::from_chars(at, end, numbers[k]);
    const bool last = k + 1 == Count;
    if (error != std::errc{} || !std::isfinite(numbers[k]) || (last ? next != end : next == end || *next != ','))
      return fail(Errc::InvalidArgument, fmt::format("{} takes {} numbers with commas between them, not \"{}\"", option,
                                                     Count, printable(text, 40)));
    at = next + (last ? 0 : 1);
  }
  return numbers;
}
template <std::size_t Count>
std::string are_numbers(const char* option, const std::string& text) {
  const auto parsed = parse_numbers<Count>(option, text);
  return parsed ? std::string() : parsed.error().message;
}

constexpr std::array<std::string_view, 5> kMaps = {"none", "displacement", "depth", "slabs", "stretch"};

/// What the options say of the look.
Status read_look(const RenderOptions& o, double mm_per_unit, Frame& frame) {
  Look& look = frame.look;
  look.light = o.look == "matcap" ? Look::Light::Matcap : Look::Light::Studio;
  const auto names = matcaps();
  if (const auto at = std::ranges::find(names, o.matcap); at != names.end())
    look.matcap = static_cast<int>(at - names.begin());
  look.cavity = !o.no_cavity;
  look.colours = !o.no_colours;
  look.mask = !o.no_mask;
  look.legend = !o.no_legend;
  look.ground = !o.no_ground;
  look.mm_per_unit = mm_per_unit;
  if (!o.map.empty()) look.map = static_cast<Look::Map>(std::ranges::find(kMaps, o.map) - kMaps.begin());
  for (const std::string& overlay : o.overlays) {
    look.slab_wires = look.slab_wires || overlay == "slabs";
    if (overlay == "heat") look.map = Look::Map::Displacement;
  }
  const auto colour = [](double r, double g, double b) { return to_float(Vec3d{r, g, b}); };
  if (!o.colour.empty()) {
    RELIEF_TRY(const auto rgb, parse_numbers<3>("--colour", o.colour));
    look.base_colour = colour(rgb[0], rgb[1], rgb[2]);
  }
  if (!o.background.empty()) {
    RELIEF_TRY(const auto rgb, parse_numbers<6>("--background", o.background));
    look.top = colour(rgb[0], rgb[1], rgb[2]);
    look.bottom = colour(rgb[3], rgb[4], rgb[5]);
  }
  // In studio light four samples are enough; a light itself is many.
  if (frame.samples == 0) frame.samples = look.light == Look::Light::Studio ? 4 : 16;
  if (o.supersample > 0) frame.samples = o.supersample * o.supersample;
  return {};
}

/// Where the options have the picture taken from.
Result<Camera> find_camera(const RenderOptions& o, const Snapshot& head) {
  const double aspect = static_cast<double>(o.frame.width) / o.frame.height;
  Camera camera;
  if (!o.camera.empty()) {
    RELIEF_TRY(const auto n, parse_numbers<10>("--camera", o.camera));
    camera = {.eye = {n[0], n[1], n[2]}, .target = {n[3], n[4], n[5]}, .up = {n[6], n[7], n[8]}, .field_of_view = n[9]};
  } else {
    RELIEF_TRY(const auto angles, parse_view(o.view));
    camera = framing(head, angles.first, angles.second, aspect);
    if (!o.look_at.empty()) {
      RELIEF_TRY(const Vec3d point, parse_vector("--look-at", o.look_at));
      camera = looking_at(point, o.width, head.slab_mesh().bounds(), angles.first, angles.second, aspect);
    }
  }
  if (o.parallel > 0) {
    camera.parallel = true;
    camera.view_height = o.parallel;
  }
  return camera;
}

nlohmann::ordered_json camera_json(const Camera& camera) {
  const auto vector = [](Vec3d v) { return nlohmann::ordered_json{v.x, v.y, v.z}; };
  nlohmann::ordered_json json = {
      {"eye", vector(camera.eye)}, {"target", vector(camera.target)}, {"up", vector(camera.up)}};
  if (camera.parallel)
    json["parallel"] = camera.view_height;
  else
    json["field_of_view"] = camera.field_of_view;
  return json;
}

Status run_render(RenderOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.out}, {o.model}));
  RELIEF_CHECK(check_no_model({o.out}));
  Frame& frame = o.frame;
  RELIEF_CHECK(parse_size(o.size, frame));
  std::optional<NothingWritten> nothing_written(std::in_place);
  RELIEF_TRY(const ModelFile file, open_model(o.model, context));
  const Snapshot& head = *file.model().head;
  RELIEF_CHECK(read_look(o, metres(file.model().info.unit) * 1e3, frame));
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
    frame.hand = hand;
  }
  RELIEF_TRY(frame.camera, find_camera(o, head));
  context.progress("render", 0.1);
  RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
  RELIEF_TRY(const Picture picture, renderer.picture(head, frame, context.progress.cancel));
  nothing_written.reset();
  context.progress("save", 0.95);
  RELIEF_CHECK(save_png(picture, o.out, context.progress.cancel));
  const FrameStats& stats = renderer.stats();
  if (context.json) {
    nlohmann::ordered_json json;
    json["file"] = o.out;
    json["width"] = picture.width;
    json["height"] = picture.height;
    json["camera"] = camera_json(frame.camera);
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
      "  relief render pumpkin.relief -o wart.png --view 20,10 --look-at 2.5,40,54 --width 30\n"
      "  relief render pumpkin.relief -o clay.png --look matcap --matcap \"red wax\"");
  c->add_option("MODEL", o->model, "The model")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "The picture, OUT.png")->required()->check(has_extension({".png"}));
  c->add_option("--size", o->size, "Width x height in pixels (default 1280x720)")->check([](const std::string& text) {
    Frame ignored;
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
  c->add_option("--camera", o->camera,
                "The camera itself: eye x,y,z, target x,y,z, up x,y,z and vertical field of view in degrees, all with "
                "commas between them; --json says the one used")
      ->check([](const std::string& text) { return are_numbers<10>("--camera", text); })
      ->excludes(look_at);
  c->add_option("--parallel", o->parallel, "A parallel camera with so many model units from edge to edge of the height")
      ->check(in_range(kLeastWidth, 1e12));
  c->add_option("--look", o->look, "studio (soft light with shadows, the default), matcap (light for sculpting)")
      ->check(CLI::IsMember({"studio", "matcap"}));
  std::vector<std::string> materials(matcaps().begin(), matcaps().end());
  c->add_option("--matcap", o->matcap, "The material of --look matcap (default clay)")->check(CLI::IsMember(materials));
  c->add_option("--map", o->map, "What colour shows: displacement, depth (clay left), slabs, stretch")
      ->check(CLI::IsMember(std::vector<std::string>(kMaps.begin(), kMaps.end())));
  c->add_option("--overlay", o->overlays, "slabs (wires), heat (as --map displacement); may be given more than once")
      ->check(CLI::IsMember({"slabs", "heat"}))
      ->delimiter(',');
  c->add_option("--colour", o->colour, "Colour where the model has none: r,g,b, 0 to 1")
      ->check([](const std::string& text) { return are_numbers<3>("--colour", text); });
  c->add_option("--background", o->background, "Upper and lower colour of --look matcap: r,g,b,r,g,b, 0 to 1")
      ->check([](const std::string& text) { return are_numbers<6>("--background", text); });
  c->add_flag("--no-cavity", o->no_cavity, "Do not darken hollows");
  c->add_flag("--no-colours", o->no_colours, "Leave out the colour layer");
  c->add_flag("--no-mask", o->no_mask, "Do not darken what the mask protects");
  c->add_flag("--no-legend", o->no_legend, "Leave out the map's legend");
  c->add_flag("--no-ground", o->no_ground, "No floor under --look studio");
  c->add_option("--at", o->at,
                "Show the hand with its cursor at x,y,z (model units), in studio light: tool, contact point, force")
      ->check([](const std::string& text) { return is_vector("--at", text); });
  c->add_option("--tool-radius", o->tool_radius, "Radius of the shown tool sphere, model units")
      ->check(in_range(0, 1e12));
  c->add_option("--level", o->frame.level, "Level of detail: every 2^k-th sample (default 0)")->check(CLI::Range(0, 7));
  c->add_option("--tau", o->frame.tau,
                "Coarser samples where their distance stays within so many pixels (default 1; 0: all)")
      ->check(in_range(0, 1e6));
  o->frame.samples = 0;
  CLI::Option* samples = c->add_option("--samples", o->frame.samples, "Per pixel: 1, 4, 9 or 16 (default 16; studio 4)")
                             ->check(CLI::IsMember({1, 4, 9, 16}));
  c->add_option("--supersample", o->supersample, "The same by the edge: 1 to 4")
      ->check(CLI::Range(1, 4))
      ->excludes(samples);
  c->add_option("--lights", o->frame.look.lights, "Lights of the soft box, 1 to 256 (default 64)")
      ->check(CLI::Range(1, 256));
  finish_command(*c, context, [o, &context] { return run_render(*o, context); });
}

}  // namespace relief::cli
