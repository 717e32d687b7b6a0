#include "renderer.h"

#include <relief/base/assert.h>
#include <relief/base/atomic_file.h>
#include <relief/base/try.h>
#include <relief/core/query.h>

#include <png.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

namespace relief {

Camera framing(const Box3d& box, double azimuth, double elevation, double aspect, Vec3d up) {
  const double turn = azimuth * std::numbers::pi / 180, rise = elevation * std::numbers::pi / 180;
  const Vec3d above = length(up) > 0 ? normalized(up) : Vec3d{0, 1, 0};
  // Azimuth 0 looks from +z; with z up, from -y, as is usual there.
  const Vec3d from_z = Vec3d{0, 0, 1} - above * above.z;
  const Vec3d front = length(from_z) > 1e-6 ? normalized(from_z) : Vec3d{0, -1, 0};
  const Vec3d side = cross(above, front);
  const Vec3d flat = front * std::cos(turn) + side * std::sin(turn);
  const Vec3d back = flat * std::cos(rise) + above * std::sin(rise);

  Camera camera;
  const double size = diagonal(box);
  camera.target = box.empty() ? Vec3d{} : box.centre();
  // From straight above the picture's upper edge is where azimuth 0 would look to.
  camera.up = std::abs(std::cos(rise)) > 1e-6 ? above : flat * (rise > 0 ? -1.0 : 1.0);
  const Vec3d right = normalized(cross(camera.up, back)), over = cross(back, right);
  const double tan_y = std::tan(camera.field_of_view * std::numbers::pi / 360), tan_x = tan_y * std::max(aspect, 1e-3);
  constexpr double kMargin = 1.08;
  double distance = size > 0 ? 0 : 1;
  for (unsigned k = 0; k < 8 && size > 0; ++k) {
    const Vec3d corner = {(k & 1U) != 0 ? box.high.x : box.low.x, (k & 2U) != 0 ? box.high.y : box.low.y,
                          (k & 4U) != 0 ? box.high.z : box.low.z};
    const Vec3d d = corner - camera.target;
    const double aside = std::max(std::abs(dot(d, right)) / tan_x, std::abs(dot(d, over)) / tan_y);
    distance = std::max(distance, dot(d, back) + aside * kMargin);
  }
  camera.eye = camera.target + back * distance;
  return camera;
}

Box3d surface_bounds(const Snapshot& model) {
  Box3d box;
  for (SlabId s = 0; s < model.slab_mesh().slab_count(); ++s) {
    const int n = model.slab_mesh().intervals(s);
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i + j <= n; ++i) box.add(sample_position(model, s, {i, j}));
  }
  return box;
}

Status save_png(const Picture& picture, const std::filesystem::path& file) {
  RELIEF_ASSERT(picture.width > 0 && picture.height > 0);
  RELIEF_ASSERT(picture.rgb.size() ==
                static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * 3);
  const auto failed = [&](std::string_view why) {
    return fail(Errc::Io, "cannot write the picture '" + printable(file.string()) + "': " + std::string(why));
  };
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::vector<std::byte> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0)
    return failed(printable(image.message));
  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(std::span(bytes).first(size)));
  return out.commit();
}

}  // namespace relief
