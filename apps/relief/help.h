// What people are told of the commands: --help, `relief help`, man pages and completion, all made of the options
// themselves.
#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace relief::cli {

struct Example {
  std::string command;       ///< a whole line, beginning with "relief"
  std::string comment = {};  ///< what it does, where the line does not say so itself
};

/// What a command says beside its options.
struct CommandHelp {
  std::string_view group;         ///< one of kGroups
  std::vector<Example> examples;  ///< two to four
  std::string notes = {};         ///< lines under the options
};

/// The groups of `relief --help`, in their order.
inline constexpr std::string_view kGroups[] = {"Make", "Check", "Feel", "Shape", "Share", "Measure", "Learn"};

/// By command.
using Catalogue = std::map<const CLI::App*, CommandHelp>;

/// The section of the options that every command has.
inline constexpr std::string_view kGeneral = "General";

/// One option or positional, as it is told.
struct OptionHelp {
  std::vector<std::string> names;    ///< "-o", "--output"; of a positional its placeholder
  std::string placeholder, meaning;  ///< no placeholder: a flag
  bool optional_value = false;       ///< a flag that may have =VALUE
  bool required = false, positional = false;
  std::vector<std::string> choices;
  std::string range, preset;                 ///< "4 to 1000000"; what holds without the option
  std::vector<std::string> needs, excludes;  ///< names of others
  std::string section;                       ///< empty: the command's own; else a heading
};

[[nodiscard]] std::vector<OptionHelp> options_of(const CLI::App& command);
/// "relief convert [OPTIONS] MESH -o MODEL.relief".
[[nodiscard]] std::string usage_of(const CLI::App& command);
/// The commands of a group, in the order in which they were added.
[[nodiscard]] std::vector<const CLI::App*> commands_of(const CLI::App& app, const Catalogue& catalogue,
                                                       std::string_view group);
/// The page about a command, from the top of the documentation: "reference/command-line/convert.md".
[[nodiscard]] std::string page_of(const CLI::App& command);

/// `relief --help`.
[[nodiscard]] std::string overview(const CLI::App& app, const Catalogue& catalogue);
/// `relief COMMAND --help`; at most 100 columns.
[[nodiscard]] std::string help_text(const CLI::App& command, const Catalogue& catalogue);
/// `relief help COMMAND --json`.
[[nodiscard]] nlohmann::ordered_json help_json(const CLI::App& command, const Catalogue& catalogue);
/// `relief help COMMAND --man`; of `app` itself the page of the whole program.
[[nodiscard]] std::string man_page(const CLI::App& app, const CLI::App& command, const Catalogue& catalogue);
/// `relief completion SHELL`; the shells are kShells.
inline constexpr std::string_view kShells[] = {"bash", "zsh", "fish"};
[[nodiscard]] std::string completion(const CLI::App& app, const Catalogue& catalogue, std::string_view shell);

/// What `relief help TOPIC` says.
struct Topic {
  std::string_view name, title;
  std::string text;
};
[[nodiscard]] const std::vector<Topic>& topics();

}  // namespace relief::cli
