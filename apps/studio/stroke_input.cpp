#include "stroke_input.h"

#include <QCoreApplication>
#include <algorithm>
#include <cmath>

namespace relief::studio {

namespace {
/// ms without an event after which a pointer rests.
constexpr qint64 kRests = 12;
}  // namespace

bool StrokeInput::begin(Kind kind, const PointerSample& sample, const Camera& camera, QSizeF size, QString& why) {
  surface_ = bridge_.head();
  const auto tool = tools_.tool();
  if (!surface_ || !tool) return false;
  std::optional<Brush> brush = tools_.brush();
  if (kind == Kind::Smoothing) brush = tools_.smoothing();
  if (kind == Kind::Inverted) brush = tools_.inverted();
  if (!brush) {
    why = QCoreApplication::translate("StrokeInput", "%1 has no opposite.").arg(ToolState::title(tools_.id()));
    return false;
  }
  making_ = {.kind = kind, .camera = camera, .size = size, .samples = {}};
  hint_ = {};
  if (!hit(sample)) return false;
  open_ = true;
  events_ = 0;
  first_seconds_ = last_seconds_ = sample.seconds;
  BeginStroke start;
  start.brush = *brush;
  bridge_.post(std::move(start));
  add(sample);
  return true;
}

std::optional<RayHit> StrokeInput::hit(const PointerSample& sample) {
  const int width = static_cast<int>(making_.size.width()), height = static_cast<int>(making_.size.height());
  return raycast(*surface_, pixel_ray(making_.camera, width, height, sample.at.x(), sample.at.y()), hint_);
}

void StrokeInput::add(const PointerSample& sample) {
  ++events_;
  last_ = sample;
  since_last_.start();
  // Synthetic points of a resting pointer may be ahead of the window system's clock by a little.
  last_seconds_ = std::max(last_seconds_, sample.seconds);
  const auto found = hit(sample);
  last_hit_ = found ? std::optional(found->point.position) : std::nullopt;
  post_point();
}

void StrokeInput::post_point() {
  making_.samples.push_back({.at = last_.at, .seconds = last_seconds_, .pressure = last_.pressure});
  if (!last_hit_) return;
  const double pressure = tools_.use_pressure() ? last_.pressure : 1.0;
  bridge_.post(MoveStroke{.points = {{last_seconds_ - first_seconds_, *last_hit_, pressure}}});
}

void StrokeInput::move(const PointerSample& sample) {
  if (open_) add(sample);
}

void StrokeInput::hold() {
  if (!open_ || !last_hit_ || since_last_.elapsed() < kRests) return;
  last_seconds_ = std::max(last_seconds_, last_.seconds + 1e-9 * static_cast<double>(since_last_.nsecsElapsed()));
  post_point();
}

bool StrokeInput::repeat(const PointerStroke& stroke, QString& why) {
  if (open_ || stroke.samples.empty()) return false;
  if (!begin(stroke.kind, stroke.samples.front(), stroke.camera, stroke.size, why)) return false;
  for (std::size_t k = 1; k < stroke.samples.size(); ++k) add(stroke.samples[k]);
  end();
  return true;
}

PointerStroke StrokeInput::end() {
  if (!std::exchange(open_, false)) return {};
  bridge_.post(EndStroke{});
  surface_.reset();
  return std::exchange(making_, {});
}

void StrokeInput::cancel() {
  if (!std::exchange(open_, false)) return;
  bridge_.post(CancelStroke{});
  surface_.reset();
}

}  // namespace relief::studio
