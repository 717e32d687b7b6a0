// Wrong usage: one wording for each kind of it.
#pragma once

#include <CLI/CLI.hpp>

#include <string>

namespace relief::cli {

/// One line without "relief: " for a command line that cannot be run.
[[nodiscard]] std::string usage_message(const CLI::App& app, const CLI::ParseError& error);
/// The same for a first word that is no command.
[[nodiscard]] std::string unknown_command(const CLI::App& app, const std::string& word);

}  // namespace relief::cli
