#include "usage.h"

#include "commands.h"

#include <fmt/format.h>

#include <algorithm>

namespace relief::cli {

namespace {

/// All names of options that a command has.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const OptionHelp& o : options_of(command))
    if (!o.positional) names.insert(names.end(), o.names.begin(), o.names.end());
  return names;
}

/// "--slab 5" and "--slab=5" ask for --slab.
std::string name_in(const std::string& word) { return word.substr(0, word.find('=')); }

/// What a command was given and does not know; empty where it knows all.
std::string unknown_word(const CLI::App& command) {
  std::vector<std::string> words = command.remaining();
  const auto option = std::ranges::find_if(words, [](const std::string& word) { return word.starts_with('-'); });
  if (option != words.end()) {
    const std::string name = name_in(*option);
    return fmt::format("{}: no such option{}", printable(name, 60), nearest_of(name, option_names(command)));
  }
  if (words.empty()) return {};
  return fmt::format("{}: one argument too many", printable(words.front(), 60));
}

/// The first option or argument that a command needs and has not got.
std::string missing_word(const CLI::App& command) {
  const auto options = command.get_options();
  const std::vector<OptionHelp> told = options_of(command);
  for (const CLI::Option* option : options) {
    if (!option->get_required() || option->count() > 0) continue;
    const std::string name = option->get_positional() ? option->get_name(true) : option->get_name();
    const auto help = std::ranges::find_if(told, [&](const OptionHelp& o) { return o.names.back() == name; });
    if (help == told.end() || help->placeholder.empty()) return name + " is missing";
    return fmt::format("{} {} is missing", help->names.front(), help->placeholder);
  }
  return {};
}

/// The two options of which one excludes or needs the other, where that is what is wrong.
std::string wrong_pair(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0) continue;
    for (const CLI::Option* other : option->get_excludes())
      if (other->count() > 0) return fmt::format("{} and {} exclude each other", option->get_name(), other->get_name());
    for (const CLI::Option* other : option->get_needs())
      if (other->count() == 0) return fmt::format("{} needs {}", option->get_name(), other->get_name());
  }
  return {};
}

/// "--slabs: a value is missing".
std::string missing_value(const std::string& message) {
  return message.substr(0, message.find(':')) + ": a value is missing";
}

}  // namespace

std::string usage_message(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string help = "; see relief " + (chosen.empty() ? "" : command.get_name() + " ") + "--help";
  if (const std::string unknown = unknown_word(command); !unknown.empty()) return unknown + help;
  if (chosen.empty()) return "a command is missing, such as convert" + help;
  std::string message = printable(error.what(), 360);
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr) {
    if (const std::string missing = missing_word(command); !missing.empty()) message = missing;
  } else if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr ||
             dynamic_cast<const CLI::RequiresError*>(&error) != nullptr) {
    if (const std::string pair = wrong_pair(command); !pair.empty()) message = pair;
  } else if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) {
    message = missing_value(message);
  }
  return message + help;
}

std::string unknown_command(const CLI::App& app, const std::string& word) {
  return fmt::format("{}: no such command{}; see relief --help", printable(word, 60),
                     nearest_of(word, command_names(app)));
}

}  // namespace relief::cli
