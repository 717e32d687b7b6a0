// The 1 kHz loop by hand: device, force law, newest snapshot. ServoThread and Session do this for you.
#include <relief/convert/convert.h>
#include <relief/core/snapshot_channel.h>
#include <relief/devices/open_device.h>
#include <relief/haptics/servo.h>
#include <relief/mesh/samples.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

int main() {
  using namespace std::chrono_literals;
  const auto mesh = relief::make_sample("pumpkin", 20'000);
  if (!mesh) return 1;
  const auto made = relief::convert(*mesh, {.slabs = 100, .intervals = 16});
  if (!made) return 1;
  const relief::SnapshotPtr& model = made->model.head;
  double strongest = 0;

  // region loop
  relief::ServoSettings settings;
  settings.workspace = relief::fit_workspace(relief::DeviceInfo{}, model->slab_mesh().bounds());
  settings.force.stiffness = 400;  // N/m at the hand

  const auto device = relief::open_device("sim:hand", relief::exploring_hand(*model, settings.workspace));
  if (!device) return 1;

  relief::SnapshotChannel channel(model);  // an editor on another thread would publish here
  auto reader = channel.reader();
  relief::Servo servo(settings, (*device)->info());
  relief::DeviceState state;
  auto due = std::chrono::steady_clock::now();
  for (int tick = 0; tick < 2000 && (*device)->read(state); ++tick) {
    const relief::ServoSample sample = servo.step(reader.latest(), state);
    if (!(*device)->write(servo.command())) break;
    strongest = std::max(strongest, length(sample.force));
    std::this_thread::sleep_until(due += 1ms);
  }
  (void)(*device)->write({});  // an explicit zero, never just silence
  // end loop

  std::printf("strongest force %.2f N\n", strongest);
  return strongest > 0 ? 0 : 1;
}
