// Where the tool is in the model: the workspace, and what clutch and re-centring have moved it by.
#pragma once

#include <relief/haptics/readings.h>
#include <relief/haptics/workspace.h>

#include <cstdint>
#include <optional>

namespace relief {

/// Says how a hand goes on over a model that is larger than its reach.
struct Clutch {
  bool held = false;          ///< the device moves, and the tool in the model stays where it is, with its force
  std::uint32_t buttons = 0;  ///< the same while one of these is down
  /// Any other number than the one before puts the tool at `centre`, wherever the device is then.
  std::uint32_t recentre = 0;
  Vec3d centre = {};  ///< model units
};

/// A small state, no allocation.
class Placement {
 public:
  /// Begins at a workspace.
  Placement(const Workspace& workspace, const Clutch& clutch) noexcept;
  /// Takes another workspace or clutch, over the next ticks where the tool touches.
  void set(const Workspace& workspace, const Clutch& clutch) noexcept;
  /// As it was set, except for what clutch and re-centring have moved it by: in the last tick, and in the one to come.
  [[nodiscard]] const Workspace& workspace() const noexcept { return space_; }
  /// Returns the workspace of the next tick.
  [[nodiscard]] Workspace next_workspace() const noexcept { return due_ ? wanted() : space_; }

  /// The workspace lies otherwise than in the last tick, though the hand did nothing.
  struct Change {
    Workspace was;  ///< the workspace before
    Vec3d device;   ///< m, where the device was then
  };
  /// Says where the hand is in the model.
  struct Place {
    Vec3d cursor;           ///< model units; the last good one where the position is no good
    Quatd orientation;      ///< from the tool's frame to the model's
    bool clutched = false;  ///< the tool stays, whatever the hand does
    double loose = 0;       ///< 0..1: how much of the hand's velocity is not the tool's
    /// the cursor, and its way in this tick, model units
    Vec3d hand, step,
        turn;        ///< m, m and rad, along the model's axes: the hand's place except for an origin; since the last
    Vec3d velocity;  ///< m/s of the hand, along the model's axes
    std::optional<Change> change = {};  ///< set where the workspace has changed
  };
  /// Returns one tick with a reading, which has been judged in next_workspace().
  [[nodiscard]] Place place(const Readings::Judged& now, Vec3d device) noexcept;

 private:
  /// Returns what the settings ask for, and the drift.
  [[nodiscard]] Workspace wanted() const noexcept;
  /// The tool stays where it was, wherever the hand went.
  void stay(const Readings::Judged& now, Vec3d device) noexcept;

  Workspace set_, applied_;  ///< as it was requested last, and as it was in the last tick
  Workspace space_;          ///< in use
  Clutch clutch_;
  bool due_ = false, recentre_due_ = false;
  Vec3d drift_;         ///< m, what clutch and re-centring have moved the device's origin by
  Quatd grip_;          ///< what the clutch has turned the tool in the hand by
  bool known_ = false;  ///< a good reading has come
  Vec3d device_;        ///< m, the last good one's position
  Vec3d cursor_;        ///< model units, the tool's in the last good tick
  Quatd orientation_;   ///< the tool's in the last tick
  double loose_ = 0;
};

}  // namespace relief
