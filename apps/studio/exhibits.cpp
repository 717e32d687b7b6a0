#include "exhibits.h"

#include "languages.h"
#include "text.h"
#include "tool_state.h"

#include <relief/base/try.h>
#include <relief/file/model_file.h>

#include <QDir>
#include <QFile>
#include <QFileInfo>
#include <QJsonArray>
#include <QJsonDocument>
#include <QJsonObject>
#include <cmath>

namespace relief::studio {

namespace {

/// What fits beside a model and is read by people who stand.
constexpr qsizetype kMostSentences = 3;
constexpr int kLeastTimeout = 2, kMostTimeout = 3600;

const QStringList& usual_tools() {
  static const QStringList tools = {"touch", "carve", "deposit", "smooth", "paint"};
  return tools;
}

/// Reads one caption file; the first fault is kept.
class CaptionReader {
 public:
  CaptionReader(QString file, Exhibit& into) : file_(std::move(file)), into_(into) {}

  Status read() {
    QFile in(file_);
    if (!in.open(QIODevice::ReadOnly))
      return fault(QStringLiteral("cannot be read; give the kiosk's user the right to"));
    const QByteArray bytes = in.readAll();
    QJsonParseError error;
    const QJsonDocument whole = QJsonDocument::fromJson(bytes, &error);
    if (error.error != QJsonParseError::NoError) {
      const qsizetype line = bytes.left(error.offset).count('\n') + 1;
      return fault(QStringLiteral("line %1 is no JSON: %2").arg(line).arg(error.errorString()));
    }
    if (!whole.isObject()) return fault(QStringLiteral("must be one JSON object, {\"title\": ...}"));
    const QJsonObject all = whole.object();
    for (auto each = all.begin(); each != all.end(); ++each) RELIEF_CHECK(take(each.key(), each.value()));
    return {};
  }

 private:
  Status take(const QString& key, const QJsonValue& value) {
    if (key == QLatin1String("title")) return titles(value);
    if (key == QLatin1String("sentences")) return all_sentences(value);
    if (key == QLatin1String("tools")) return tools(value);
    if (key == QLatin1String("force_cap")) return number(key, value, 0, 1, into_.force_cap);
    if (key == QLatin1String("timeout_s")) {
      double seconds = 0;
      RELIEF_CHECK(number(key, value, kLeastTimeout, kMostTimeout, seconds));
      into_.timeout_s = static_cast<int>(std::lround(seconds));
      return {};
    }
    return fault(QStringLiteral(
                     "has \"%1\", which means nothing here; there are title, sentences, tools, force_cap and timeout_s")
                     .arg(key));
  }

  Status titles(const QJsonValue& value) {
    return by_language(QStringLiteral("title"), value,
                       [this](const QString& language, const QJsonValue& words) -> Status {
                         if (!words.isString() || words.toString().trimmed().isEmpty())
                           return fault(QStringLiteral("\"title\" must be words in quotes"));
                         into_.captions[language].title = words.toString();
                         return {};
                       });
  }

  Status all_sentences(const QJsonValue& value) {
    return by_language(
        QStringLiteral("sentences"), value, [this](const QString& language, const QJsonValue& list) -> Status {
          if (!list.isArray())
            return fault(QStringLiteral("\"sentences\" must be a list of sentences, or one list for each language"));
          QStringList sentences;
          for (const QJsonValue& each : list.toArray()) {
            if (!each.isString()) return fault(QStringLiteral("\"sentences\" must hold words in quotes"));
            sentences.append(each.toString());
          }
          if (sentences.size() > kMostSentences)
            return fault(QStringLiteral("\"sentences\" has %1 sentences; people who stand read three at most")
                             .arg(sentences.size()));
          into_.captions[language].sentences = sentences;
          return {};
        });
  }

  /// The value itself is for all languages, an object has one value for each.
  template <typename Take>
  Status by_language(const QString& key, const QJsonValue& value, const Take& take_one) {
    if (!value.isObject()) return take_one(QString(), value);
    const QJsonObject each_language = value.toObject();
    for (auto each = each_language.begin(); each != each_language.end(); ++each) {
      if (each.key().size() != 2)
        return fault(QStringLiteral("\"%1\" has the language \"%2\"; languages are two letters such as en or de")
                         .arg(key, each.key()));
      RELIEF_CHECK(take_one(each.key(), each.value()));
    }
    return {};
  }

  Status tools(const QJsonValue& value) {
    if (!value.isArray() || value.toArray().isEmpty())
      return fault(QStringLiteral("\"tools\" must be a list of at least one tool"));
    into_.tools.clear();
    for (const QJsonValue& each : value.toArray()) {
      const QString id = each.toString();
      if (!ToolState::ids().contains(id))
        return fault(QStringLiteral("\"tools\" has \"%1\", which is no tool; there are %2")
                         .arg(id, ToolState::ids().join(QStringLiteral(", "))));
      if (!into_.tools.contains(id)) into_.tools.append(id);
    }
    return {};
  }

  Status number(const QString& key, const QJsonValue& value, double least, double most, double& into) {
    if (!value.isDouble() || value.toDouble() < least || value.toDouble() > most)
      return fault(QStringLiteral("\"%1\" must be a number from %2 to %3").arg(key).arg(least).arg(most));
    into = value.toDouble();
    return {};
  }

  [[nodiscard]] std::unexpected<Error> fault(const QString& words) const {
    return fail(Errc::InvalidArgument, (file_ + QStringLiteral(": ") + words).toStdString());
  }

  QString file_;
  Exhibit& into_;
};

}  // namespace

const Exhibit::Caption& Exhibit::caption(const QString& language) const {
  for (const QString& each : {language, QString(), QStringLiteral("en")})
    if (const auto found = captions.find(each); found != captions.end()) return found->second;
  return captions.begin()->second;
}

Result<Exhibit> read_exhibit(const QString& model) {
  Exhibit exhibit;
  const QFileInfo place(model);
  exhibit.model = place.absoluteFilePath();
  exhibit.tools = usual_tools();
  const QString file = place.absolutePath() + QLatin1Char('/') + place.completeBaseName() + QStringLiteral(".json");
  if (QFile::exists(file)) {
    RELIEF_CHECK(CaptionReader(file, exhibit).read());
  }
  if (exhibit.captions.empty()) exhibit.captions[QString()] = {};
  // A language that has no title of its own has the one for all, else the file's name.
  const auto shared = exhibit.captions.find(QString());
  const QString usual = shared != exhibit.captions.end() && !shared->second.title.isEmpty() ? shared->second.title
                                                                                            : place.completeBaseName();
  for (auto& [code, caption] : exhibit.captions)
    if (caption.title.isEmpty()) caption.title = usual;
  return exhibit;
}

Result<std::vector<Exhibit>> read_exhibits(const QStringList& models_or_folders) {
  QStringList models;
  for (const QString& given : models_or_folders) {
    const QFileInfo place(given);
    if (!place.exists()) return fail(Errc::NotFound, given.toStdString() + ": there is no such model or folder");
    if (!place.isDir()) {
      models.append(given);
      continue;
    }
    const QDir folder(given);
    const QStringList inside = folder.entryList({QStringLiteral("*.relief")}, QDir::Files, QDir::Name);
    if (inside.isEmpty())
      return fail(Errc::InvalidArgument,
                  given.toStdString() + ": the folder has no .relief model; `relief convert` makes one of a scan");
    for (const QString& name : inside) models.append(folder.filePath(name));
  }
  std::vector<Exhibit> exhibits;
  for (const QString& model : models) {
    RELIEF_TRY(Exhibit exhibit, read_exhibit(model));
    RELIEF_TRY(const ModelFile whole, ModelFile::open(path(exhibit.model), true));
    exhibits.push_back(std::move(exhibit));
  }
  return exhibits;
}

}  // namespace relief::studio
