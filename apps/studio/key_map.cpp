#include "key_map.h"

#include <QAction>
#include <QFile>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <QSaveFile>
#include <algorithm>
#include <utility>

namespace relief::studio {

KeyMap::KeyMap(QString file, QObject* parent) : QObject(parent), file_(std::move(file)) { read(); }

void KeyMap::read() {
  QFile in(file_);
  if (!in.open(QIODevice::ReadOnly)) return;
  const QJsonDocument all = QJsonDocument::fromJson(in.readAll());
  in.close();
  bool whole = all.isObject();
  const QJsonObject entries = all.object();
  for (auto each = entries.begin(); each != entries.end(); ++each) {
    whole = whole && each.value().isArray();
    QList<QKeySequence>& keys = own_[each.key()];
    for (const QJsonValue& value : each.value().toArray()) {
      const QKeySequence key = QKeySequence::fromString(value.toString(), QKeySequence::PortableText);
      const bool known = !key.isEmpty() && key[0].key() != Qt::Key_unknown;
      whole = whole && known;
      if (known) keys.append(key);
    }
  }
  if (whole) return;
  own_.clear();
  const QString aside = file_ + QStringLiteral(".damaged");
  QFile::remove(aside);
  QFile::rename(file_, aside);
  complaint_ = tr("Your keys could not be read; the usual ones hold. The file is now %1.").arg(aside);
}

void KeyMap::write() const {
  QJsonObject entries;
  for (const auto& [id, keys] : own_) {
    QJsonArray list;
    for (const QKeySequence& key : keys) list.append(key.toString(QKeySequence::PortableText));
    entries[id] = list;
  }
  QSaveFile out(file_);
  if (!out.open(QIODevice::WriteOnly)) return;
  out.write(QJsonDocument(entries).toJson());
  out.commit();
}

void KeyMap::take_over(const std::map<QString, QAction*>& actions) {
  for (const auto& [id, action] : actions) actions_.try_emplace(id, Entry{action, action->shortcuts()});
  apply();
}

QStringList KeyMap::ids() const {
  QStringList all;
  for (const auto& [id, entry] : actions_) all.append(id);
  return all;
}

QString KeyMap::title(const QString& id) const {
  const auto entry = actions_.find(id);
  return entry == actions_.end() ? id : entry->second.action->text().remove(QLatin1Char('&'));
}

QList<QKeySequence> KeyMap::preset(const QString& id) const {
  const auto entry = actions_.find(id);
  return entry == actions_.end() ? QList<QKeySequence>() : entry->second.preset;
}

QList<QKeySequence> KeyMap::keys(const QString& id) const {
  const auto own = own_.find(id);
  return own == own_.end() ? preset(id) : own->second;
}

QStringList KeyMap::others_with(const QKeySequence& key, const QString& id) const {
  QStringList found;
  for (const auto& [other, entry] : actions_)
    if (other != id && keys(other).contains(key)) found.append(other);
  return found;
}

void KeyMap::set(const QString& id, const QList<QKeySequence>& keys) {
  if (keys == preset(id))
    own_.erase(id);
  else
    own_[id] = keys;
  write();
  apply();
}

void KeyMap::reset(const QString& id) { set(id, preset(id)); }

void KeyMap::reset() {
  own_.clear();
  write();
  apply();
}

void KeyMap::set_single_keys(bool on) {
  single_keys_ = on;
  apply();
}

bool KeyMap::is_single(const QKeySequence& key) {
  constexpr Qt::KeyboardModifiers kCommand = Qt::ControlModifier | Qt::AltModifier | Qt::MetaModifier;
  // Below the first of Qt's own codes a key is the character that it writes.
  return !key.isEmpty() && !(key[0].keyboardModifiers() & kCommand) && key[0].key() < Qt::Key_Escape;
}

void KeyMap::apply() {
  for (const auto& [id, entry] : actions_) {
    QList<QKeySequence> now = keys(id);
    if (!single_keys_) now.removeIf(&KeyMap::is_single);
    entry.action->setShortcuts(now);
  }
  emit changed();
}

}  // namespace relief::studio
