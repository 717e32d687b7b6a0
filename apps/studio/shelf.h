// Where models lie: recent ones, those without a name yet, and what a crash has left (XDG folders).
#pragma once

#include <QDateTime>
#include <QObject>
#include <QString>
#include <vector>

namespace relief::studio {

struct ShelfEntry {
  QString file, title;
  QDateTime used;
  quint64 strokes = 0;
  bool unnamed = false;
  QString picture;  ///< a PNG; empty where there is none
};

/// Reads and writes $XDG_STATE_HOME/relief. A list that cannot be read is put aside with ".damaged" at its name, and
/// `complaint` says so.
class Shelf : public QObject {
  Q_OBJECT
 public:
  explicit Shelf(QObject* parent = nullptr);

  [[nodiscard]] const std::vector<ShelfEntry>& recent() const { return recent_; }
  /// Files that a program which is no more had open: newest first.
  [[nodiscard]] const std::vector<ShelfEntry>& left_open() const { return left_open_; }
  [[nodiscard]] const QString& complaint() const { return complaint_; }

  /// A new place for a model without a name; its folder exists.
  [[nodiscard]] QString new_unnamed(const QString& title) const;
  [[nodiscard]] static bool is_unnamed(const QString& file);
  /// Where models without a name lie from now on; empty: the preset.
  static void set_unnamed_folder(const QString& folder);
  /// $XDG_STATE_HOME/relief/unnamed
  [[nodiscard]] static QString preset_unnamed_folder();
  /// The file is open now: it becomes the newest, and would be found by left_open() after a crash.
  void opened(const QString& file, const QString& title, quint64 strokes);
  void stroked(quint64 strokes);
  /// Nothing is open any more, in order.
  void closed();
  void forget(const QString& file);
  /// Where the picture of a model on the start page lies.
  [[nodiscard]] static QString picture_of(const QString& file);

 signals:
  void changed();

 private:
  void read();
  void write();
  void find_left_open();
  void mark();

  std::vector<ShelfEntry> recent_, left_open_;
  QString complaint_;
  ShelfEntry open_;
};

/// $XDG_STATE_HOME/relief and its like; made when they are missing.
[[nodiscard]] QString state_folder();
[[nodiscard]] QString config_folder();
[[nodiscard]] QString data_folder();
[[nodiscard]] QString cache_folder();

}  // namespace relief::studio
