#include "bridge.h"

#include "text.h"

#include <relief/base/try.h>
#include <relief/convert/room.h>

#include <utility>

namespace relief::studio {

DocumentBridge::DocumentBridge(QObject* parent) : QObject(parent) {}

DocumentBridge::~DocumentBridge() {
  if (!document_) return;
  emit closing();
  (void)document_->close();
}

Status DocumentBridge::open(const std::filesystem::path& place, ModelFile file) {
  RELIEF_CHECK(close());
  DocumentSettings settings;
  settings.make_room = make_room_ ? make_room_ : room_maker(file.model().info.source_diagonal);
  settings.on_event = [this](const Event& event) { take(event); };
  RELIEF_TRY(Document made, Document::open(place, std::move(file), std::move(settings)));
  document_ = std::make_unique<Document>(std::move(made));
  file_ = place;
  emit opened();
  return {};
}

Status DocumentBridge::close() {
  if (!document_) return {};
  emit closing();
  const Status closed = document_->close();
  if (!closed) return closed;
  document_.reset();
  file_.clear();
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  changed_.reset();
  emit this->closed();
  return {};
}

void DocumentBridge::post(Command command) {
  if (document_) document_->post(std::move(command));
}

/// Edit thread.
void DocumentBridge::take(const Event& event) {
  const std::lock_guard lock(mutex_);
  if (const auto* snapshot = std::get_if<SnapshotChanged>(&event)) {
    if (changed_)
      changed_->add(snapshot->box);
    else
      changed_ = snapshot->box;
  } else {
    waiting_.push_back(event);
  }
  if (std::exchange(called_, true)) return;
  QMetaObject::invokeMethod(this, &DocumentBridge::deliver, Qt::QueuedConnection);
}

void DocumentBridge::deliver() {
  std::vector<Event> events;
  std::optional<Box3d> changed;
  {
    const std::lock_guard lock(mutex_);
    events.swap(waiting_);
    changed.swap(changed_);
    called_ = false;
  }
  if (!document_) return;
  if (changed) emit snapshotChanged(*changed);
  for (const Event& event : events) {
    if (const auto* e = std::get_if<StrokeFinished>(&event)) emit strokeFinished(*e);
    if (std::holds_alternative<StrokeRefused>(event)) emit strokeRefused();
    if (const auto* e = std::get_if<HistoryChanged>(&event)) emit historyChanged(*e);
    if (const auto* e = std::get_if<HistoryDropped>(&event)) emit historyDropped(e->steps);
    if (const auto* e = std::get_if<Saved>(&event)) emit saved(e->stroke);
    if (const auto* e = std::get_if<SavedElsewhere>(&event)) {
      file_ = e->file;
      emit savedElsewhere(text(e->file), e->whole);
    }
    if (const auto* e = std::get_if<LimitReached>(&event)) emit limitReached(e->so_far);
    if (const auto* e = std::get_if<PointMissed>(&event)) emit pointMissed(e->at);
    if (const auto* e = std::get_if<DetailLimited>(&event)) emit detailLimited(e->at);
    if (const auto* e = std::get_if<TakenBeside>(&event)) emit takenBeside(e->at);
    if (const auto* e = std::get_if<RoomAsked>(&event)) emit roomAsked(e->source, e->runs_out);
    if (const auto* e = std::get_if<RoomEnded>(&event)) emit roomEnded(*e);
    if (const auto* e = std::get_if<CageChanged>(&event)) emit cageChanged(*e);
    if (const auto* e = std::get_if<Progressed>(&event)) emit progressed(text(e->phase), e->share);
    if (const auto* e = std::get_if<Failed>(&event)) {
      const bool cancelled = e->error.code == Errc::Cancelled;
      if (e->elsewhere) emit notSavedElsewhere(cancelled);
      if (!e->elsewhere || !cancelled) emit failed(error_text(e->error), e->unsaved);
    }
  }
}

}  // namespace relief::studio
