// Between the document's thread and Qt's: events become signals, bursts become one.
#pragma once

#include <relief/session/document.h>

#include <QObject>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace relief::studio {

/// Owns the open document. Its events arrive as signals on the thread that made the bridge; of snapshots only the
/// newest waits, with the union of the boxes.
class DocumentBridge : public QObject {
  Q_OBJECT
 public:
  explicit DocumentBridge(QObject* parent = nullptr);
  ~DocumentBridge() override;

  /// Goes on with a file; what was open is closed first. Errors: those of Document::open() and of closing.
  [[nodiscard]] Status open(const std::filesystem::path& place, ModelFile file);
  /// How documents that are opened from now on make room; room_maker() where nobody says otherwise.
  void make_room_with(RoomMaker make) { make_room_ = std::move(make); }
  /// Everything is in the file when it returns without an error.
  [[nodiscard]] Status close();
  /// Null when nothing is open.
  [[nodiscard]] Document* document() const { return document_.get(); }
  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] SnapshotPtr head() const { return document_ ? document_->head() : nullptr; }
  /// Does nothing when no document is open.
  void post(Command command);

 signals:
  void opened();
  /// The document is about to go: what works on it must end now.
  void closing();
  void closed();
  void snapshotChanged(const relief::Box3d& box);
  void strokeFinished(const relief::StrokeFinished& stroke);
  void strokeRefused();
  void historyChanged(const relief::HistoryChanged& history);
  void historyDropped(quint64 steps);
  void saved(quint64 stroke);
  void savedElsewhere(const QString& file, bool whole);
  void limitReached(const relief::StrokeResult& so_far);
  void pointMissed(const relief::Vec3d& at);
  void detailLimited(const relief::Vec3d& at);
  void takenBeside(const relief::Vec3d& at);
  void roomAsked(quint32 source, bool runs_out);
  void roomEnded(const relief::RoomEnded& room);
  void cageChanged(const relief::CageChanged& change);
  void progressed(const QString& phase, double share);
  void failed(const QString& message, quint64 unsaved);
  /// Saving elsewhere has ended without a new file. failed() follows where that was not `cancelled`.
  void notSavedElsewhere(bool cancelled);

 private:
  void take(const Event& event);
  void deliver();

  std::mutex mutex_;
  std::vector<Event> waiting_;
  std::optional<Box3d> changed_;
  bool called_ = false;
  std::filesystem::path file_;
  RoomMaker make_room_;
  std::unique_ptr<Document> document_;
};

}  // namespace relief::studio
