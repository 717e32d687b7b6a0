#include "help.h"

#include "commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ranges>
#include <utility>

namespace relief::cli {

namespace {

constexpr std::size_t kColumns = 100;       // of a terminal that shows a whole line of help
constexpr std::size_t kWidestNames = 34;    // columns of an option's names; wider ones stand on a line of their own
constexpr std::size_t kCommandColumn = 64;  // where comments on examples begin at most
constexpr std::size_t kWidestChoices = 24;  // letters that choices may have to stand in place of a placeholder

std::vector<std::string> split(std::string_view text, std::string_view between) {
  std::vector<std::string> words;
  for (const auto word : std::views::split(text, between)) words.emplace_back(word.begin(), word.end());
  return words;
}

/// The description of the check of this name; empty where the option has none.
std::string check_of(const CLI::Option& option, std::string_view name) {
  for (int k = 0;; ++k) try {
      // CLI11 gives checks of constant options by reference to no constant only.
      const CLI::Validator* check = const_cast<CLI::Option&>(option).get_validator(k);  // NOLINT(*-const-cast)
      if (check->get_name() == name) return check->get_description();
    } catch (const CLI::OptionNotFound&) {
      return {};
    }
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  if (option.get_positional()) return {option.get_name(true)};
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

std::vector<std::string> last_names(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(names_of(*option).back());
  std::ranges::sort(names);
  return names;
}

/// The words of a text in lines of at most so many columns.
std::vector<std::string> wrapped(std::string_view text, std::size_t columns) {
  std::vector<std::string> lines;
  for (const std::string& word : split(text, " ")) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > columns)
      lines.push_back(word);
    else
      lines.back() += " " + word;
  }
  return lines;
}

/// "-o, --output FILE", long names below each other.
std::string names_text(const OptionHelp& o) {
  if (o.positional) return o.names.front();
  std::string text = o.names.front().starts_with("--") ? "    " : "";
  text += joined(o.names, ", ");
  if (!o.placeholder.empty()) text += o.optional_value ? "[=" + o.placeholder + "]" : " " + o.placeholder;
  return text;
}

/// The meaning, and in brackets once what may be given and what holds without it.
std::string meaning_text(const OptionHelp& o) {
  std::string facts = o.range;
  const bool told = joined(o.choices, "|") == o.placeholder ||
                    std::ranges::all_of(o.choices, [&](const auto& c) { return o.meaning.contains(c); });
  if (!told) facts += joined(o.choices, ", ");
  if (!o.preset.empty()) facts += (facts.empty() ? "default " : ", default ") + o.preset;
  std::string text = o.meaning;
  if (!facts.empty()) text += " [" + facts + "]";
  if (o.required && !o.positional) text += " (required)";
  return text;
}

std::string table_of(const std::vector<OptionHelp>& options) {
  std::size_t width = 0;
  for (const OptionHelp& o : options)
    if (const std::size_t size = names_text(o).size(); size <= kWidestNames) width = std::max(width, size);
  std::string text;
  for (const OptionHelp& o : options) {
    const std::string names = names_text(o);
    bool first = names.size() <= width;
    if (!first) text += "  " + names + "\n";
    for (const std::string& line : wrapped(meaning_text(o), kColumns - width - 4)) {
      text += fmt::format("  {:{}}  {}\n", first ? names : "", width, line);
      first = false;
    }
  }
  return text;
}

/// The options in their sections, in the order in which those appear first; general ones left out.
std::vector<std::pair<std::string, std::vector<OptionHelp>>> sections_of(const CLI::App& command) {
  std::vector<std::pair<std::string, std::vector<OptionHelp>>> sections = {{"", {}}};
  for (OptionHelp& o : options_of(command)) {
    if (o.section == kGeneral) continue;
    auto at = std::ranges::find(sections, o.section, &decltype(sections)::value_type::first);
    if (at == sections.end()) at = sections.insert(at, {o.section, {}});
    at->second.push_back(std::move(o));
  }
  return sections;
}

/// What all commands have, in one line.
std::string general_of(const CLI::App& command) {
  std::string text;
  for (const OptionHelp& o : options_of(command))
    if (o.section == kGeneral)
      text += (text.empty() ? "" : ", ") + joined(o.names, ", ") + (o.placeholder.empty() ? "" : " " + o.placeholder);
  return text;
}

std::string examples_text(const std::vector<Example>& examples) {
  std::size_t width = 0;
  for (const Example& e : examples)
    if (!e.comment.empty()) width = std::max(width, std::min(e.command.size(), kCommandColumn));
  std::string text;
  for (const Example& e : examples)
    text += e.comment.empty() ? fmt::format("  {}\n", e.command)
                              : fmt::format("  {:{}}   # {}\n", e.command, width, e.comment);
  return text;
}

const CommandHelp& help_of(const CLI::App& command, const Catalogue& catalogue) {
  static const CommandHelp kNone;
  const auto found = catalogue.find(&command);
  return found == catalogue.end() ? kNone : found->second;
}

nlohmann::ordered_json to_json(const OptionHelp& o) {
  nlohmann::ordered_json json;
  const auto or_null = [](const std::string& text) {
    return text.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(text);
  };
  json["names"] = o.names;
  json["placeholder"] = or_null(o.placeholder);
  json["optional_value"] = o.optional_value;
  json["meaning"] = o.meaning;
  json["choices"] = o.choices;
  json["range"] = or_null(o.range);
  json["default"] = or_null(o.preset);
  json["required"] = o.required;
  json["needs"] = o.needs;
  json["excludes"] = o.excludes;
  json["section"] = or_null(o.section);
  return json;
}

// ---- Man pages

/// Text for troff: no letter of it is taken for a command.
std::string troff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      out += std::string("\\&") + c;
    else
      out += c;
  }
  return out;
}

std::string literal(std::string_view text) {
  return ".PP\n.nf\n" + troff(text) + (text.ends_with('\n') ? "" : "\n") + ".fi\n";
}

std::string entry(const OptionHelp& o) {
  std::string names = names_text(o);
  names.erase(0, names.find_first_not_of(' '));
  return ".TP\n\\fB" + troff(names) + "\\fR\n" + troff(meaning_text(o)) + "\n";
}

constexpr std::string_view kExitStatus = "0 done, 1 failed (standard error says why), 2 wrong usage, 130 cancelled";

}  // namespace

std::vector<OptionHelp> options_of(const CLI::App& command) {
  std::vector<OptionHelp> all;
  for (const CLI::Option* option : command.get_options()) {
    OptionHelp o;
    o.names = names_of(*option);
    o.positional = option->get_positional();
    o.meaning = option->get_description();
    o.required = option->get_required();
    o.range = check_of(*option, "range");
    o.preset = option->get_default_str();
    o.needs = last_names(option->get_needs());
    o.excludes = last_names(option->get_excludes());
    if (const std::string choices = check_of(*option, "choices"); !choices.empty()) o.choices = split(choices, "|");
    // The name of the type comes before what the checks say.
    const std::string type = option->get_type_name();
    if (!o.positional) o.placeholder = type.substr(0, type.find(':'));
    if (!o.choices.empty() && (o.placeholder == "TEXT" || o.placeholder == "INT"))
      o.placeholder.clear();  // the types of CLI11
    o.optional_value = option->get_items_expected_max() == 0 && !o.placeholder.empty();
    if (o.placeholder.empty() && option->get_items_expected_max() > 0)
      if (std::string choices = joined(o.choices, "|"); choices.size() <= kWidestChoices)
        o.placeholder = std::move(choices);
    const bool general = option == command.get_help_ptr() || option->get_group() == kGeneral;
    o.section = general ? std::string(kGeneral) : option->get_group() == "Options" ? "" : option->get_group();
    all.push_back(std::move(o));
  }
  // CLI11 adds -h before all others.
  std::ranges::stable_partition(all, [](const OptionHelp& o) { return o.section != kGeneral; });
  return all;
}

std::string usage_of(const CLI::App& command) {
  std::string text = "relief " + command.get_name(), rest;
  for (const OptionHelp& o : options_of(command)) {
    if (o.positional)
      text += o.required ? " " + o.names.front() : " [" + o.names.front() + "]";
    else if (o.required)
      rest += " " + o.names.front() + " " + o.placeholder;
  }
  return text + rest + " [OPTIONS]";
}

std::vector<const CLI::App*> commands_of(const CLI::App& app, const Catalogue& catalogue, std::string_view group) {
  std::vector<const CLI::App*> commands;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    if (help_of(*command, catalogue).group == group) commands.push_back(command);
  return commands;
}

std::string page_of(const CLI::App& command) {
  const std::string name = command.get_name() == "redo" ? "undo" : command.get_name();
  return "reference/command-line/" + name + ".md";
}

std::string overview(const CLI::App& app, const Catalogue& catalogue) {
  std::string text = app.get_description() + "\n\n";
  text += examples_text(help_of(app, catalogue).examples) + "\n";
  for (const std::string_view group : kGroups) {
    std::string line = fmt::format("{:8}", std::string(group) + ":");
    for (const CLI::App* command : commands_of(app, catalogue, group)) line += "  " + command->get_name();
    text += line + "\n";
  }
  std::string topic_names;
  for (const Topic& topic : topics()) topic_names += (topic_names.empty() ? "" : " | ") + std::string(topic.name);
  text += "\nOptions: --version  -h, --help; of most commands: --json  --quiet  --progress  --threads N\n";
  text += "Topics:  relief help " + topic_names + " | devices\n";  // the last is explained with its command
  return text + "Exit status: " + std::string(kExitStatus) + "\n";
}

std::string help_text(const CLI::App& command, const Catalogue& catalogue) {
  const CommandHelp& help = help_of(command, catalogue);
  std::string text = command.get_description() + ".\n\n" + examples_text(help.examples);
  text += (help.examples.empty() ? "" : "\n") + ("Usage: " + usage_of(command)) + "\n";
  for (const auto& [heading, options] : sections_of(command))
    if (!options.empty()) text += "\n" + (heading.empty() ? "" : heading + ":\n") + table_of(options);
  text += "\n  " + general_of(command) + "\n";
  if (!help.notes.empty()) text += "\n" + help.notes;
  return text + "\nMore: docs/" + page_of(command) + "\n";
}

nlohmann::ordered_json help_json(const CLI::App& command, const Catalogue& catalogue) {
  const CommandHelp& help = help_of(command, catalogue);
  nlohmann::ordered_json json;
  json["command"] = command.get_name();
  json["group"] = help.group;
  json["summary"] = command.get_description();
  json["usage"] = usage_of(command);
  json["page"] = page_of(command);
  json["examples"] = json["positionals"] = json["options"] = nlohmann::ordered_json::array();
  for (const Example& e : help.examples) json["examples"].push_back({{"command", e.command}, {"comment", e.comment}});
  for (const OptionHelp& o : options_of(command)) json[o.positional ? "positionals" : "options"].push_back(to_json(o));
  return json;
}

std::string man_page(const CLI::App& app, const CLI::App& command, const Catalogue& catalogue) {
  const bool whole = &app == &command;
  const CommandHelp& help = help_of(command, catalogue);
  const std::string name = whole ? "relief" : "relief-" + command.get_name();
  std::string title = name;
  std::ranges::transform(title, title.begin(),
                         [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  std::string text = fmt::format(".TH {} 1 \"\" \"relief {}\" \"Relief\"\n.SH NAME\n{} \\- {}\n", troff(title),
                                 RELIEF_VERSION, troff(name), troff(command.get_description()));
  text += ".SH SYNOPSIS\n" + troff(whole ? "relief COMMAND [OPTIONS]" : usage_of(command)) + "\n";
  if (!help.examples.empty()) text += ".SH EXAMPLES\n" + literal(examples_text(help.examples));
  if (whole) {
    text += ".SH COMMANDS\n";
    for (const std::string_view group : kGroups)
      for (const CLI::App* each : commands_of(app, catalogue, group))
        text += ".TP\n\\fB" + troff("relief-" + each->get_name()) + "(1)\\fR\n" + troff(each->get_description()) + "\n";
    for (const Topic& topic : topics()) text += ".SH " + troff(topic.title) + "\n" + literal(topic.text);
  } else {
    text += ".SH OPTIONS\n";
    for (const OptionHelp& o : options_of(command)) text += entry(o);
    if (!help.notes.empty()) text += ".SH NOTES\n" + literal(help.notes);
  }
  text += ".SH EXIT STATUS\n" + troff(kExitStatus) + "\n";
  return text + (whole ? "" : ".SH SEE ALSO\n\\fBrelief\\fR(1)\n");
}

}  // namespace relief::cli
