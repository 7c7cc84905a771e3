// SPDX-License-Identifier: Apache-2.0
#include "tools/common/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <string_view>

#include "tools/common/left_out.hpp"
#include "tools/common/run_main.hpp"
#include "tools/common/toml_table.hpp"

namespace haptic::tools {
namespace {

/// "; did you mean 'replay'?" or nothing. Hyphens before a name make no names alike.
std::string suggestion(const std::string& word, const std::vector<std::string>& known) {
  const auto bare = [](std::string_view name) {
    return name.substr(std::min(name.find_first_not_of('-'), name.size()));
  };
  std::vector<std::string_view> names;
  for (const std::string& name : known) names.push_back(bare(name));
  const std::string near = nearest_word(bare(word), names);
  const auto at = std::ranges::find(names, near);
  return near.empty() || at == names.end()
             ? ""
             : "; did you mean '" + known[static_cast<std::size_t>(at - names.begin())] + "'?";
}

/// Advice where to find the option, or nothing.
std::string found_elsewhere(const CLI::App& app, std::span<const Command> commands,
                            const std::string& option) {
  for (const Command& command : commands) {
    if (command.app != &app) continue;
    for (const auto& [name, instead] : command.elsewhere)
      if (name == option) return "; " + instead;
  }
  return {};
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

std::vector<std::string> command_names(const CLI::App& program, const OtherCommands& others) {
  std::vector<std::string> names = others;
  for (const CLI::App* app : program.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(app->get_name());
  names.emplace_back("help");
  return names;
}

CLI::App* command_named(CLI::App& program, const std::string& name) {
  for (CLI::App* app : program.get_subcommands([](CLI::App*) { return true; }))
    if (app->get_name() == name) return app;
  return nullptr;
}

std::string called(const CLI::App& program, const CLI::App& app) {
  return &program == &app ? program.get_name() : program.get_name() + " " + app.get_name();
}

/// An option's name, without "=value"; empty for values, among them negative numbers.
std::string option_of(const std::string& word) {
  if (word.size() < 2 || word[0] != '-' || word == "--") return "";
  if (std::isdigit(static_cast<unsigned char>(word[1])) != 0 || word[1] == '.') return "";
  return word.substr(0, word.find('='));
}

/// Short options may be written together with their value: -ofile.
bool is_known(const std::vector<std::string>& known, const std::string& option) {
  if (std::ranges::find(known, option) != known.end()) return true;
  return option[1] != '-' && std::ranges::find(known, option.substr(0, 2)) != known.end();
}

/// @throws UsageError naming what the program does not know.
void require_known_names(CLI::App& program, std::span<const Command> own,
                         const std::vector<std::string>& words, const OtherCommands& others) {
  const std::vector<std::string> commands = command_names(program, others);
  const bool has_commands = commands.size() > 1;
  CLI::App* app = &program;
  for (const std::string& word : words) {
    if (word == "--") return;
    const std::string option = option_of(word);
    if (option.empty()) {
      if (!has_commands || app != &program) continue;
      app = command_named(program, word);
      if (app == nullptr)
        throw UsageError("there is no command '" + word + "'" + suggestion(word, commands) + " ('" +
                         program.get_name() + " --help' lists them)");
      if (app->get_allow_extras()) return;
    } else if (const std::vector<std::string> known = option_names(*app);
               !app->get_allow_extras() && !is_known(known, option)) {
      const std::string instead = found_elsewhere(*app, own, option);
      throw UsageError((app == &program ? "there is" : app->get_name() + " has") + " no option '" +
                       option + "'" + (instead.empty() ? suggestion(option, known) : instead) +
                       " ('" + called(program, *app) + " --help' lists them)");
    }
  }
}

void finish_help(CLI::App& app, const std::string& example, const std::string& exit_codes) {
  std::string footer = app.get_footer();
  if (!example.empty()) footer += (footer.empty() ? "" : "\n") + ("Example:\n  " + example + "\n");
  if (footer.find("Exit codes: ") == std::string::npos)  // a command may have meanings of its own
    footer += (footer.empty() ? "" : "\n") + ("Exit codes: " + exit_codes + ".");
  app.footer(footer);
}

/// The message of CLI11, in one line and with the command's name.
std::string text_of(const CLI::ParseError& error) {
  std::string text = error.what();
  std::ranges::replace(text, '\n', ' ');
  return text;
}

}  // namespace

int run_program(CLI::App& program, std::span<const Command> commands, const std::string& exit_codes,
                int argc, const char* const* argv, const OtherCommands& others) {
  const std::string name = program.get_name();
  const bool alone = commands.size() == 1 && commands[0].app == &program;
  program.set_version_flag("-V,--version", name + " " HAPTIC_VERSION);
  if (!alone) program.require_subcommand(1);
  finish_help(program, commands[0].example, exit_codes);
  for (const Command& command : commands)
    if (command.app != &program) finish_help(*command.app, command.example, exit_codes);

  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (!words.empty() && words[0] == "help") {
    words.erase(words.begin());
    words.resize(std::min<std::size_t>(words.size(), alone ? 0 : 1));
    words.emplace_back("--help");
  }
  return run_main(name.c_str(), [&]() -> int {
    require_known_names(program, commands, words, others);
    try {
      std::vector<std::string> reversed(words.rbegin(), words.rend());
      program.parse(reversed);
    } catch (const CLI::Success& wish) {
      const bool help = dynamic_cast<const CLI::CallForHelp*>(&wish) != nullptr ||
                        dynamic_cast<const CLI::CallForAllHelp*>(&wish) != nullptr;
      std::fputs(help ? program.help().c_str() : (text_of(wish) + "\n").c_str(), stdout);
      return kExitDone;
    } catch (const CLI::ParseError& error) {
      const CLI::App* app = &program;
      for (const Command& command : commands)
        if (command.app->parsed()) app = command.app;
      throw UsageError((app == &program ? "" : app->get_name() + ": ") + text_of(error) + " ('" +
                       called(program, *app) + " --help' explains the options)");
    }
    for (const Command& command : commands)
      if (alone || command.app->parsed()) return command.run();
    return kExitUsage;
  });
}

Command add_left_out_command(CLI::App& program, const std::string& name,
                             const std::string& command) {
  const std::string text = left_out_text(name, command);
  CLI::App* app = program.add_subcommand(name, "Not in this build.");
  app->footer(text + ".");
  app->allow_extras();
  return {app, [text]() -> int { throw UsageError(text); }, command};
}

CLI::Validator positive_number() {
  return CLI::Validator(
      [](std::string& word) {
        double value = 0;
        return CLI::detail::lexical_cast(word, value) && value > 0
                   ? std::string()
                   : "'" + word + "' is no positive number";
      },
      "> 0");
}

CLI::Validator number_within(double least, double most) {
  const CLI::Range range(least, most);
  CLI::Validator within = range;
  within.operation([range](std::string& word) {
    double value = 0;
    const bool is_number = CLI::detail::lexical_cast(word, value) && !std::isnan(value);
    return is_number ? range(word) : "'" + word + "' is no number";
  });
  return within;
}

CLI::Validator number_not_negative() {
  return CLI::Validator(
      [](std::string& word) {
        double value = 0;
        return CLI::detail::lexical_cast(word, value) && value >= 0
                   ? std::string()
                   : "'" + word + "' is no number from 0 up";
      },
      ">= 0");
}

}  // namespace haptic::tools
