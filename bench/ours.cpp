#include "ours.h"

#include "paper/paper_algorithm.h"

#include <relief/core/query.h>
#include <relief/haptics/touch.h>

#include <limits>

namespace relief::bench {

namespace {

constexpr double kHandMoves = 1e-3;  // s between two frames of a hand's way,
constexpr double kJumps = 0.045;     // and of one that jumps: slow enough for the device's limits
constexpr double kExtent = 0.15;     // m that the model's diagonal is for the hand
constexpr std::size_t kFew = 100;    // frames, for what takes long

constexpr double kAbove = 0.02;  // of the diagonal: where a hand starts to come down
constexpr double kNoJump =
    std::numeric_limits<double>::infinity();  // no rise of the surface counts as one: it stays as it is

/// Calls tick(cursor) for a straight way down to a cursor, in 200 ticks.
template <typename Tick>
void come_down(Vec3d cursor, Vec3d above, Tick&& tick) {
  constexpr int kTicks = 200;
  for (int k = 0; k < kTicks; ++k) tick(cursor + above * (1 - static_cast<double>(k) / kTicks));
}

class TrackedQuery final : public Contestant {
 public:
  explicit TrackedQuery(const Snapshot& model) : model_(model) {
    name = kTrackedQuery;
    cold = true;
  }
  void approach(Vec3d /*first*/, Vec3d /*up*/) override { hint_ = {}; }
  double ask(Vec3d cursor, bool /*coherent*/) override {
    const std::optional<Contact> at = probe(model_, cursor, hint_);
    return at ? at->depth + at->surface.normal.x : 0;
  }
  std::optional<Nearest> answer(Vec3d cursor, bool /*coherent*/) override {
    const std::optional<Contact> at = probe(model_, cursor, hint_);
    if (!at) return std::nullopt;
    return Nearest{.point = at->surface.position, .normal = at->surface.normal, .inside = at->touching()};
  }

 private:
  const Snapshot& model_;
  LocateHint hint_;
};

/// From nothing and over the whole surface.
class ClosestPoint final : public Contestant {
 public:
  explicit ClosestPoint(const Snapshot& model) : model_(model) {
    name = "Relief, closest point from nothing";
    most_frames = kFew;
  }
  double ask(Vec3d cursor, bool /*coherent*/) override { return closest_point(model_, cursor).position.x; }
  std::optional<Nearest> answer(Vec3d cursor, bool /*coherent*/) override {
    const SurfacePoint at = closest_point(model_, cursor);
    return Nearest{.point = at.position, .normal = at.normal, .inside = dot(cursor - at.position, at.normal) < 0};
  }

 private:
  const Snapshot& model_;
};

class ContactPoint final : public Contestant {
 public:
  explicit ContactPoint(const Surface& surface) : surface_(surface), touch_(make_touch({})) {
    name = kContactPoint;
    cold = true;
  }
  void approach(Vec3d first, Vec3d up) override {
    touch_->reset();
    come_down(first, up * (kAbove * surface_.size), [&](Vec3d p) { static_cast<void>(step(p)); });
  }
  double ask(Vec3d cursor, bool /*coherent*/) override { return step(cursor).depth; }
  std::optional<Nearest> answer(Vec3d cursor, bool /*coherent*/) override {
    const Touched felt = step(cursor);
    if (!felt.touching) return std::nullopt;
    return Nearest{.point = felt.contact_point, .normal = felt.normal, .inside = true};
  }

 private:
  [[nodiscard]] Touched step(Vec3d cursor) { return touch_->step(surface_.model, {cursor, {}}, kNoJump); }
  const Surface& surface_;
  std::unique_ptr<Touch> touch_;
};

/// The paper's 15 bisections, in the last slab, then its neighbours, then all.
class PaperQuery final : public Contestant {
 public:
  explicit PaperQuery(const Snapshot& model) : model_(model) { name = "the paper's query"; }
  void approach(Vec3d /*first*/, Vec3d /*up*/) override { last_ = kNoSlab; }
  double ask(Vec3d cursor, bool coherent) override {
    const std::optional<Nearest> found = answer(cursor, coherent);
    return found ? found->point.x : 0;
  }
  std::optional<Nearest> answer(Vec3d cursor, bool coherent) override {
    const auto at = paper::locate(model_.slab_mesh(), cursor, coherent ? last_ : kNoSlab);
    if (!at) return std::nullopt;  // the contact is lost
    last_ = at->slab;
    const SurfacePoint there = surface_point(model_, at->slab, at->u, at->v);
    return Nearest{.point = there.position, .normal = there.normal, .inside = at->alpha < there.alpha};
  }

 private:
  const Snapshot& model_;
  SlabId last_ = kNoSlab;
};

}  // namespace

TickRow::TickRow(const Surface& surface, const TouchTool& tool)
    : surface_(surface),
      settings_({.workspace = {.metres_per_unit = kExtent / surface.size, .model_origin = surface.box.centre()},
                 .tool = tool}) {
  name = kTick;
  cold = true;
  has_nearest = tool.points.empty();
}

void TickRow::approach(Vec3d first, Vec3d up) {
  servo_.emplace(settings_, DeviceInfo{});
  come_down(first, up * (kAbove * surface_.size), [&](Vec3d p) { static_cast<void>(tick(p, true)); });
}

ServoSample TickRow::tick(Vec3d cursor, bool coherent) {
  t_ += coherent ? kHandMoves : kJumps;
  const ServoSample felt =
      servo_->step(surface_.model, {.t = t_, .position = settings_.workspace.to_device(cursor), .velocity = {}});
  ++ticks_;
  latched_ += (felt.flags & bit(ServoFault::Latched)) != 0 ? 1 : 0;
  touching_ += felt.contact ? 1 : 0;
  return felt;
}

std::optional<Nearest> TickRow::answer(Vec3d cursor, bool coherent) {
  const ServoSample felt = tick(cursor, coherent);
  if (!felt.contact) return std::nullopt;
  return Nearest{.point = felt.contact_point, .normal = felt.normal, .inside = true};
}

std::size_t bytes_of(const Snapshot& model) {
  const SlabMesh& mesh = model.slab_mesh();
  std::size_t bytes = mesh.fibres().size_bytes() + mesh.slabs().size_bytes() + mesh.tree().size_bytes() +
                      mesh.tree_roots().size_bytes() + mesh.slab_count() * sizeof(Box3d);
  for (SlabId s = 0; s < mesh.slab_count(); ++s) {
    const Tile& tile = model.tile(Layer::Displacement, s);
    bytes += tile.bytes() + tile.bounds().bytes();
  }
  return bytes;
}

std::vector<std::unique_ptr<Contestant>> make_ours(const Surface& surface, double build_seconds) {
  std::vector<std::unique_ptr<Contestant>> rows;
  rows.push_back(std::make_unique<TrackedQuery>(surface.model));
  rows.push_back(std::make_unique<ClosestPoint>(surface.model));
  rows.push_back(std::make_unique<ContactPoint>(surface));
  rows.push_back(std::make_unique<TickRow>(surface, TouchTool{}));
  rows.push_back(std::make_unique<PaperQuery>(surface.model));
  const std::size_t bytes = bytes_of(surface.model);
  for (const auto& row : rows) {
    row->build_seconds = build_seconds;
    row->bytes = bytes;
  }
  return rows;
}

}  // namespace relief::bench
