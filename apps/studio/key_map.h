// Which keys do what, and what people have changed about it.
#pragma once

#include <QKeySequence>
#include <QObject>
#include <map>

class QAction;

namespace relief::studio {

/// Sets the shortcuts of actions. What differs from their presets is kept in a file: a JSON object from the action's id
/// to a list of keys ("Ctrl+Shift+Z"). A file that is no such thing is put aside with ".damaged" at its name.
class KeyMap : public QObject {
  Q_OBJECT
 public:
  explicit KeyMap(QString file, QObject* parent = nullptr);
  /// What people should know about the file; empty where all is well.
  [[nodiscard]] const QString& complaint() const { return complaint_; }

  /// From now on these actions, by id, have their keys from here; what they have now is their preset.
  void take_over(const std::map<QString, QAction*>& actions);
  [[nodiscard]] QStringList ids() const;
  [[nodiscard]] QString title(const QString& id) const;
  [[nodiscard]] QList<QKeySequence> keys(const QString& id) const;
  [[nodiscard]] QList<QKeySequence> preset(const QString& id) const;
  /// Other actions that have this key, too.
  [[nodiscard]] QStringList others_with(const QKeySequence& key, const QString& id) const;

  void set(const QString& id, const QList<QKeySequence>& keys);
  void reset(const QString& id);
  void reset();
  /// Off: keys without Ctrl, Alt or Meta that write a character do nothing; screen readers and speech need that.
  void set_single_keys(bool on);
  [[nodiscard]] static bool is_single(const QKeySequence& key);

 signals:
  void changed();

 private:
  struct Entry {
    QAction* action = nullptr;
    QList<QKeySequence> preset;
  };
  void read();
  void write() const;
  void apply();

  QString file_, complaint_;
  std::map<QString, QList<QKeySequence>> own_;  ///< what differs from the preset, of actions that do not exist, too
  std::map<QString, Entry> actions_;
  bool single_keys_ = true;
};

}  // namespace relief::studio
