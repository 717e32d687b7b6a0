// In which language the program speaks.
#pragma once

#include <QString>
#include <QStringList>

class QApplication;

namespace relief::studio {

/// Codes of the languages that there are, the invented one left out: "en", "de".
[[nodiscard]] const QStringList& languages();
/// The name of a language in that language: "Deutsch".
[[nodiscard]] QString language_title(const QString& code);
/// `asked` where there is such a language ("xx" is the invented one), else the first of the desktop's languages that
/// there is, else English.
[[nodiscard]] QString language_for(const QString& asked);
/// All words that are asked for from now on, and the direction of writing, are those of the language; one that was used
/// before is taken out. Under RELIEF_TEST_NAMES=1 the accessible names that tests rely on stay English. UI thread.
void use_language(QApplication& application, const QString& code);
/// The language in use.
[[nodiscard]] const QString& language();

/// The invented language: letters with accents, 40 % longer, in brackets; places for values (%1, %n), tags, shortcuts
/// marked by & and patterns of file names (*.ply) stay as they are. Shows words that were forgotten or do not fit.
[[nodiscard]] QString invented(const QString& words);

/// Accessible names that tests drive the program by (see docs/reference/studio.md), in English.
[[nodiscard]] const QStringList& test_names();

}  // namespace relief::studio
