// Relief Studio: the desktop program.
#include "accessible.h"
#include "crash_report.h"
#include "desktop_scheme.h"
#include "event_log.h"
#include "kiosk.h"
#include "languages.h"
#include "main_window.h"
#include "preferences.h"
#include "text.h"
#include "widgets/theme.h"

#include <CLI/CLI.hpp>

#include <QApplication>
#include <QFileInfo>
#include <QTimer>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

namespace relief::studio {

namespace {

struct Options {
  std::string file, log, theme, language, device;
  std::vector<std::string> kiosk;
  int text = 0;
  bool new_settings = false;
};

/// The driver that draws with the CPU leaves a core to the servo; it reads this at its first call.
void leave_a_core() {
  const unsigned cores = std::max(2U, std::thread::hardware_concurrency());
  ::setenv("LP_NUM_THREADS", std::to_string(cores - 1).c_str(), 0);
}

/// Control characters as spaces, 400 bytes at most.
std::string one_line(std::string words) {
  for (char& c : words)
    if (static_cast<unsigned char>(c) < 32) c = ' ';
  return words.substr(0, 400);
}

/// Until the window system answers, Qt has a page of words for a missing screen, and ends the program itself.
void before_the_window(QtMsgType kind, const QMessageLogContext& /*context*/, const QString& /*words*/) {
  if (kind != QtFatalMsg) return;
  std::fputs(
      "relief studio: there is no screen to open a window on; start it on a desktop, or draw pictures with relief "
      "render\n",
      stderr);
  std::_Exit(1);
}

/// A settings file that cannot be read is put aside and told, never a reason not to start.
std::unique_ptr<QSettings> open_settings(bool fresh) {
  const QString file = config_folder() + QStringLiteral("/studio.conf");
  if (fresh) QFile::remove(file);
  auto settings = std::make_unique<QSettings>(file, QSettings::IniFormat);
  if (settings->status() == QSettings::FormatError) {
    settings.reset();
    QFile::rename(file, file + QStringLiteral(".damaged"));
    std::fprintf(stderr, "relief studio: the settings could not be read and are now %s.damaged\n",
                 file.toLocal8Bit().constData());
    settings = std::make_unique<QSettings>(file, QSettings::IniFormat);
  }
  return settings;
}

int run(int argc, char** argv) {
  Options o;
  CLI::App app("Sit down and sculpt: opens a model or a scan in a window.", "relief studio");
  app.add_option("MODEL|SCAN", o.file, "A .relief model, or a scan as PLY, OBJ, STL, OFF, glTF, 3MF or DRC");
  app.add_option("--kiosk", o.kiosk, "For an exhibition: show these models, and those in these folders, full screen")
      ->option_text("MODEL|FOLDER...")
      ->expected(1, -1);
  app.add_option("--theme", o.theme, "dark or light")->check(CLI::IsMember({"dark", "light"}));
  app.add_option("--text", o.text, "Size of the text in percent, 80 to 200")->check(CLI::Range(80, 200));
  app.add_option("--language", o.language, "en or de")->check([](const std::string& name) {
    // xx is the invented one that shows its makers which words do not fit.
    return name == "en" || name == "de" || name == "xx" ? std::string() : "is not en or de: " + name;
  });
  app.add_flag("--new-settings", o.new_settings, "Begin with the settings of a fresh installation");
  app.add_option("--device", o.device,
                 "The device to begin with: simulated, mouse, replay:FILE, or one of relief devices")
      ->type_name("NAME");
  app.add_option("--log-events", o.log, "Write what happens as JSON lines into a file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return 0;
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "relief studio: %s; relief-studio --help lists the options\n", one_line(error.what()).c_str());
    return 2;
  }
  report_crashes();
  leave_a_core();
  qInstallMessageHandler(before_the_window);
  QApplication application(argc, argv);
  qInstallMessageHandler(nullptr);
  // Only after the constructor does this hold: every motion of the hand counts.
  QCoreApplication::setAttribute(Qt::AA_CompressHighFrequencyEvents, false);
  QCoreApplication::setApplicationName(QStringLiteral("Relief Studio"));
  QApplication::setDesktopFileName(QStringLiteral("relief-studio"));
  if (!o.log.empty() && !event_log().open(text(o.log))) {
    std::fprintf(stderr, "relief studio: %s cannot be written; choose another file for --log-events\n", o.log.c_str());
    return 1;
  }
  const std::unique_ptr<QSettings> settings = open_settings(o.new_settings);
  if (!o.theme.empty()) settings->setValue("look/theme", text(o.theme));
  if (o.text != 0) settings->setValue("look/text", o.text);
  const DesktopScheme desktop;
  apply(application, theme_for(chosen(*settings, "look/theme").toString(), desktop.dark()),
        chosen(*settings, "look/text").toInt() / 100.0);
  install_accessibility();
  if (!o.kiosk.empty()) {
    QStringList shown;
    for (const std::string& each : o.kiosk) shown.append(text(each));
    const QString language =
        language_for(o.language.empty() ? chosen(*settings, "language").toString() : text(o.language));
    use_language(application, language);
    set_reduced_motion(chosen(*settings, "look/reduced-motion").toBool());
    return run_kiosk(application, shown, *settings, language, text(o.device));
  }
  event_log().write(QStringLiteral("start"), {{"pid", QCoreApplication::applicationPid()}});
  // Another language builds the window anew; the model goes on where it was.
  QString language = text(o.language), file = text(o.file), device = text(o.device);
  std::optional<Camera> camera;
  while (true) {
    use_language(application, language_for(language.isEmpty() ? chosen(*settings, "language").toString() : language));
    MainWindow window(*settings, desktop);
    window.show();
    if (!device.isEmpty()) window.use_device(device);
    if (!file.isEmpty()) QTimer::singleShot(0, &window, [&] { window.open(file, camera); });
    const int status = QApplication::exec();
    if (!window.wants_another()) return status;
    language.clear();
    device = window.device();
    file = window.last_file();
    camera = window.viewport().camera();
  }
}

}  // namespace

}  // namespace relief::studio

int main(int argc, char** argv) { return relief::studio::run(argc, argv); }
