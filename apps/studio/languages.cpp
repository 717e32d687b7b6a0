#include "languages.h"

#include "tool_state.h"

#include <QApplication>
#include <QLibraryInfo>
#include <QLocale>
#include <QTranslator>
#include <QWidget>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

namespace relief::studio {

namespace {

const QString kInvented = QStringLiteral("xx");
/// By how much the words of the invented language are longer: what German adds to short English labels.
constexpr double kLonger = 0.4;
/// Letters of a word of it, with the space before.
constexpr qsizetype kWord = 9;

/// How much of `words` from `at` on is no text: a place for a value, a tag, a character by its name, a file pattern.
qsizetype kept_at(const QString& words, qsizetype at) {
  const QChar c = words[at];
  const auto until = [&](QChar end) { return words.indexOf(end, at) + 1 - at; };
  if (c == u'%' && at + 1 < words.size() && (words[at + 1].isDigit() || words[at + 1] == u'n' || words[at + 1] == u'L'))
    return 2;
  if (c == u'<') return std::max<qsizetype>(until(u'>'), 1);
  if (c == u'&') return 1;
  if (c == u'(' && words.mid(at + 1).startsWith(u'*')) return std::max<qsizetype>(until(u')'), 1);
  return 0;
}

QChar accented(QChar c) {
  static constexpr std::u16string_view kPlain = u"AaCcEeGgHhIiJjKkLlNnOoRrSsTtUuWwYyZz";
  static constexpr std::u16string_view kWith = u"ÅåÇçÉéĞğĤĥÎîĴĵĶķĻļÑñÖöŔŕŠšŢţÛûŴŵÝýŽž";
  const auto at = kPlain.find(c.unicode());
  return at == std::u16string_view::npos ? c : QChar(kWith[at]);
}

class InventedTranslator : public QTranslator {
 public:
  using QTranslator::QTranslator;
  QString translate(const char*, const char* words, const char*, int) const override {
    return invented(QString::fromUtf8(words));
  }
  bool isEmpty() const override { return false; }
};

/// Sets accessible names back to English where they are the translations of names that tests rely on.
class NameKeeper : public QObject {
 public:
  using QObject::QObject;
  bool eventFilter(QObject* object, QEvent* event) override {
    if (event->type() == QEvent::Polish && object->isWidgetType()) keep(*static_cast<QWidget*>(object));
    return false;
  }

 private:
  static void keep(QWidget& widget) {
    const QString name = widget.accessibleName();
    if (name.isEmpty()) return;
    for (const QString& english : test_names())
      if (is_translation(widget, name, english)) {
        widget.setAccessibleName(english);
        return;
      }
  }
  /// Words are translated by the class that says them: that of the widget, or of one that it is in.
  static bool is_translation(const QWidget& widget, const QString& name, const QString& english) {
    const QByteArray words = english.toUtf8();
    if (QCoreApplication::translate("Tools", words) == name) return true;
    for (const QObject* each = &widget; each != nullptr; each = each->parent())
      for (const QMetaObject* type = each->metaObject(); type != nullptr; type = type->superClass())
        if (QCoreApplication::translate(type->className(), words) == name) return true;
    return false;
  }
};

struct InUse {
  QString code = QStringLiteral("en");
  std::vector<std::unique_ptr<QTranslator>> translators;
  std::unique_ptr<NameKeeper> names;
};

InUse& in_use() {
  static InUse current;
  return current;
}

void add(InUse& current, QApplication& application, std::unique_ptr<QTranslator> translator) {
  application.installTranslator(translator.get());
  current.translators.push_back(std::move(translator));
}

}  // namespace

const QStringList& languages() {
  static const QStringList all = {QStringLiteral("en"), QStringLiteral("de")};
  return all;
}

QString language_title(const QString& code) {
  return code == QLatin1String("de") ? QStringLiteral("Deutsch") : QStringLiteral("English");
}

QString language_for(const QString& asked) {
  if (asked == kInvented || languages().contains(asked)) return asked;
  for (const QString& wanted : QLocale::system().uiLanguages())
    if (const QString code = wanted.section(QLatin1Char('-'), 0, 0); languages().contains(code)) return code;
  return languages().first();
}

void use_language(QApplication& application, const QString& code) {
  InUse& current = in_use();
  for (const auto& each : current.translators) application.removeTranslator(each.get());
  current.translators.clear();
  current.names.reset();
  current.code = code;
  if (code == kInvented) {
    add(current, application, std::make_unique<InventedTranslator>());
  } else {
    // English too: "%n slab(s)" has a form for one and one for many.
    auto own = std::make_unique<QTranslator>();
    if (own->load(QStringLiteral(":/relief/words/relief_%1.qm").arg(code))) add(current, application, std::move(own));
    auto of_qt = std::make_unique<QTranslator>();  // the buttons of dialogs; absent where the system lacks it
    if (code != QLatin1String("en") &&
        of_qt->load(QStringLiteral("qtbase_") + code, QLibraryInfo::path(QLibraryInfo::TranslationsPath)))
      add(current, application, std::move(of_qt));
  }
  const bool of_desktop = code == kInvented || QLocale::system().name().startsWith(code);
  QLocale::setDefault(of_desktop ? QLocale::system() : QLocale(code));  // the desktop knows the country, too
  application.setLayoutDirection(code == kInvented ? Qt::RightToLeft : Qt::LeftToRight);
  if (qEnvironmentVariable("RELIEF_TEST_NAMES") == QLatin1String("1") && code != QLatin1String("en")) {
    current.names = std::make_unique<NameKeeper>();
    application.installEventFilter(current.names.get());
  }
}

const QString& language() { return in_use().code; }

QString invented(const QString& words) {
  QString made;
  qsizetype letters = 0;
  for (qsizetype at = 0; at < words.size();) {
    if (const qsizetype kept = kept_at(words, at); kept > 0) {
      made += words.mid(at, kept);
      at += kept;
      continue;
    }
    ++letters;
    made += accented(words[at++]);
  }
  const auto more = static_cast<qsizetype>(std::ceil(kLonger * static_cast<double>(letters))) - 2;
  QString longer(std::max<qsizetype>(0, more), QLatin1Char('~'));
  // A sentence stays one that can be broken into lines.
  if (words.contains(QLatin1Char(' ')))
    for (qsizetype at = 0; at < longer.size(); at += kWord) longer[at] = QLatin1Char(' ');
  return QLatin1Char('[') + made + longer + QLatin1Char(']');
}

const QStringList& test_names() {
  static const QStringList all = [] {
    QStringList names = {"Viewport",      "Radius",           "Strength", "Undo",      "Redo",       "Symmetry",
                         "Device",        "Convert progress", "Cancel",   "Status",    "Tool panel", "Layers panel",
                         "History panel", "Device panel",     "Commands", "Start page"};
    for (const ToolInfo& tool : tools())
      names.append(QString::fromUtf8(tool.title.data(), static_cast<qsizetype>(tool.title.size())));
    names.append(QStringLiteral("Touch"));
    return names;
  }();
  return all;
}

}  // namespace relief::studio
