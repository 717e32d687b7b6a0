// The forces of a servo on scripted motions, written to a file by one build and compared by another.
#include "support/shells.h"

#include <relief/haptics/servo.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <vector>

namespace relief {
namespace {

constexpr double kAllowed = 1e-9;  // N
constexpr int kTicks = 4000;

/// Over, along, through and out of a bumpy ball, with jumps; whatever the mathematics library says of sines, both
/// builds hear the same.
std::vector<double> forces() {
  const SnapshotPtr model = testing::displaced(testing::sphere_shell(3, 12),
                                               [](Vec3d p) { return 0.5 + 0.03 * p.x * p.y + 0.1 * p.z * p.z * p.x; });
  std::vector<double> all;
  for (const ForceSettings& law :
       {ForceSettings{}, ForceSettings{.damping = 2, .friction = 0.5},
        ForceSettings{.stiffness = 900, .damping = 0, .friction = 0.2, .exact_normals = true},
        ForceSettings{.damping = 1, .paper_contact = true}}) {
    Servo servo({.workspace = {.metres_per_unit = 0.05}, .force = law}, {});
    for (int k = 0; k < kTicks; ++k) {
      const double phase = (k % 1000) / 1000.0, turn = 1e-3 * k;
      // Down, along and up again; the fourth time right through the middle.
      const double reach = k < 3000 ? 1.3 - 1.5 * phase * (1 - phase) : 1.3 - 2.6 * phase;
      const Vec3d way = normalized(Vec3d{1 - turn, 0.3 + 0.5 * turn * (k % 7 == 0 ? 1.001 : 1), 0.4 * turn});
      DeviceState reading;
      reading.t = k * 1e-3;
      reading.position = way * (reach * 0.05);
      const ServoSample sample = servo.step(*model, reading);
      all.insert(all.end(), {sample.force.x, sample.force.y, sample.force.z});
    }
  }
  return all;
}

int write(const std::vector<double>& values, const char* name) {
  std::FILE* file = std::fopen(name, "wb");
  const bool done = file != nullptr && std::fwrite(values.data(), sizeof(double), values.size(), file) == values.size();
  return file != nullptr && std::fclose(file) == 0 && done ? 0 : 1;
}

int compare(const std::vector<double>& values, const char* name) {
  std::vector<double> other(values.size() + 1);
  std::FILE* file = std::fopen(name, "rb");
  if (file == nullptr) return 1;
  other.resize(std::fread(other.data(), sizeof(double), other.size(), file));
  std::fclose(file);
  if (other.size() != values.size()) return 1;
  double largest = 0, strongest = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    largest = std::max(largest, std::abs(values[k] - other[k]));
    strongest = std::max(strongest, std::abs(values[k]));
  }
  const bool same = std::memcmp(values.data(), other.data(), values.size() * sizeof(double)) == 0;
  std::printf(
      "S19: %zu ticks, components up to %.2f N: largest difference between -O0 and -O3 %.3g N (allowed %.0e)%s\n",
      values.size() / 3, strongest, largest, kAllowed, same ? ", the same bit for bit" : "");
  return largest <= kAllowed && strongest > 1 ? 0 : 1;
}

}  // namespace
}  // namespace relief

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::vector<double> values = relief::forces();
  return std::string_view(argv[1]) == "write" ? relief::write(values, argv[2]) : relief::compare(values, argv[2]);
}
