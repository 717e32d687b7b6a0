// Relief's own rows, and the paper's algorithm on the same slabs.
#pragma once

#include "contestant.h"

#include <relief/core/snapshot.h>
#include <relief/haptics/servo.h>

#include <memory>
#include <optional>
#include <vector>

namespace relief::bench {

/// The tracked query, which remembers the last answer as all rows do.
inline constexpr const char* kTrackedQuery = "Relief, tracked query";
inline constexpr const char* kContactPoint = "Relief, contact point";
inline constexpr const char* kTick = "Relief, whole tick";

/// A servo tick with a tool: what a session does between a reading and its force, with the guard on.
class TickRow final : public Contestant {
 public:
  /// The surface and the points of the tool must outlive it.
  TickRow(const Surface& surface, const TouchTool& tool);
  /// Comes down to the first cursor from 2 % of the diagonal above it, as a hand does.
  void approach(Vec3d first, Vec3d up) override;
  double ask(Vec3d cursor, bool coherent) override { return length(tick(cursor, coherent).force); }
  std::optional<Nearest> answer(Vec3d cursor, bool coherent) override;

  /// One tick; a way that is not coherent is one of fast moves within the device's limits.
  ServoSample tick(Vec3d cursor, bool coherent);
  [[nodiscard]] const Workspace& workspace() const noexcept { return settings_.workspace; }
  /// Ticks since it was made, and those of them in which the tool touched, and in which the servo was in its safe
  /// state.
  [[nodiscard]] std::size_t ticks() const noexcept { return ticks_; }
  [[nodiscard]] std::size_t touching() const noexcept { return touching_; }
  [[nodiscard]] std::size_t latched() const noexcept { return latched_; }

 private:
  const Surface& surface_;
  ServoSettings settings_;
  std::optional<Servo> servo_;
  double t_ = 0;
  std::size_t ticks_ = 0, touching_ = 0, latched_ = 0;
};

/// Bytes of the cage and the displacement, which is all that touch reads of a plain model.
[[nodiscard]] std::size_t bytes_of(const Snapshot& model);

/// The tracked query, the closest point from nothing, the contact point, the whole tick with a point and with a ball of
/// 1 % of the diagonal, and the paper's query. `build_seconds`: CPU, of the conversion that made the model. The
/// surface must outlive them.
[[nodiscard]] std::vector<std::unique_ptr<Contestant>> make_ours(const Surface& surface, double build_seconds);

}  // namespace relief::bench
