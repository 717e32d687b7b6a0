// sample and export: meshes that Relief makes.
#include "commands.h"

#include <relief/base/try.h>
#include <relief/convert/convert.h>
#include <relief/core/tessellate.h>
#include <relief/file/model_file.h>
#include <relief/mesh/export.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
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
  check_no_model({{out, "meshes", ".ply"}});
  RELIEF_TRY(const TriangleMesh mesh, make_sample(name, triangles, context.progress));
  if (context.progress.cancelled()) return fail(Errc::Cancelled, "cancelled");
  RELIEF_CHECK(export_mesh(mesh, out, {}, context.progress));
  return say(context, out, mesh.positions.size(), mesh.triangles.size());
}

/// Where the colours of a mesh are, in words; none where it has none.
std::vector<std::string> colours_of(const TriangleMesh& mesh) {
  std::vector<std::string> out;
  if (!mesh.colours.empty()) out.emplace_back("vertices");
  const auto used = [&](auto&& has) {
    return std::ranges::any_of(mesh.material_of, [&](std::uint32_t m) { return has(mesh.materials[m]); });
  };
  if (used([](const Material& m) { return m.image != nullptr; })) out.emplace_back("images");
  if (used([](const Material& m) { return m.image == nullptr; })) out.emplace_back("faces");
  return out;
}

struct ExportOptions {
  std::string file, out, up;
  int level = 0;
};

Status run_export(const ExportOptions& o, const Context& context) {
  const std::string &file = o.file, &out = o.out;
  RELIEF_CHECK(check_outputs({out}, {file}));
  check_no_model({{out, "meshes", ".ply"}});
  const bool writes_slabs = lower_extension(out) == ".slabs";
  if (writes_slabs && !o.up.empty())
    refuse_usage(printable(out) + ": slabs are written as they lie; --up is for meshes");
  RELIEF_TRY(const ModelFile model, open_model(file, context));
  const Snapshot& head = *model.model().head;
  if (writes_slabs) {
    RELIEF_CHECK(export_slabs(head.slab_mesh(), out));
    return say(context, out, head.slab_mesh().root_fibres().size() * 2, head.slab_mesh().roots().size());
  }
  if (const int levels = level_count(head.slab_mesh()); o.level >= levels)
    return fail(Errc::InvalidArgument, fmt::format("{}: its grids have levels 0 to {} only; choose --level among them",
                                                   printable(file), levels - 1));
  using Up = SurfaceExport::Up;
  const SurfaceExport how = {.level = o.level,
                             .up = o.up.empty()  ? Up::AsItLies
                                   : o.up == "z" ? Up::Z
                                                 : Up::Y,
                             .unit = model.model().info.unit};
  RELIEF_TRY(const Exported made, export_surface(head, out, how, context.progress));
  return say(context, out, made.vertices, made.triangles);
}

}  // namespace

Status run_mesh_info(const std::string& file, const Context& context) {
  RELIEF_TRY(const TriangleMesh mesh, import_mesh(file, context.progress));
  const Box3d box = bounds(mesh);
  const std::vector<std::string> colours = colours_of(mesh);
  if (context.json) {
    nlohmann::ordered_json json;
    json["kind"] = "mesh";
    json["vertices"] = mesh.positions.size();
    json["triangles"] = mesh.triangles.size();
    json["unit"] = mesh.unit ? nlohmann::ordered_json(name(*mesh.unit)) : nlohmann::ordered_json();
    json["colours"] = colours;
    json["bounds"] = {vector_json(box.low), vector_json(box.high)};
    json["notes"] = mesh.notes;
    print_json(json);
    return {};
  }
  const auto corner = [](Vec3d p) { return fmt::format("{:.6g} {:.6g} {:.6g}", p.x, p.y, p.z); };
  print(fmt::format("mesh     {} vertices, {} triangles\nunit     {}\n", mesh.positions.size(), mesh.triangles.size(),
                    mesh.unit ? name(*mesh.unit) : "not given"));
  print(fmt::format("bounds   {} to {}\n", corner(box.low), corner(box.high)));
  print(fmt::format("colours  {}\n", colours.empty() ? std::string("none") : "of " + joined(colours)));
  for (const std::string& note : mesh.notes) print(fmt::format("note     {}\n", note));
  return {};
}

std::function<std::string(const std::string&)> has_extension(std::vector<std::string_view> extensions) {
  return [extensions = std::move(extensions)](const std::string& file) -> std::string {
    if (file.empty()) return names_file(file);
    if (std::ranges::find(extensions, lower_extension(file)) != extensions.end()) return {};
    std::string known;
    for (const std::string_view e : extensions) known += (known.empty() ? "" : ", ") + std::string(e);
    return fmt::format("{} does not end in {}{}", printable(file, 120), extensions.size() > 1 ? "one of " : "", known);
  };
}

void add_sample(CLI::App& app, Context& context) {
  struct Options {
    std::string name, out;
    std::size_t triangles = 200'000;
  };
  auto o = std::make_shared<Options>();
  const std::vector<std::string> names(sample_names().begin(), sample_names().end());
  CLI::App* c = app.add_subcommand("sample", "Write one of Relief's own meshes");
  context.catalogue[c] = {
      .group = "Make",
      .examples = {{"relief sample pumpkin -o pumpkin.ply"}, {"relief sample torus -o torus.stl --triangles 5000"}}};
  c->add_option("NAME", o->name, "which one")->required()->check(one_of(names));
  c->add_option("-o,--output", o->out, "the mesh: .ply, .obj, .stl, .glb or .3mf")
      ->required()
      ->check(has_extension({".ply", ".obj", ".stl", ".glb", ".3mf"}))
      ->type_name("MESH.ply");
  c->add_option("--triangles", o->triangles, "about how many triangles")
      ->check(whole_in_range(1000, 50'000'000))
      ->type_name("N")
      ->default_str("200000");
  finish_command(*c, context, [o, &context] { return run_sample(o->name, o->out, o->triangles, context); });
}

void add_export(CLI::App& app, Context& context) {
  auto o = std::make_shared<ExportOptions>();
  CLI::App* c = app.add_subcommand("export", "Write the surface as a mesh for other programs, or the slabs as text");
  context.catalogue[c] = {.group = "Share",
                          .examples = {{"relief export scan.relief scan.glb"},
                                       {"relief export scan.relief print.3mf --level 1", "a quarter of the triangles"},
                                       {"relief export scan.relief scan.obj --up z", "for programs with z up"},
                                       {"relief export scan.relief scan.slabs", "the cage as text"}}};
  c->add_option("MODEL", o->file, "the model")->required()->check(names_file);
  c->add_option("OUT", o->out, "the file: .ply, .obj, .stl, .glb, .3mf (the displaced surface) or .slabs (the cage)")
      ->required()
      ->check(has_extension({".ply", ".obj", ".stl", ".glb", ".3mf", ".slabs"}));
  c->add_option("--level", o->level, "every 2^L-th sample only; a slab that does not divide so far stays finer")
      ->check(whole_in_range(0, 7))
      ->type_name("L")
      ->default_str("0");
  c->add_option("--up", o->up, "z: turn a model whose y is up so that z is up; y: the other way")
      ->check(one_of({"y", "z"}))
      ->default_str("as the model lies");
  finish_command(*c, context, [o, &context] { return run_export(*o, context); });
}

}  // namespace relief::cli
