// sample and export: meshes that Relief makes.
#include "commands.h"

#include <relief/base/atomic_file.h>
#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>
#include <relief/file/model_file.h>
#include <relief/mesh/export.h>
#include <relief/mesh/samples.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <memory>

namespace relief::cli {

namespace {

std::string lower_extension(const std::filesystem::path& file) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Status say(const Context& context, const std::string& file, std::size_t vertices, std::size_t triangles) {
  if (context.json) {
    nlohmann::ordered_json json;
    json["file"] = file;
    json["vertices"] = vertices;
    json["triangles"] = triangles;
    print_json(json);
  } else {
    print(fmt::format("{}: {} vertices, {} triangles\n", file, vertices, triangles));
  }
  return {};
}

Status run_sample(const std::string& name, const std::string& out, std::size_t triangles, const Context& context) {
  RELIEF_CHECK(check_outputs({out}, {}));
  RELIEF_CHECK(check_no_model({out}));
  RELIEF_TRY(const TriangleMesh mesh, make_sample(name, triangles, context.progress));
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  RELIEF_CHECK(export_mesh(mesh, out));
  return say(context, out, mesh.positions.size(), mesh.triangles.size());
}

Status run_export(const std::string& file, const std::string& out, int level, const Context& context) {
  RELIEF_CHECK(check_outputs({out}, {file}));
  RELIEF_CHECK(check_no_model({out}));
  RELIEF_TRY(const ModelFile model, open_model(file, context));
  const Snapshot& head = *model.model().head;
  if (lower_extension(out) == ".slabs") {
    RELIEF_TRY(AtomicFile target, AtomicFile::create(out));
    RELIEF_CHECK(target.write(to_slabs_text(head.slab_mesh())));
    RELIEF_CHECK(target.commit());
    return say(context, out, head.slab_mesh().fibres().size() * 2, head.slab_mesh().slab_count());
  }
  if (const int levels = level_count(head.slab_mesh()); level >= levels)
    return fail(Errc::InvalidArgument, fmt::format("{}: its grids have levels 0 to {} only; choose --level among them",
                                                   printable(file), levels - 1));
  const TriangleMesh mesh = to_mesh(head, level);
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  // Far from the origin a float keeps too little of a coordinate.
  const Box3d box = bounds(mesh);
  const double reach = std::max({std::abs(box.low.x), std::abs(box.low.y), std::abs(box.low.z), std::abs(box.high.x),
                                 std::abs(box.high.y), std::abs(box.high.z)});
  const bool far = reach > 20 * diagonal(box);
  RELIEF_CHECK(export_mesh(mesh, out, {.unit = model.model().info.unit, .double_positions = far}));
  return say(context, out, mesh.positions.size(), mesh.triangles.size());
}

}  // namespace

std::function<std::string(const std::string&)> has_extension(std::vector<std::string_view> extensions) {
  return [extensions = std::move(extensions)](const std::string& file) -> std::string {
    if (file.empty()) return names_file(file);
    if (std::ranges::find(extensions, lower_extension(file)) != extensions.end()) return {};
    std::string known;
    for (const std::string_view e : extensions) known += (known.empty() ? "" : ", ") + std::string(e);
    return fmt::format("\"{}\" must end in {}{}", printable(file, 120), extensions.size() > 1 ? "one of " : "", known);
  };
}

void add_sample(CLI::App& app, Context& context) {
  struct Options {
    std::string name, out;
    std::size_t triangles = 200'000;
  };
  auto o = std::make_shared<Options>();
  std::string names;
  for (const std::string_view n : sample_names()) names += (names.empty() ? "" : ", ") + std::string(n);
  CLI::App* c = app.add_subcommand("sample", "Write one of Relief's own models: " + names);
  c->add_option("NAME", o->name, "Which one")->required()->check([names](const std::string& name) -> std::string {
    if (std::ranges::find(sample_names(), name) != sample_names().end()) return {};
    return "there is no sample \"" + printable(name, 60) + "\"; there are " + names;
  });
  c->add_option("-o,--output", o->out, "The mesh: .ply, .obj, .stl, .glb or .3mf")
      ->required()
      ->check(has_extension({".ply", ".obj", ".stl", ".glb", ".3mf"}));
  c->add_option("--triangles", o->triangles, "About how many triangles, 1000 to 50 million (default 200000)")
      ->check(CLI::Range(1000, 50'000'000));
  finish_command(*c, context, [o, &context] { return run_sample(o->name, o->out, o->triangles, context); });
}

void add_export(CLI::App& app, Context& context) {
  struct Options {
    std::string file, out;
    int level = 0;
  };
  auto o = std::make_shared<Options>();
  CLI::App* c = app.add_subcommand("export", "Write the surface for other programs, or the slabs as text");
  c->add_option("MODEL", o->file, "The model")->required()->check(names_file);
  c->add_option("OUT", o->out, "The file: .ply, .obj, .stl, .glb, .3mf (the displaced surface) or .slabs (the cage)")
      ->required()
      ->check(has_extension({".ply", ".obj", ".stl", ".glb", ".3mf", ".slabs"}));
  c->add_option("--level", o->level,
                "Every 2^k-th sample only; a slab whose n does not divide further stays as it is (default 0)")
      ->check(CLI::Range(0, 7));
  finish_command(*c, context, [o, &context] { return run_export(o->file, o->out, o->level, context); });
}

}  // namespace relief::cli
