// help and completion.
#include "commands.h"

#include <relief/base/nearest_word.h>

#include <fmt/format.h>

#include <algorithm>
#include <memory>

namespace relief::cli {

namespace {

struct HelpOptions {
  std::string what;
  bool man = false;
};

const CLI::App* command_named(const CLI::App& app, const std::string& name) {
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; }))
    if (each->get_name() == name) return each;
  return nullptr;
}

std::string topic_named(const std::string& name) {
  const auto found = std::ranges::find(topics(), name, &Topic::name);
  return found == topics().end() ? std::string() : found->text;
}

/// What there is help about.
std::vector<std::string> known_words(const CLI::App& app) {
  std::vector<std::string> words = command_names(app);
  for (const Topic& topic : topics()) words.emplace_back(topic.name);
  return words;
}

nlohmann::ordered_json json_of_all(const CLI::App& app, const Catalogue& catalogue) {
  nlohmann::ordered_json json;
  json["commands"] = json["topics"] = nlohmann::ordered_json::array();
  for (const std::string& name : command_names(app))
    json["commands"].push_back(help_json(*command_named(app, name), catalogue));
  for (const Topic& topic : topics()) json["topics"].push_back(topic.name);
  return json;
}

Status run_help(const CLI::App& app, const HelpOptions& o, const Context& context) {
  const CLI::App* command = o.what.empty() ? &app : command_named(app, o.what);
  if (command == nullptr) {
    const std::string text = topic_named(o.what);
    if (text.empty())
      refuse_usage(fmt::format("help: there is no command or topic {}{}", printable(o.what, 60),
                               nearest_of(o.what, known_words(app))));
    if (context.json)
      print_json({{"topic", o.what}, {"text", text}});
    else
      print(text);
    return {};
  }
  if (o.man)
    print(man_page(app, *command, context.catalogue));
  else if (context.json)
    print_json(command == &app ? json_of_all(app, context.catalogue) : help_json(*command, context.catalogue));
  else
    print(command == &app ? overview(app, context.catalogue) : help_text(*command, context.catalogue));
  return {};
}

}  // namespace

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(each->get_name());
  return names;
}

std::string nearest_of(std::string_view text, const std::vector<std::string>& words) {
  const std::vector<std::string_view> views(words.begin(), words.end());
  return relief::detail::nearest_clause(text, views);
}

void add_help(CLI::App& app, Context& context) {
  auto o = std::make_shared<HelpOptions>();
  CLI::App* c = app.add_subcommand("help", "Explain a command or a topic");
  context.catalogue[c] = {.group = "Learn",
                          .examples = {{"relief help convert", "the same as relief convert --help"},
                                       {"relief help flags", "what the numbers in the column flags say"},
                                       {"relief help convert --json", "for programs"},
                                       {"relief help convert --man | man -l -", "the page of the manual"}}};
  c->add_option("WHAT", o->what, "a command, or a topic: units, flags, path-csv, strokes");
  c->add_flag("--man", o->man, "print the page for man");
  finish_command(*c, context, [o, &app, &context] { return run_help(app, *o, context); }, {.work = false});
}

void add_completion(CLI::App& app, Context& context) {
  auto shell = std::make_shared<std::string>();
  CLI::App* c = app.add_subcommand("completion", "Print what a shell needs to complete commands and options");
  context.catalogue[c] = {
      .group = "Learn",
      .examples = {{"source <(relief completion bash)", "for this shell"},
                   {"relief completion fish > ~/.config/fish/completions/relief.fish", "for good"}}};
  c->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(one_of({std::begin(kShells), std::end(kShells)}));
  finish_command(*c, context,
                 [shell, &app, &context] {
                   print(completion(app, context.catalogue, *shell));
                   return Status();
                 },
                 {.json = false, .work = false});
}

}  // namespace relief::cli
