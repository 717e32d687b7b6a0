// The shortest program: a mesh becomes slabs, and a point of space is probed.
#include <relief/convert/convert.h>
#include <relief/core/query.h>
#include <relief/mesh/samples.h>

#include <cstdio>

int main() {
  const auto mesh = relief::make_sample("pumpkin", 50'000);  // or relief::import_mesh("scan.ply")
  if (!mesh) return std::puts(mesh.error().message.c_str()), 1;

  const auto made = relief::convert(*mesh, {.slabs = 200});
  if (!made) return std::puts(made.error().message.c_str()), 1;

  relief::LocateHint hint;  // makes the next probe quick: keep one per device
  const auto contact = relief::probe(*made->model.head, {6, 40, 50}, hint);
  if (!contact || !contact->touching()) return std::puts("not below the surface"), 1;
  std::printf("%.2f mm below the surface, in slab %u\n", contact->depth, contact->at.slab);
}
