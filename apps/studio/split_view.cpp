#include "split_view.h"

#include <utility>

namespace relief::studio {

namespace {

/// Half as wide a view shows as much of the model from twice as far.
constexpr double kHalf = 2;

void step_back(Viewport& view, double factor) {
  if (view.scene().model || view.scene().mesh)
    view.set_camera(zoom(view.camera(), factor, std::nullopt, view.extent()));
}

}  // namespace

SplitView::SplitView(DocumentBridge& bridge, ToolState& tools, QWidget* parent)
    : QSplitter(Qt::Horizontal, parent), bridge_(bridge), tools_(tools), shaded_(new Viewport(bridge, tools, this)) {
  setObjectName(QStringLiteral("views"));
  setChildrenCollapsible(false);
  addWidget(shaded_);
  note_strokes(*shaded_);
  connect(shaded_, &Viewport::sceneChanged, this, [this] { last_stroke_ = {}; });
}

void SplitView::repeat_stroke() {
  if (analysis_ == nullptr || !analysis_->busy()) shaded_->repeat_stroke(last_stroke_);
}

Viewport& SplitView::pointed_at() { return analysis_ != nullptr && analysis_->underMouse() ? *analysis_ : *shaded_; }

void SplitView::set_map(NavigationMap map) {
  shaded_->set_map(map);
  if (analysis_ != nullptr) analysis_->set_map(map);
}

void SplitView::set_turntable(bool turntable) {
  shaded_->set_turntable(turntable);
  if (analysis_ != nullptr) analysis_->set_turntable(turntable);
}

void SplitView::note_strokes(Viewport& view) {
  connect(&view, &Viewport::strokeMade, this, [this](const PointerStroke& stroke) { last_stroke_ = stroke; });
}

void SplitView::show_map(std::optional<Look::Map> map) {
  if (map.value_or(Look::Map::None) == Look::Map::None) {
    if (analysis_ == nullptr) return;
    delete std::exchange(analysis_, nullptr);
    step_back(*shaded_, 1 / kHalf);
    return;
  }
  if (analysis_ == nullptr) make();
  Look look = shaded_->look();
  look.map = *map;
  analysis_->set_look(look);
}

void SplitView::set_look(const Look& look) {
  shaded_->set_look(look);
  if (analysis_ == nullptr) return;
  Look mapped = look;
  mapped.map = analysis_->look().map;
  analysis_->set_look(mapped);
}

void SplitView::make() {
  analysis_ = new Viewport(bridge_, tools_, this);
  analysis_->setObjectName(QStringLiteral("analysis"));
  analysis_->setAccessibleName(tr("Analysis view"));
  addWidget(analysis_);
  note_strokes(*analysis_);
  setSizes({width() / 2, width() / 2});
  analysis_->set_final_samples(shaded_->final_frame().samples);
  analysis_->set_up(shaded_->up());
  analysis_->set_map(shaded_->map());
  analysis_->set_turntable(shaded_->turntable());
  analysis_->set_scene(shaded_->scene(), shaded_->unit(), false);
  analysis_->set_camera(shaded_->camera());
  connect(&bridge_, &DocumentBridge::snapshotChanged, analysis_, [this] { analysis_->set_model(bridge_.head()); });
  connect(shaded_, &Viewport::sceneChanged, analysis_, [this] {
    analysis_->set_scene(shaded_->scene(), shaded_->unit(), false);
    analysis_->set_camera(shaded_->camera());
  });
  follow(*shaded_, *analysis_);
  follow(*analysis_, *shaded_);
  step_back(*shaded_, kHalf);
  emit analysisMade(analysis_);
}

void SplitView::follow(Viewport& leader, Viewport& follower) {
  connect(&leader, &Viewport::cameraChanged, analysis_, [this, &leader, &follower] {
    if (std::exchange(following_, true)) return;
    follower.set_camera(leader.camera());
    following_ = false;
  });
}

}  // namespace relief::studio
