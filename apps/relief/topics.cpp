// The topics of `relief help`: what needs a table, and belongs to no single option.
#include "help.h"

#include <relief/haptics/fault.h>

#include <fmt/format.h>

#include <array>

namespace relief::cli {

namespace {

constexpr std::string_view kUnits =
    "A model keeps the numbers of the mesh that it was made of. --unit says what one model unit is:\n"
    "mm, cm, m or in. Without it the file decides (3MF, glTF), else it is mm.\n"
    "\n"
    "  positions, radii, depths    model units\n"
    "  x, y, z of a path           model units\n"
    "  forces                      newtons (N), on the hand\n"
    "  torques                     newton metres (N*m)\n"
    "  stiffness                   N/m at the hand\n"
    "  damping                     N*s/m at the hand\n"
    "  times                       seconds\n"
    "  shares                      of the diagonal of the bounding box, such as 1e-4\n"
    "\n"
    "--metres-per-unit says how far the hand moves per model unit. Without it the diagonal is 0.15 m,\n"
    "or what fits the device. The unit of the model does not matter there.\n"
    "Pictures take y as up. relief export --up z turns a mesh for programs that take z as up.\n";

constexpr std::string_view kPathCsv =
    "relief touch --path P.csv -o F.csv reads a path and writes a row of forces for each of its rows.\n"
    "\n"
    "P.csv: the header t,x,y,z, then a row per tick. With --tool-points also t,x,y,z,qw,qx,qy,qz.\n"
    "  t            seconds; 0.001 from row to row is what a device does\n"
    "  x,y,z        where the tool is, model units\n"
    "  qw,qx,qy,qz  how a rigid tool is turned\n"
    "\n"
    "F.csv: the header t,x,y,z,contact,slab,u,v,alpha,depth,px,py,pz,nx,ny,nz,fx,fy,fz,flags\n"
    "  t,x,y,z      as they were read\n"
    "  contact      1 in contact, else 0\n"
    "  slab         the slab touched; -1 without contact\n"
    "  u,v,alpha    where in that slab\n"
    "  depth        how far the tool is below the surface, model units\n"
    "  px,py,pz     the contact point; without contact the tool\n"
    "  nx,ny,nz     the unit normal there, outwards\n"
    "  fx,fy,fz     the force on the hand, N\n"
    "  flags        a sum of bits: relief help flags\n"
    "  tx,ty,tz     with --tool-points: the torque on the hand, N*m\n"
    "\n"
    "  t,x,y,z\n"
    "  0.000,0,45,0\n"
    "  0.001,0,44.9,0\n";

constexpr std::string_view kStrokes =
    "relief sculpt --strokes S.json plays a list of strokes:\n"
    "\n"
    "  [{\"tool\": \"carve\", \"radius\": 2, \"points\": [[0, 0, 40, 0, 1], [0.1, 1, 40, 0, 1]]}]\n"
    "\n"
    "  tool            carve, deposit, paint, ...: relief sculpt --help\n"
    "  radius          model units\n"
    "  points          [[t, x, y, z, pressure], ...]: seconds, model units, 0 to 1\n"
    "  strength        0 to 1 [1]\n"
    "  colour          [r, g, b], 0 to 255; paint needs it\n"
    "  resilience      carve: thickness of the band that yields uncut, model units [0]\n"
    "  exact           carve: true cuts with the ball itself, to the sample [false]\n"
    "  height          layer: how high it rises, model units [10 % of the radius]\n"
    "  falloff         own, linear, smooth or dome [own]\n"
    "  pressure_curve  {\"low\": 0, \"high\": 1, \"exponent\": 1}\n"
    "  pressure_drives strength, radius or both [strength]\n"
    "  detail          spacing of samples under the tool, share of its radius; 0: as it is [1/12]\n"
    "  stabiliser      how far the tool trails the points, model units [0]\n"
    "  symmetry        \"x\", \"xy\", ...: axes across which each dab is mirrored\n"
    "  mirror          [x, y, z]: a point on the mirror planes [0, 0, 0]\n"
    "  tip             true: the points are where the tool's lowest point was [false]\n"
    "  label           its name in the history\n";

/// What each bit of `flags` says, from bit 0 on. The first column is what F.csv adds up.
constexpr std::array<std::string_view, 21> kFlags = {
    "the position is not finite, out of reach, or frozen",
    "the time stands still, runs back, or jumps by 50 ms or more",
    "the position moves faster than 10 m/s",
    "no force until the hand has lifted off, after a fault",
    "the force was limited to what the device can do",
    "the change of the force was limited",
    "a setting was above what the device allows",
    "the first reading was inside: no force until the tool has left",
    "the device does not answer",
    "a tick came more than a period late",
    "a sample before this one is missing",
    "the model rose by more than 3 mm under the tool",
    "damped: the hand had got more energy than it had put in",
    "limited by what the motors bear for long",
    "braked: the hand was faster than the device allows",
    "the servo stood still for more than 50 ms",
    "stiffness was lowered, because many ticks come late",
    "no new reading: the last force is held, for at most 20 ms",
    "the pen turns and does not move: is the arm calibrated?",
    "the first reading after the device did not answer",
    "the device has switched its forces off itself",
};

std::string flags_text() {
  std::string text = "flags in F.csv is the sum of these; 0 says that nothing was limited or wrong.\n\n";
  for (std::size_t k = 0; k < kFlags.size(); ++k)
    text += fmt::format("  {:>7}  {:18}  {}\n", 1U << k, name(static_cast<ServoFault>(1U << k)), kFlags[k]);
  return text;
}

}  // namespace

const std::vector<Topic>& topics() {
  static const std::vector<Topic> all = {{"units", "UNITS", std::string(kUnits)},
                                         {"flags", "FLAGS", flags_text()},
                                         {"path-csv", "PATHS AND FORCES", std::string(kPathCsv)},
                                         {"strokes", "STROKES", std::string(kStrokes)}};
  return all;
}

}  // namespace relief::cli
