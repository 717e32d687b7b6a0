#include "picture.h"

#include <relief/base/assert.h>
#include <relief/base/atomic_file.h>
#include <relief/base/try.h>
#include <relief/core/query.h>

#include <png.h>

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <numbers>
#include <string>

namespace relief {

namespace {

constexpr double kMargin = 1.08;

/// From where a camera looks, and the axes of its picture.
struct Look {
  Camera camera;  ///< up and lens only
  Vec3d back, right, over;
  double tan_x, tan_y;
};

Look look_from(double azimuth, double elevation, double aspect, Vec3d up) {
  const double turn = azimuth * std::numbers::pi / 180, rise = elevation * std::numbers::pi / 180;
  const Vec3d above = length(up) > 0 ? normalized(up) : Vec3d{0, 1, 0};
  // Azimuth 0 looks from +z; with z up, from -y, as is usual there.
  const Vec3d from_z = Vec3d{0, 0, 1} - above * above.z;
  const Vec3d front = length(from_z) > 1e-6 ? normalized(from_z) : Vec3d{0, -1, 0};
  const Vec3d side = cross(above, front);
  const Vec3d flat = front * std::cos(turn) + side * std::sin(turn);
  Look look{};
  look.back = flat * std::cos(rise) + above * std::sin(rise);
  // From straight above the picture's upper edge is where azimuth 0 would look to.
  look.camera.up = std::abs(std::cos(rise)) > 1e-6 ? above : flat * (rise > 0 ? -1.0 : 1.0);
  look.right = normalized(cross(look.camera.up, look.back));
  look.over = cross(look.back, look.right);
  look.tan_y = std::tan(look.camera.field_of_view * std::numbers::pi / 360);
  look.tan_x = look.tan_y * std::max(aspect, 1e-3);
  return look;
}

/// A PNG file as it grows: what libpng's jumps leave alone.
struct PngBytes {
  png_structp writer = nullptr;
  png_infop info = nullptr;
  std::string bytes, message;
  const std::atomic<bool>* cancel = nullptr;
  std::jmp_buf jump{};

  PngBytes() = default;
  PngBytes(const PngBytes&) = delete;
  PngBytes& operator=(const PngBytes&) = delete;
  ~PngBytes() { png_destroy_write_struct(&writer, &info); }
};

void png_failed(png_structp writer, png_const_charp message) {
  auto& png = *static_cast<PngBytes*>(png_get_error_ptr(writer));
  png.message = message;
  std::longjmp(png.jump, 1);
}
void png_warned(png_structp /*writer*/, png_const_charp /*message*/) {}
void png_grows(png_structp writer, png_bytep bytes, png_size_t count) {
  auto& png = *static_cast<PngBytes*>(png_get_io_ptr(writer));
  png.bytes.append(reinterpret_cast<const char*>(bytes), count);
}
void png_flushed(png_structp /*writer*/) {}

/// Row by row, as compressing a large picture takes seconds. False with a message, or when cancelled. No local of it
/// has a destructor that a jump would pass over.
bool write_png(const Picture& picture, PngBytes& png) {
  png.writer = png_create_write_struct(PNG_LIBPNG_VER_STRING, &png, png_failed, png_warned);
  if (png.writer != nullptr) png.info = png_create_info_struct(png.writer);
  if (png.info == nullptr) {
    png.message = "out of memory";
    return false;
  }
  if (setjmp(png.jump) != 0) return false;
  png_set_write_fn(png.writer, &png, png_grows, png_flushed);
  png_set_IHDR(png.writer, png.info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height),
               8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png.writer, png.info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_write_info(png.writer, png.info);
  const std::size_t row = static_cast<std::size_t>(picture.width) * 3;
  for (std::size_t at = 0; at < picture.rgb.size(); at += row) {
    if (png.cancel != nullptr && png.cancel->load(std::memory_order_relaxed)) return false;
    png_write_row(png.writer, picture.rgb.data() + at);
  }
  png_write_end(png.writer, png.info);
  return true;
}

}  // namespace

Camera framing(const Box3d& box, double azimuth, double elevation, double aspect, Vec3d up) {
  const Look look = look_from(azimuth, elevation, aspect, up);
  Camera camera = look.camera;
  const double size = diagonal(box);
  camera.target = box.empty() ? Vec3d{} : box.centre();
  double distance = size > 0 ? 0 : 1;
  for (unsigned k = 0; k < 8 && size > 0; ++k) {
    const Vec3d corner = {(k & 1U) != 0 ? box.high.x : box.low.x, (k & 2U) != 0 ? box.high.y : box.low.y,
                          (k & 4U) != 0 ? box.high.z : box.low.z};
    const Vec3d d = corner - camera.target;
    const double aside = std::max(std::abs(dot(d, look.right)) / look.tan_x, std::abs(dot(d, look.over)) / look.tan_y);
    distance = std::max(distance, dot(d, look.back) + aside * kMargin);
  }
  camera.eye = camera.target + look.back * distance;
  return camera;
}

Camera framing(const Snapshot& model, double azimuth, double elevation, double aspect, Vec3d up) {
  const SlabMesh& mesh = model.slab_mesh();
  if (mesh.slab_count() == 0) return framing(Box3d{}, azimuth, elevation, aspect, up);
  const Look look = look_from(azimuth, elevation, aspect, up);
  const double tan_x = look.tan_x / kMargin, tan_y = look.tan_y / kMargin;
  const Vec3d origin = mesh.bounds().centre();
  // The four planes through the eye that just hold all points, and how deep these lie.
  double right = -Box3d::kFar, left = right, top = right, bottom = right, nearest = right, farthest = -right;
  const auto hold = [&](SlabId s, GridPoint at) {
    const Vec3d d = sample_position(model, s, at) - origin;
    const double x = dot(d, look.right), y = dot(d, look.over), z = dot(d, look.back);
    right = std::max(right, x + tan_x * z);
    left = std::max(left, -x + tan_x * z);
    top = std::max(top, y + tan_y * z);
    bottom = std::max(bottom, -y + tan_y * z);
    nearest = std::max(nearest, z);
    farthest = std::min(farthest, z);
  };
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const int n = mesh.intervals(s), step = std::clamp(n / 4, 1, 4);
    for (int j = 0; j <= n; j += step)
      for (int i = 0; i + j <= n; i += step) hold(s, {i, j});
    hold(s, {n, 0});
    hold(s, {0, n});
  }
  const double middle = 0.5 * (nearest + farthest);
  const double away = std::max((right + left) / (2 * tan_x), (top + bottom) / (2 * tan_y)) - middle;
  Camera camera = look.camera;
  camera.target =
      origin + look.right * (0.5 * (right - left)) + look.over * (0.5 * (top - bottom)) + look.back * middle;
  camera.eye = camera.target + look.back * (away > 0 ? away : 1.0);
  return camera;
}

Camera looking_at(Vec3d point, double width, const Box3d& box, double azimuth, double elevation, double aspect,
                  Vec3d up) {
  RELIEF_ASSERT(width > 0);
  const Look look = look_from(azimuth, elevation, aspect, up);
  const double outside = box.empty() ? 0 : dot(box.centre() - point, look.back) + 0.5 * diagonal(box) * kMargin;
  const double away = std::max(0.5 * width / look.tan_x, outside);
  Camera camera = look.camera;
  camera.target = point;
  camera.eye = point + look.back * away;
  camera.field_of_view *= std::atan(look.tan_y / look.tan_x * 0.5 * width / away) / std::atan(look.tan_y);
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

Status save_png(const Picture& picture, const std::filesystem::path& file, const std::atomic<bool>* cancel) {
  RELIEF_ASSERT(picture.width > 0 && picture.height > 0);
  RELIEF_ASSERT(picture.rgb.size() ==
                static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height) * 3);
  PngBytes png;
  png.cancel = cancel;
  const bool written = write_png(picture, png);
  if (cancel != nullptr && cancel->load(std::memory_order_relaxed))
    return fail(Errc::Cancelled, "the picture was cancelled");
  if (!written)
    return fail(Errc::Io, "cannot write the picture '" + printable(file.string()) + "': " + printable(png.message));
  RELIEF_TRY(AtomicFile out, AtomicFile::create(file));
  RELIEF_CHECK(out.write(png.bytes));
  return out.commit();
}

}  // namespace relief
