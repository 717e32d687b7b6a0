// studio: the desktop program, which is a program of its own so that this one links no Qt.
#include "commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

namespace relief::cli {

namespace {

/// Becomes the program that stands beside this one. Returns only where that failed.
Status run_studio(std::vector<std::string> arguments) {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  std::string program = (self.parent_path() / "relief-studio").string();
  if (error || !std::filesystem::exists(program, error))
    return fail(Errc::NotFound,
                fmt::format("{}: the studio is missing; build Relief with Qt 6 installed (tools/install-deps)",
                            printable(program)));
  std::vector<char*> words = {program.data()};
  for (std::string& each : arguments) words.push_back(each.data());
  words.push_back(nullptr);
  execv(program.c_str(), words.data());
  return fail(Errc::Io, printable(program) + ": cannot be started");
}

}  // namespace

void add_studio(CLI::App& app, Context& context) {
  CLI::App* c = app.add_subcommand("studio", "Open the window: see, feel, carve and paint a model");
  context.catalogue[c] = {
      .group = "Shape",
      .examples = {{"relief studio"},
                   {"relief studio scan.ply"},
                   {"relief studio head.relief --theme light"},
                   {"relief studio --kiosk models/", "for visitors, without a keyboard"}},
      .notes =
          "Options of the window: --theme dark|light, --text PERCENT, --language en|de, --device NAME,\n"
          "--kiosk MODEL|FOLDER..., --new-settings. relief-studio --help says what each does.\n"};
  c->prefix_command();
  c->callback([c, &context] { context.run = [words = c->remaining()] { return run_studio(words); }; });
}

}  // namespace relief::cli
