// render: a picture of a model.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/file/model_file.h>
#include <relief/mesh/import.h>
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
  std::string stage;
  bool remesh = false;
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
Result<Camera> find_camera(const RenderOptions& o, const Box3d& box, const Snapshot* head) {
  const double aspect = static_cast<double>(o.frame.width) / o.frame.height;
  Camera camera;
  if (!o.camera.empty()) {
    RELIEF_TRY(const auto n, parse_numbers<10>("--camera", o.camera));
    camera = {.eye = {n[0], n[1], n[2]}, .target = {n[3], n[4], n[5]}, .up = {n[6], n[7], n[8]}, .field_of_view = n[9]};
  } else {
    RELIEF_TRY(const auto angles, parse_view(o.view));
    camera = head != nullptr ? framing(*head, angles.first, angles.second, aspect)
                             : framing(box, angles.first, angles.second, aspect);
    if (!o.look_at.empty()) {
      RELIEF_TRY(const Vec3d point, parse_vector("--look-at", o.look_at));
      camera = looking_at(point, o.width, box, angles.first, angles.second, aspect);
    }
  }
  if (o.parallel > 0) {
    camera.parallel = true;
    camera.view_height = o.parallel;
  }
  return camera;
}

nlohmann::ordered_json camera_json(const Camera& camera) {
  nlohmann::ordered_json json = {
      {"eye", vector_json(camera.eye)}, {"target", vector_json(camera.target)}, {"up", vector_json(camera.up)}};
  if (camera.parallel)
    json["parallel"] = camera.view_height;
  else
    json["field_of_view"] = camera.field_of_view;
  return json;
}

/// What a conversion of a mesh shows at a stage.
Result<TriangleMesh> stage_of(const std::string& file, Stage wanted, bool remesh, const Context& context) {
  RELIEF_TRY(TriangleMesh source, import_mesh(file, context.progress));
  std::optional<TriangleMesh> seen;
  ConvertSettings settings;
  settings.intervals = 1;
  if (remesh) settings.remesh = 0.0;
  settings.show = [&](Stage stage, TriangleMesh mesh) {
    if (stage == wanted) seen = std::move(mesh);
  };
  const auto made = convert(std::move(source), settings, context.progress);
  if (seen) return std::move(*seen);
  // A conversion that fails shows how far it came.
  if (!made) return fail(made.error().code, printable(file) + ": " + made.error().message);
  return fail(Errc::InvalidArgument,
              fmt::format("{}: its conversion has no stage \"{}\": {}.", printable(file), name(wanted),
                          wanted == Stage::Skin ? "no parts overlap" : "it was not made anew; --remesh does that"));
}

/// A stage of the conversion of a mesh, in the sculpting look.
Status run_stage(RenderOptions& o, const Context& context) {
  RELIEF_CHECK(check_outputs({o.out}, {o.model}));
  check_no_model({{o.out, "pictures", ".png"}});
  RELIEF_CHECK(parse_size(o.size, o.frame));
  std::optional<NothingWritten> nothing_written(std::in_place);
  RELIEF_TRY(const TriangleMesh mesh, stage_of(o.model, *stage_from_name(o.stage), o.remesh, context));
  o.look = "matcap";
  RELIEF_CHECK(read_look(o, 1, o.frame));
  RELIEF_TRY(o.frame.camera, find_camera(o, bounds(mesh), nullptr));
  RELIEF_TRY(FrameRenderer renderer, FrameRenderer::create());
  RELIEF_TRY(const Picture picture, renderer.picture(MeshView{mesh.positions, mesh.triangles, mesh.colours}, o.frame,
                                                     context.progress.cancel));
  nothing_written.reset();
  RELIEF_CHECK(save_png(picture, o.out, context.progress.cancel));
  if (context.json)
    print_json({{"file", o.out},
                {"stage", o.stage},
                {"width", picture.width},
                {"height", picture.height},
                {"triangles", mesh.triangles.size()}});
  else
    print(fmt::format("{}: stage {}, {} triangles\n", o.out, o.stage, mesh.triangles.size()));
  return {};
}

Status run_render(RenderOptions& o, const Context& context) {
  if (!o.stage.empty()) return run_stage(o, context);
  RELIEF_CHECK(check_outputs({o.out}, {o.model}));
  check_no_model({{o.out, "pictures", ".png"}});
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
  RELIEF_TRY(frame.camera, find_camera(o, head.slab_mesh().bounds(), &head));
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
  context.catalogue[c] = {
      .group = "Share",
      .examples = {{"relief render scan.relief -o scan.png --size 1920x1080 --view corner"},
                   {"relief render scan.relief -o wart.png --view 20,10 --look-at 2.5,40,54 --width 30"},
                   {"relief render scan.relief -o clay.png --look matcap --matcap \"red wax\""},
                   {"relief render scan.ply -o skin.png --debug skin", "a stage of the conversion"}}};
  const std::string camera = "Camera", look = "Look", quality = "Quality";
  const auto vector_check = [](const char* option) {
    return [option](const std::string& text) { return is_vector(option, text); };
  };
  c->add_option("MODEL", o->model, "the model; with --debug the mesh")->required()->check(names_file);
  c->add_option("-o,--output", o->out, "the picture")->required()->check(has_extension({".png"}))->type_name("OUT.png");
  std::vector<std::string> stages;
  for (const Stage stage : kStages) stages.emplace_back(name(stage));
  CLI::Option* debug = c->add_option("--debug", o->stage, "draw a stage of the conversion of a mesh")
                           ->check(one_of(stages))
                           ->type_name("STAGE");
  c->add_flag("--remesh", o->remesh, "with --debug: rebuild the mesh as a solid first")->needs(debug);
  c->add_option("--size", o->size, "width and height in pixels, 16 to 8192 each")
      ->check([](const std::string& text) {
        Frame ignored;
        const Status parsed = parse_size(text, ignored);
        return parsed ? std::string() : parsed.error().message;
      })
      ->type_name("WxH")
      ->default_str("1280x720");
  c->add_option("--view", o->view,
                "front (from +z), back, left, right, top, bottom, corner, or AZIMUTH,ELEVATION in degrees; y is up")
      ->check([](const std::string& text) {
        const auto parsed = parse_view(text);
        return parsed ? std::string() : parsed.error().message;
      })
      ->type_name("VIEW")
      ->default_str("front")
      ->group(camera);
  CLI::Option* look_at = c->add_option("--look-at", o->look_at, "look at this point, model units")
                             ->check(vector_check("--look-at"))
                             ->type_name("X,Y,Z")
                             ->default_str("the whole model")
                             ->group(camera);
  CLI::Option* width = c->add_option("--width", o->width, "model units across the picture at the point looked at")
                           ->check(in_range(kLeastWidth, 1e12))
                           ->type_name("WIDTH")
                           ->group(camera);
  look_at->needs(width);
  width->needs(look_at);
  c->add_option("--camera", o->camera,
                "eye x,y,z, target x,y,z, up x,y,z and vertical field of view in degrees; --json says the one used")
      ->check([](const std::string& text) { return are_numbers<10>("--camera", text); })
      ->excludes(look_at)
      ->type_name("NUMBERS")
      ->group(camera);
  c->add_option("--parallel", o->parallel, "no perspective; model units across the picture's height")
      ->check(in_range(kLeastWidth, 1e12))
      ->type_name("HEIGHT")
      ->group(camera);
  c->add_option("--look", o->look, "studio: soft light with shadows; matcap: light for sculpting")
      ->check(one_of({"studio", "matcap"}))
      ->default_str("studio")
      ->group(look);
  c->add_option("--matcap", o->matcap, "the material of --look matcap")
      ->check(one_of({matcaps().begin(), matcaps().end()}))
      ->type_name("MATERIAL")
      ->default_str("clay")
      ->group(look);
  c->add_option("--map", o->map, "what colour shows; depth is the clay that is left")
      ->check(one_of({kMaps.begin(), kMaps.end()}))
      ->type_name("MAP")
      ->default_str("none")
      ->group(look);
  c->add_option("--overlay", o->overlays, "slabs: wires; heat: as --map displacement; may be given more than once")
      ->check(one_of({"slabs", "heat"}))
      ->delimiter(',')
      ->group(look);
  c->add_option("--colour", o->colour, "colour where the model has none, 0 to 1 each")
      ->check([](const std::string& text) { return are_numbers<3>("--colour", text); })
      ->type_name("R,G,B")
      ->group(look);
  c->add_option("--background", o->background, "upper and lower colour of --look matcap, 0 to 1 each")
      ->check([](const std::string& text) { return are_numbers<6>("--background", text); })
      ->type_name("R,G,B,R,G,B")
      ->group(look);
  c->add_flag("--no-cavity", o->no_cavity, "do not darken hollows")->group(look);
  c->add_flag("--no-colours", o->no_colours, "leave out the colour layer")->group(look);
  c->add_flag("--no-mask", o->no_mask, "do not darken what the mask protects")->group(look);
  c->add_flag("--no-legend", o->no_legend, "leave out the map's legend")->group(look);
  c->add_flag("--no-ground", o->no_ground, "no floor under --look studio")->group(look);
  c->add_option("--at", o->at, "show the hand with its cursor here, model units: tool, contact point, force")
      ->check(vector_check("--at"))
      ->type_name("X,Y,Z")
      ->group(look);
  c->add_option("--tool-radius", o->tool_radius, "radius of the ball that --at shows, model units")
      ->check(in_range(0, 1e12))
      ->type_name("R")
      ->default_str("0")
      ->group(look);
  c->add_option("--level", o->frame.level, "every 2^L-th sample only")
      ->check(whole_in_range(0, 7))
      ->type_name("L")
      ->default_str("0")
      ->group(quality);
  c->add_option("--tau", o->frame.tau, "coarser samples where their distance stays within so many pixels; 0: all")
      ->check(in_range(0, 1e6))
      ->type_name("PIXELS")
      ->default_str("1")
      ->group(quality);
  o->frame.samples = 0;
  CLI::Option* samples = c->add_option("--samples", o->frame.samples, "samples per pixel")
                             ->check(one_of({"1", "4", "9", "16"}))
                             ->default_str("16; studio 4")
                             ->group(quality);
  c->add_option("--supersample", o->supersample, "the same, by the edge of a pixel")
      ->check(whole_in_range(1, 4))
      ->excludes(samples)
      ->type_name("N")
      ->group(quality);
  c->add_option("--lights", o->frame.look.lights, "lights of the soft box")
      ->check(whole_in_range(1, 256))
      ->type_name("N")
      ->default_str("64")
      ->group(quality);
  finish_command(*c, context, [o, &context] { return run_render(*o, context); });
}

}  // namespace relief::cli
