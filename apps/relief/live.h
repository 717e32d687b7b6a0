// What the live commands share: the device by its name, how the model lies in its workspace, and what is said of a run.
#pragma once

#include "commands.h"
#include "force_file.h"

#include <relief/session/recorder.h>
#include <relief/session/replay.h>
#include <relief/session/session.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relief::cli {

struct LiveOptions {
  std::string model, device, record;
  double metres_per_unit = 0;
  std::string axis_map;
  Quatd axes;  ///< from the device's to the model's
  double seconds = 0;
  ForceSettings force;
  ReadingSettings readings;
  int clutch_button = 0;  ///< 1 to 8; 0: none
  LossSettings loss;
  double tool_radius = 0;
  bool names_tool = false;  ///< an option says which
  std::string tool_points;
};

/// --device, --seconds, --record, those of the force, of the hand and of what it holds.
void add_live_options(CLI::App& command, LiveOptions& o);
/// What follows from them once all are read: to be called when the command line is whole. Guarded unless it says no.
void complete(const CLI::App& command, LiveOptions& o, bool guarded);

/// What the user learns from a run, whichever way it went.
struct Summary {
  std::uint64_t ticks = 0, contact = 0, flagged = 0;
  std::uint32_t flags = 0;
  double force_max = 0, depth_max = 0;

  void add(const ServoSample& sample) {
    ++ticks;
    contact += sample.contact ? 1U : 0U;
    flagged += sample.flags != 0 ? 1U : 0U;
    flags |= sample.flags;
    force_max = std::max(force_max, length(sample.force));
    depth_max = std::max(depth_max, sample.depth);
  }
};

/// A device, and how the model lies in its workspace.
struct OpenedDevice {
  std::unique_ptr<HapticDevice> device;
  Workspace workspace;
  /// What a recording that is played as a device says of how it was made.
  struct Played {
    double radius = 0;
    std::vector<Vec3d> points;  ///< of a rigid tool
    bool same_model = false;    ///< it was made with this model
    std::string missing_end;    ///< a line for where its end is missing
  };
  std::optional<Played> played = {};
};

/// The recording that --device names; empty where it names another device.
[[nodiscard]] std::string played_recording(const LiveOptions& o);
/// The device by its name. A simulated hand goes over the whole model, with `buttons` down while it presses; a
/// recording is played where it was made, unless the scale is given.
[[nodiscard]] Result<OpenedDevice> open_named(const LiveOptions& o, const Model& model, std::uint32_t buttons,
                                              const Progress& progress);
/// The servo's settings as the options ask for them; without a tool among them, that of a recording that is played.
/// `points` is where a rigid tool's are kept.
[[nodiscard]] Result<ServoSettings> settings_for(const LiveOptions& o, const ModelFile& file,
                                                 const Workspace& workspace,
                                                 const std::optional<OpenedDevice::Played>& played,
                                                 std::vector<Vec3d>& points);
/// What was taken over from a recording that is played.
void say_played(const LiveOptions& o, const OpenedDevice::Played& played, const TouchTool& tool);
/// The recorder that --record asks for.
[[nodiscard]] Result<std::optional<Recorder>> recorder_for(const LiveOptions& o, Recorder::Pace pace,
                                                           const ModelFile& file, const ServoSettings& settings,
                                                           const DeviceInfo& device);

/// Waits until the time is over, the device has ended or is given up, or somebody stops it; returns how long that was,
/// s. Without --seconds a recording is played to its end.
[[nodiscard]] double wait_for_end(const Session& session, const LiveOptions& o, const Context& context,
                                  std::string_view phase, std::size_t& told);
/// Tells of each loss of the device as it comes; `told` counts what was.
void say_losses(const std::vector<DeviceLoss>& losses, std::size_t& told);
/// DeviceLost, in the device's words, where a run ended because of it.
[[nodiscard]] Status device_lost(const LiveOptions& o, const std::vector<DeviceLoss>& losses, const ServoTimes& times);

/// How the recording ended.
[[nodiscard]] OutputEnd end_of(const LiveOptions& o, const Recorder& recorder, Status status);
/// What the run ends in, each output for itself: the first that failed, with what the others hold.
[[nodiscard]] Status end_of(const std::vector<OutputEnd>& outputs, const std::string& cancelled);
[[nodiscard]] Summary summary_of(const SessionStats& stats);
[[nodiscard]] nlohmann::ordered_json to_json(const Summary& s);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<OutputEnd>& outputs);
[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<DeviceLoss>& losses);
[[nodiscard]] nlohmann::ordered_json to_json(const ServoTimes& times);
/// The JSON, or a line for a person.
void say(const Context& context, const nlohmann::ordered_json& json, const Summary& s);
/// What a live run says when it is over.
void say_live(const Context& context, const nlohmann::ordered_json& json, const Summary& summary,
              const ServoTimes& times, const std::vector<OutputEnd>& outputs);

}  // namespace relief::cli
