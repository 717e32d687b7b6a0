#include <relief/core/query.h>
#include <relief/haptics/workspace.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace relief {
namespace {

constexpr double kSpan = 0.15;  // m, of the model's diagonal: what a hand reaches without moving the arm

/// Returns how long a box's sides are along the axes of a frame that is turned against it.
Vec3d turned_extent(Vec3d extent, Quatd rotation) noexcept {
  Vec3d turned;
  for (std::size_t k = 0; k < 3; ++k) {
    Vec3d side;
    side[k] = extent[k];
    const Vec3d along = rotation.turn(side);
    turned += Vec3d{std::abs(along.x), std::abs(along.y), std::abs(along.z)};
  }
  return turned;
}

/// Returns the rotation whose matrix has these columns: where x, y and z go.
Quatd rotation_to(const std::array<Vec3d, 3>& columns) noexcept {
  // The column of q * q^T that is longest; with angles of 90 degrees none of the others is needed.
  const auto& [x, y, z] = columns;
  const std::array<Quatd, 4> rows = {{{1 + x.x + y.y + z.z, y.z - z.y, z.x - x.z, x.y - y.x},
                                      {y.z - z.y, 1 + x.x - y.y - z.z, x.y + y.x, z.x + x.z},
                                      {z.x - x.z, x.y + y.x, 1 - x.x + y.y - z.z, y.z + z.y},
                                      {x.y - y.x, z.x + x.z, y.z + z.y, 1 - x.x - y.y + z.z}}};
  const Quatd q = *std::ranges::max_element(rows, {}, [](Quatd row) { return dot(row, row); });
  return unit(q).value_or(Quatd{});
}

}  // namespace

Workspace Workspace::with_unit_rotation() const noexcept {
  Workspace space = *this;
  if (rotation == Quatd{}) return space;
  const auto turn = unit(rotation);
  space.rotation = turn.value_or(Quatd{});
  if (!turn) space.metres_per_unit = 0;
  return space;
}

Workspace fit_workspace(const DeviceInfo& device, const Box3d& model, double size, Quatd rotation) noexcept {
  const double box_size = diagonal(model);
  if (!(box_size > 0) || !std::isfinite(box_size)) return {.rotation = rotation};
  if (!(size > 0) || !std::isfinite(size)) size = box_size;
  double span = kSpan;
  const Box3d room = workspace_of(device);
  if (!device.workspace.empty()) {
    const Vec3d needed = turned_extent(model.extent(), rotation.conjugate()) * (size / box_size);
    for (std::size_t k = 0; k < 3; ++k)
      if (room.extent()[k] > 0) span = std::min(span, size * room.extent()[k] / needed[k]);
  } else if (!room.empty()) {
    span = std::min(span, 2 * device.workspace_radius);
  }
  return {.metres_per_unit = span / size,
          .device_origin = room.empty() ? Vec3d{} : room.centre(),
          .model_origin = model.centre(),
          .rotation = rotation};
}

Workspace fit_workspace(const DeviceInfo& device, const Model& model, double metres_per_unit, Quatd rotation) noexcept {
  Workspace fitted = fit_workspace(device, bounds_of_surface(*model.head), model.info.source_diagonal, rotation);
  if (metres_per_unit > 0) fitted.metres_per_unit = metres_per_unit;
  return fitted;
}

Result<Quatd> rotation_of_axes(std::string_view map) {
  const auto refuse = [&](std::string_view why) {
    return fail(Errc::InvalidArgument, "the map of axes \"" + printable(map, 40) + "\" " + std::string(why));
  };
  // Row k of the matrix is the model's axis k along the device's; so column j is where the device's axis j goes.
  std::array<Vec3d, 3> columns;
  std::array<bool, 3> used{};
  std::string_view rest = map;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string_view word = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(word.size() + 1, rest.size()));
    const bool back = word.starts_with('-');
    const std::string_view axis = word.substr(back || word.starts_with('+') ? 1 : 0);
    const std::size_t which = axis.size() == 1 ? std::string_view("xyz").find(axis[0]) : std::string_view::npos;
    if (which == std::string_view::npos || (k == 2 ? map.ends_with(',') || !rest.empty() : rest.empty()))
      return refuse("must name three axes, such as y,-x,z");
    if (used[which]) return refuse("names an axis twice");
    used[which] = true;
    columns[which][k] = back ? -1 : 1;
  }
  if (dot(cross(columns[0], columns[1]), columns[2]) < 0)
    return refuse("is a mirror, in which torques turn the wrong way; change the sign of one axis");
  return rotation_to(columns);
}

}  // namespace relief
