// What bash, zsh and fish need to complete commands and options: scripts that are made of the options themselves.
#include "help.h"

#include <fmt/format.h>

#include <algorithm>

namespace relief::cli {

namespace {

/// Words with a space between them; one that has a space itself has a backslash before it.
std::string spaced(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ' ';
    for (const char c : word) text += c == ' ' ? "\\ " : std::string(1, c);
  }
  return text;
}

/// In single quotes, for any of the shells.
std::string quoted(std::string_view text, std::string_view quote_inside) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'')
      out += quote_inside;
    else
      out += c;
  }
  return out + "'";
}
constexpr std::string_view kPosixQuote = "'\\''";
constexpr std::string_view kFishQuote = "\\'";

/// Whether an option takes a name of a file or a folder.
bool takes_file(const OptionHelp& o) {
  return o.choices.empty() && (o.positional || o.placeholder.contains("FILE") || o.placeholder.contains("FOLDER") ||
                               o.placeholder.contains('.') || o.placeholder == "MODEL");
}

struct Command {
  std::string name, summary;
  std::vector<OptionHelp> options;
};

std::vector<Command> commands_in(const CLI::App& app, const Catalogue& catalogue) {
  std::vector<Command> all;
  for (const std::string_view group : kGroups)
    for (const CLI::App* command : commands_of(app, catalogue, group))
      all.push_back({command->get_name(), command->get_description(), options_of(*command)});
  return all;
}

std::string names_of(const std::vector<Command>& commands) {
  std::string text;
  for (const Command& c : commands) text += (text.empty() ? "" : " ") + c.name;
  return text;
}

/// The words that `relief help` explains.
std::string help_words(const std::vector<Command>& commands) {
  std::string text = names_of(commands);
  for (const Topic& topic : topics()) text += " " + std::string(topic.name);
  return text;
}

std::string for_bash(const std::vector<Command>& commands) {
  std::string values, words;
  for (const Command& c : commands) {
    std::string names, positional;
    for (const OptionHelp& o : c.options) {
      if (o.positional) {
        if (!o.choices.empty()) positional = spaced(o.choices);
        continue;
      }
      names += (names.empty() ? "" : " ") + spaced(o.names);
      for (const std::string& name : o.names) {
        if (!o.choices.empty())
          values +=
              fmt::format("    '{} {}') _relief_words '{}' \"$word\"; return ;;\n", c.name, name, spaced(o.choices));
        else if (!o.placeholder.empty() && !o.optional_value && !takes_file(o))
          values += fmt::format("    '{} {}') return ;;\n", c.name, name);
      }
    }
    if (c.name == "help") positional = help_words(commands);
    words += fmt::format("    {}) names='{}'; words='{}' ;;\n", c.name, names, positional);
  }
  return fmt::format(R"(# bash completion for relief, printed by: relief completion bash
_relief_words() {{
  mapfile -t COMPREPLY < <(compgen -W "$1" -- "$2" | while read -r each; do printf '%q\n' "$each"; done)
}}
_relief() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} command=${{COMP_WORDS[1]}}
  local names='' words=''
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    _relief_words '{} --help --version' "$word"
    return
  fi
  case "$command $before" in
{}  esac
  case "$command" in
{}  esac
  if [[ $word == -* ]]; then
    _relief_words "$names" "$word"
  elif [[ -n $words ]]; then
    _relief_words "$words" "$word"
  else
    compopt -o filenames 2>/dev/null
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -F _relief relief
)",
                     names_of(commands), values, words);
}

/// Text inside a specification of _arguments, where brackets and colons have a meaning.
std::string in_zsh(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':') out += '\\';
    out += c;
  }
  return out;
}

std::string for_zsh(const std::vector<Command>& commands) {
  std::string list, cases;
  for (const Command& c : commands) {
    list += "    " + quoted(c.name + ":" + in_zsh(c.summary), kPosixQuote) + "\n";
    cases += fmt::format("    {})\n      _arguments \\\n", c.name);
    std::string positional = "_files";
    for (const OptionHelp& o : c.options) {
      if (o.positional) {
        if (!o.choices.empty()) positional = "(" + spaced(o.choices) + ")";
        continue;
      }
      const std::string values = !o.choices.empty() ? "(" + spaced(o.choices) + ")" : takes_file(o) ? "_files" : " ";
      for (const std::string& name : o.names) {
        std::string line = name + (o.optional_value ? "=-" : "") + "[" + in_zsh(o.meaning) + "]";
        if (!o.placeholder.empty()) line += (o.optional_value ? "::" : ":") + in_zsh(o.placeholder) + ":" + values;
        cases += "        " + quoted(line, kPosixQuote) + " \\\n";
      }
    }
    if (c.name == "help") positional = "(" + help_words(commands) + ")";
    cases += fmt::format("        '*::argument:{}' ;;\n", positional);
  }
  return "#compdef relief\n# zsh completion for relief, printed by: relief completion zsh\n_relief() {\n"
         "  local -a commands\n  commands=(\n" +
         list +
         "  )\n  if ((CURRENT == 2)); then\n    _describe command commands\n    return\n  fi\n"
         "  local command=$words[2]\n  shift words\n  ((CURRENT--))\n  case $command in\n" +
         cases + "  esac\n}\ncompdef _relief relief\n";
}

std::string for_fish(const std::vector<Command>& commands) {
  std::string text = "# fish completion for relief, printed by: relief completion fish\n";
  for (const Command& c : commands)
    text += fmt::format("complete -c relief -n __fish_use_subcommand -f -a {} -d {}\n", c.name,
                        quoted(c.summary, kFishQuote));
  for (const Command& c : commands) {
    const std::string condition = quoted("__fish_seen_subcommand_from " + c.name, kFishQuote);
    for (const OptionHelp& o : c.options) {
      std::string line = "complete -c relief -n " + condition;
      if (o.positional && o.choices.empty() && c.name != "help") continue;
      if (o.positional) {
        line += " -f -a " + quoted(c.name == "help" ? help_words(commands) : spaced(o.choices), kFishQuote);
      } else {
        for (const std::string& name : o.names)
          line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
        if (!o.placeholder.empty() && !o.optional_value) line += takes_file(o) ? " -r -F" : " -x";
        if (!o.choices.empty()) line += " -a " + quoted(spaced(o.choices), kFishQuote);
      }
      text += line + " -d " + quoted(o.meaning, kFishQuote) + "\n";
    }
  }
  return text;
}

}  // namespace

std::string completion(const CLI::App& app, const Catalogue& catalogue, std::string_view shell) {
  const std::vector<Command> commands = commands_in(app, catalogue);
  return shell == "zsh" ? for_zsh(commands) : shell == "fish" ? for_fish(commands) : for_bash(commands);
}

}  // namespace relief::cli
