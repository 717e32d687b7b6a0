// The words of the program in every language: all are there, with their places for values, and numbers agree.
#include <relief/edit/tools.h>
#include <relief/mesh/import.h>
#include <relief/mesh/samples.h>
#include <relief/render/frame.h>

#include <gtest/gtest.h>
#include <studio/languages.h>
#include <studio/text.h>
#include <studio/tool_state.h>

#include <QAction>
#include <QApplication>
#include <QFile>
#include <QLabel>
#include <QProcess>
#include <QRegularExpression>
#include <QTemporaryDir>
#include <QXmlStreamReader>
#include <filesystem>
#include <fstream>
#include <set>

namespace relief::studio {
namespace {

struct Message {
  QString context, source, state;
  QStringList translations;
};

std::vector<Message> read_ts(const QString& file) {
  QFile in(file);
  EXPECT_TRUE(in.open(QIODevice::ReadOnly)) << file.toStdString();
  std::vector<Message> all;
  QString context;
  for (QXmlStreamReader xml(&in); !xml.atEnd();) {
    if (xml.readNext() != QXmlStreamReader::StartElement) continue;
    if (xml.name() == QLatin1String("name")) context = xml.readElementText();
    if (xml.name() == QLatin1String("message"))
      all.push_back({.context = context, .source = {}, .state = {}, .translations = {}});
    if (xml.name() == QLatin1String("source")) all.back().source = xml.readElementText();
    if (xml.name() == QLatin1String("translation")) {
      all.back().state = xml.attributes().value(QLatin1String("type")).toString();
      const QString words = xml.readElementText(QXmlStreamReader::IncludeChildElements);
      all.back().translations.append(words.trimmed());
    }
  }
  return all;
}

QString words_file(const QString& name) {
  return QStringLiteral(RELIEF_SOURCE_DIR "/apps/studio/translations/") + name;
}

std::multiset<QString> places(const QString& words) {
  static const QRegularExpression kPlace(QStringLiteral("%[0-9]|</?[a-z]+>"));
  std::multiset<QString> found;
  for (auto each = kPlace.globalMatch(words); each.hasNext();) found.insert(each.next().captured());
  return found;
}

struct Language : testing::Test {
  ~Language() override { use_language(*qApp, QStringLiteral("en")); }
};

TEST_F(Language, GermanIsWhole) {
  const std::vector<Message> all = read_ts(words_file(QStringLiteral("relief_de.ts")));
  ASSERT_GT(all.size(), 150U);
  for (const Message& m : all) {
    const std::string where = (m.context + QStringLiteral(": ") + m.source).toStdString();
    EXPECT_EQ(m.state.toStdString(), "") << where;
    ASSERT_EQ(m.translations.size(), 1) << where;
    EXPECT_FALSE(m.translations.first().isEmpty()) << where;
    const bool counts = m.source.contains(QLatin1String("%n"));  // both forms stand in one text
    EXPECT_TRUE(counts || places(m.source) == places(m.translations.first())) << where;
  }
}

// What lupdate finds in the sources now is what the files have: nothing new waits for a translator.
TEST_F(Language, FilesAreUpToDateWithTheSources) {
  const QTemporaryDir folder;
  const QString file = folder.filePath(QStringLiteral("relief_de.ts"));
  ASSERT_TRUE(QFile::copy(words_file(QStringLiteral("relief_de.ts")), file));
  QProcess lupdate;
  lupdate.start(QStringLiteral(RELIEF_LUPDATE), {"-recursive", "-extensions", "cpp,h", "-locations", "none", "-silent",
                                                 QStringLiteral(RELIEF_SOURCE_DIR "/apps/studio"), "-ts", file});
  ASSERT_TRUE(lupdate.waitForFinished(120'000));
  ASSERT_EQ(lupdate.exitCode(), 0);
  EXPECT_FALSE(lupdate.readAllStandardError().contains("lacks Q_OBJECT")) << "words that no translator can reach";
  for (const Message& m : read_ts(file))
    EXPECT_EQ(m.state.toStdString(), "") << m.context.toStdString() << ": " << m.source.toStdString();
}

TEST_F(Language, WordsOfTheLibraryAreTranslated) {
  std::set<std::pair<QString, QString>> known;
  for (const Message& m : read_ts(words_file(QStringLiteral("relief_de.ts")))) known.insert({m.context, m.source});
  const auto expect = [&](const char* context, std::string_view words) {
    EXPECT_TRUE(known.contains({QString::fromLatin1(context), text(words)})) << context << ": " << words;
  };
  for (const ToolInfo& tool : tools()) {
    expect("Tools", tool.title);
    expect("Tools", tool.help);
    for (const SettingInfo& setting : tool.settings) {
      expect("Settings", setting.title);
      if (!setting.help.empty()) expect("Settings", setting.help);
      for (const std::string_view choice : setting.choices) expect("Settings", choice);
    }
  }
  for (const std::string_view each : matcaps()) expect("Matcaps", each);
  for (const std::string_view each : sample_names()) expect("Samples", each);
}

TEST_F(Language, NotesOfFilesAreTold) {
  const QTemporaryDir folder;
  const auto notes_of = [&](const char* name, const QByteArray& content) {
    QFile file(folder.filePath(QString::fromLatin1(name)));
    EXPECT_TRUE(file.open(QIODevice::WriteOnly) && file.write(content) == content.size());
    file.close();
    const Result<TriangleMesh> mesh = import_mesh(path(file.fileName()));
    EXPECT_TRUE(mesh) << mesh.error().message;
    QStringList told;
    for (const std::string& note : mesh->notes) told.append(note_text(note));
    return told.join(QLatin1Char('|')).toStdString();
  };
  const QByteArray facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  const QByteArray stl = "solid a\n" + facet + facet, obj = "mtllib 50%1.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  use_language(*qApp, QStringLiteral("de"));
  EXPECT_EQ(notes_of("cut.stl", stl),
            "Die Datei endet ohne endsolid, als wäre sie abgeschnitten; ihre 2 Facetten sind vollständig");
  EXPECT_EQ(notes_of("a.obj", obj), "Die Materialdatei '50%1.mtl' ist nicht lesbar; ihre Farben fehlen");
  EXPECT_EQ(
      note_text(
          "tools find little clay: 0.5 % of the fibres have less than 2.1 mm below the surface, the least 0.02 mm "
          "near (1, -2.5, 3e-7)"),
      "Werkzeuge finden wenig Ton: 0.5 % der Fasern haben weniger als 2.1 mm unter der Oberfläche, die kürzeste "
      "0.02 mm bei (1, -2.5, 3e-7)");
  EXPECT_EQ(note_text("3 words of 'nobody' at (1, -2.5, 3e-7)"), "3 words of 'nobody' at (1, -2.5, 3e-7)");
  use_language(*qApp, QStringLiteral("en"));
  EXPECT_EQ(notes_of("a.obj", obj), "material library '50%1.mtl' cannot be read; its colours are missing");
}

/// All notes of conversions, with one and with several of each thing: report_test holds the file against them.
std::vector<std::string> notes_of_conversions() {
  std::ifstream file(std::filesystem::path(RELIEF_SOURCE_DIR) / "tests/data/notes_of_conversions.txt");
  std::vector<std::string> all;
  for (std::string note; std::getline(file, note);) all.push_back(note);
  EXPECT_GT(all.size(), 30U);
  return all;
}

TEST_F(Language, NotesOfConversionsAreTranslated) {
  static const QRegularExpression english(QStringLiteral("\\b(the|of|near|is|were|has|have|triangles?|slabs?)\\b"));
  use_language(*qApp, QStringLiteral("de"));
  for (const std::string& note : notes_of_conversions()) {
    EXPECT_FALSE(english.match(note_text(note)).hasMatch()) << note << "\n" << note_text(note).toStdString();
  }
  EXPECT_EQ(note_text("the source was rebuilt as a solid with voxels of 0.02 of the diagonal: what nobody knows"),
            "Der Scan wurde als Körper aus Voxeln von 0.02 der Diagonale neu gebaut: what nobody knows");
  use_language(*qApp, QStringLiteral("en"));
  for (const std::string& note : notes_of_conversions()) EXPECT_EQ(note_text(note).toStdString(), note);
}

TEST_F(Language, NumbersAgree) {
  const auto slabs = [](int n) {
    return QCoreApplication::translate("relief::studio::MainWindow", "%n slab(s)", nullptr, n).toStdString();
  };
  use_language(*qApp, QStringLiteral("en"));
  EXPECT_EQ(slabs(1), "1 slab");
  EXPECT_EQ(slabs(200), "200 slabs");
  EXPECT_EQ(slabs(0), "0 slabs");
  use_language(*qApp, QStringLiteral("de"));
  EXPECT_EQ(slabs(1), "1 Platte");
  EXPECT_EQ(slabs(200), "200 Platten");
  EXPECT_EQ(ago_text(120).toStdString(), "vor 2 Minuten");
}

TEST_F(Language, LanguagesFollowEachOther) {
  use_language(*qApp, QStringLiteral("de"));
  EXPECT_EQ(ToolState::title(QStringLiteral("carve")).toStdString(), "Abtragen");
  EXPECT_EQ(language(), QStringLiteral("de"));
  use_language(*qApp, QStringLiteral("en"));
  EXPECT_EQ(ToolState::title(QStringLiteral("carve")).toStdString(), "Carve");
  EXPECT_EQ(language_for(QStringLiteral("de")), QStringLiteral("de"));
  EXPECT_TRUE(languages().contains(language_for(QStringLiteral("tlh"))));
}

TEST_F(Language, InventedWordsAreLongerAndKeepTheirPlaces) {
  use_language(*qApp, QStringLiteral("xx"));
  EXPECT_EQ(qApp->layoutDirection(), Qt::RightToLeft);
  const QString made = QCoreApplication::translate("relief::studio::MainWindow", "%n slab(s)", nullptr, 3);
  EXPECT_TRUE(made.contains(QStringLiteral("3 šļåb"))) << made.toStdString();
  for (const char* each : {"Undo", "Saved as %1, with <b>the last</b> steps", "&Open the file …"}) {
    const QString words = QString::fromUtf8(each), longer = invented(words);
    EXPECT_GE(static_cast<double>(longer.size()), 1.3 * static_cast<double>(words.size())) << each;
    EXPECT_EQ(places(words), places(longer)) << each;
    EXPECT_EQ(words.count(u'&'), longer.count(u'&')) << each;
  }
  for (const QString& word : invented(QString(80, QLatin1Char('a')).replace(40, 1, QLatin1Char(' '))).split(u' '))
    EXPECT_LE(word.size(), 41 + 1) << word.toStdString();  // the given ones, and a bracket
  EXPECT_TRUE(invented(QStringLiteral("Relief models (*.relief)")).contains(QLatin1String("(*.relief)")));
  use_language(*qApp, QStringLiteral("en"));
  EXPECT_EQ(qApp->layoutDirection(), Qt::LeftToRight);
}

TEST_F(Language, NamesOfTestsStayEnglishWhereTheyAreAskedFor) {
  const auto name_shown = [] {
    QLabel label;
    label.setAccessibleName(ToolState::title(QStringLiteral("carve")));
    label.ensurePolished();
    return label.accessibleName().toStdString();
  };
  use_language(*qApp, QStringLiteral("de"));
  EXPECT_EQ(name_shown(), "Abtragen");
  qputenv("RELIEF_TEST_NAMES", "1");
  use_language(*qApp, QStringLiteral("de"));
  EXPECT_EQ(name_shown(), "Carve");
  use_language(*qApp, QStringLiteral("xx"));
  EXPECT_EQ(name_shown(), "Carve");
  qunsetenv("RELIEF_TEST_NAMES");
}

}  // namespace
}  // namespace relief::studio
