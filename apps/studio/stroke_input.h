// From the events of a mouse or a pen to strokes of the document.
#pragma once

#include "bridge.h"
#include "tool_state.h"

#include <relief/core/query.h>
#include <relief/render/frame.h>

#include <QElapsedTimer>
#include <QPointF>
#include <QSizeF>
#include <optional>
#include <vector>

namespace relief::studio {

/// A place of the pointer, with what the pointer says about it.
struct PointerSample {
  QPointF at;           ///< pixels of the viewport
  double seconds = 0;   ///< of the event, on the window system's clock
  double pressure = 1;  ///< 0..1
};

/// A stroke as the pointer made it.
struct PointerStroke {
  enum class Kind : std::uint8_t { Own, Inverted, Smoothing };
  Kind kind = Kind::Own;
  Camera camera;
  QSizeF size;                         ///< of the viewport, pixels
  std::vector<PointerSample> samples;  ///< those of a resting pointer included; empty: there was none
};

/// One open stroke at most. Each event costs one ray against the surface as it was when the stroke began; the dabs are
/// made by the document's thread.
class StrokeInput {
 public:
  StrokeInput(DocumentBridge& bridge, ToolState& tools) : bridge_(bridge), tools_(tools) {}

  using Kind = PointerStroke::Kind;
  /// False where the pointer is beside the model, or the tool does nothing; `why` then says what people should know.
  bool begin(Kind kind, const PointerSample& sample, const Camera& camera, QSizeF size, QString& why);
  void move(const PointerSample& sample);
  /// Time goes on while the pointer rests: a point at the same place.
  void hold();
  /// Returns the stroke, for repeat(); without samples where none was open.
  PointerStroke end();
  void cancel();
  [[nodiscard]] bool open() const { return open_; }
  /// Makes a whole stroke again, where it was on the screen, with the tool in the hand on the surface of now. As
  /// begin().
  bool repeat(const PointerStroke& stroke, QString& why);
  /// Motion events that the last stroke took, those beside the model included.
  [[nodiscard]] int events() const { return events_; }

 private:
  [[nodiscard]] std::optional<RayHit> hit(const PointerSample& sample);
  void add(const PointerSample& sample);
  /// `last_`, that much time after the stroke began.
  void post_point();

  DocumentBridge& bridge_;
  ToolState& tools_;
  bool open_ = false;
  int events_ = 0;
  SnapshotPtr surface_;
  PickHint hint_;
  PointerStroke making_;
  PointerSample last_;
  std::optional<Vec3d> last_hit_;
  double last_seconds_ = 0, first_seconds_ = 0;
  QElapsedTimer since_last_;
};

}  // namespace relief::studio
