#include <relief/convert/convert.h>
#include <relief/file/model_file.h>
#include <relief/mesh/samples.h>

#include <cstdio>

int main() {
  const auto mesh = relief::make_sample("torus", 4000);
  if (!mesh) return std::puts(mesh.error().message.c_str()), 1;
  const auto made = relief::convert(*mesh, {.slabs = 100, .intervals = 15});
  if (!made) return std::puts(made.error().message.c_str()), 1;
  const auto file = relief::ModelFile::create("torus.relief", made->model);
  return file ? 0 : (std::puts(file.error().message.c_str()), 1);
}
