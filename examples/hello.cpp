// From nothing to a carved model: make a mesh, convert it, touch it, carve it, save it.
// region begin
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/edit/editor.h>
#include <relief/file/model_file.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>

#include <cstdio>

namespace {
int failed(const relief::Error& error) {
  std::fprintf(stderr, "%s\n", error.message.c_str());
  return 1;
}
}  // namespace

int main(int argc, char** argv) {
  // end begin

  // region convert
  const auto mesh = argc > 1 ? relief::import_mesh(argv[1]) : relief::make_sample("pumpkin", 50'000);
  if (!mesh) return failed(mesh.error());  // one sentence that names the file and the place in it
  const auto made = relief::convert(*mesh, {.slabs = 200, .intervals = 32});
  if (!made) return failed(made.error());
  std::puts(to_string(made->report).c_str());
  // end convert

  // region probe
  const relief::SnapshotPtr model = made->model.head;
  const relief::Box3d box = model->slab_mesh().bounds();
  const relief::Ray3d ray = {.origin = box.centre() + relief::Vec3d{0, 0, diagonal(box)}, .direction = {0, 0, -1}};
  const auto hit = relief::raycast(*model, ray);
  if (!hit) return 1;
  const relief::SurfacePoint& at = hit->point;

  relief::LocateHint hint;  // makes the next probe quick: keep one per device
  const auto contact = relief::probe(*model, at.position - at.normal * 0.5, hint);
  if (!contact || !contact->touching()) return 1;
  std::printf("%.2f units deep in slab %u\n", contact->depth, contact->at.slab);
  // end probe

  // region carve
  relief::Editor editor(model);
  editor.begin_stroke({.tool = relief::Tool::Carve, .radius = 6});
  const relief::DabResult dent = editor.dab({.slab = at.slab,
                                             .contact = at.position,
                                             .cursor = at.position - at.normal * 1.5,  // how deep the tool is
                                             .normal = at.normal});
  editor.end_stroke();
  std::printf("carved %zu samples\n", dent.samples);
  // end carve

  // region save
  auto file = relief::ModelFile::create("hello.relief", made->model);
  if (!file) return failed(file.error());
  const auto saved = file->commit(editor.head(), {.label = "a dent", .details = {}});  // one stroke, one transaction
  if (!saved) return failed(saved.error());
  // end save
  return dent.samples > 0 && file->stroke_count() == 1 ? 0 : 1;
}
