// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/reference.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <functional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "program/help_formatter.h"

namespace vlp {
namespace {

using Options = std::vector<const CLI::Option*>;

/// Returns the options in --help, in its order.
Options collect_options(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) {
    return option->nonpositional() && !option->get_group().empty();
  });
}
Options collect_positionals(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return option->get_positional(); });
}
std::vector<const CLI::App*> list_commands(const CLI::App& app) {
  return app.get_subcommands(std::function<bool(const CLI::App*)>(
      [](const CLI::App* command) { return !command->get_name().empty(); }));
}

/// Returns the names of an option: "-o", "--output", and "--no-report" of a flag that has it.
std::vector<std::string> collect_names(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

/// Returns the choices of an option of type "a|b" or "TEXT:{a,b}"; empty for other types.
std::vector<std::string> parse_choices(const CLI::Option& option) {
  std::string list = option.get_type_name();
  char separator = '|';
  if (const auto brace = list.find(":{"); brace != std::string::npos) {
    list = list.substr(brace + 2, list.rfind('}') - brace - 2);
    separator = ',';
  } else if (list.find('|') == std::string::npos) {
    return {};
  }
  std::vector<std::string> choices;
  std::istringstream stream(list);
  for (std::string choice; std::getline(stream, choice, separator);) choices.push_back(choice);
  return choices;
}

enum class Value { none, choice, file, other };

Value classify_option_value(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return Value::none;  // a flag
  if (!parse_choices(option).empty()) return Value::choice;
  const std::string type = option.get_type_name();
  const std::string word = type.substr(0, type.find_first_of(": ["));
  const bool file = word == "TEXT" || word == "FILE" || word == "SET" || word == "FIXES";
  return file ? Value::file : Value::other;
}

/// Returns `text` with a backslash before each of `letters`.
std::string escape_letters(const std::string& text, std::string_view letters) {
  std::string result;
  for (const char letter : text) {
    if (letters.find(letter) != std::string_view::npos) result += '\\';
    result += letter;
  }
  return result;
}

std::string join_words(const std::vector<std::string>& words, const char* separator = " ") {
  return fmt::format("{}", fmt::join(words, separator));
}

/// Returns a line of roff that prints `text`.
std::string escape_roff(const std::string& text) {
  std::string line;
  for (const char letter : text) {
    if (letter == '\\') {
      line.append("\\e");
    } else {
      line.append(letter == '-' ? "\\" : "").append(1, letter);
    }
  }
  if (line.starts_with('.') || line.starts_with('\'')) line.insert(0, "\\&");
  return line;
}

/// Formats text in roff: lines that begin with a blank, or all if `verbatim`, unchanged; other
/// lines as paragraphs.
std::string format_roff_paragraphs(const std::string& text, bool verbatim) {
  std::istringstream lines(text);
  std::string page;
  bool was_unfilled = false;
  for (std::string line; std::getline(lines, line);) {
    const bool is_unfilled = verbatim || line.starts_with(' ');
    if (is_unfilled != was_unfilled) page.append(is_unfilled ? ".PP\n.nf\n" : ".fi\n");
    was_unfilled = is_unfilled;
    // Examples are written for the build tree; installed programs are in the path.
    for (auto at = line.find("build/bin/"); at != std::string::npos; at = line.find("build/bin/")) {
      line.erase(at, 10);
    }
    page.append(line.empty() ? (is_unfilled ? "" : ".PP") : escape_roff(line)).append("\n");
  }
  return page.append(was_unfilled ? ".fi\n" : "");
}

/// Returns the line "vlp-locate - positions from ...": the description up to its first stop.
std::string format_name_line(const CLI::App& app) {
  std::string summary = app.get_description();
  std::replace(summary.begin(), summary.end(), '\n', ' ');
  for (std::size_t i = 0; i + 1 < summary.size(); ++i) {
    const bool stop = summary[i] == '.' || summary[i] == ':' || summary[i] == ';';
    if (stop && summary[i + 1] == ' ') summary.resize(i);
  }
  if (summary.ends_with('.')) summary.pop_back();
  if (!summary.empty()) {
    summary[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(summary[0])));
  }
  return escape_roff(app.get_name()) + " \\- " + escape_roff(summary) + "\n";
}

std::string format_roff_options(const Options& options, bool positional) {
  const HelpFormatter formatter;
  std::string page;
  for (const CLI::Option* option : options) {
    const std::string name =
        formatter.make_option_name(option, positional) + formatter.make_option_opts(option);
    page +=
        fmt::format(".TP\n.B {}\n{}\n", escape_roff(name), escape_roff(option->get_description()));
  }
  return page;
}

/// Returns the name of the shell function for a program.
std::string make_function_name(const std::string& program) {
  std::string name = "_" + program;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

std::string format_bash_options(const CLI::App& app, const std::string& indent) {
  std::vector<std::string> names;
  std::string cases;
  for (const CLI::Option* option : collect_options(app)) {
    const auto option_names = collect_names(*option);
    names.insert(names.end(), option_names.begin(), option_names.end());
    const Value value = classify_option_value(*option);
    if (value == Value::none) continue;
    std::string effect;
    if (value == Value::choice) {
      effect = fmt::format("words='{}'; ", join_words(parse_choices(*option)));
    }
    if (value == Value::file) effect = "files=yes; ";
    cases += fmt::format("{}  {}) {}value=yes ;;\n", indent, join_words(option_names, "|"), effect);
  }
  return fmt::format("{0}options='{1}'\n{0}case $previous in\n{2}{0}esac\n", indent,
                     join_words(names), cases);
}

/// Returns an argument for _arguments of zsh: '(-o --output)'{-o,--output}'[text]:value:_files'.
std::string format_zsh_option(const CLI::Option& option) {
  const auto names = collect_names(option);
  const bool is_repeatable = option.get_expected_max() > 1;
  std::string text = escape_letters(option.get_description(), "[]:\\");
  for (auto at = text.find('\''); at != std::string::npos; at = text.find('\'', at + 4)) {
    text.replace(at, 1, "'\\''");
  }
  std::string spec;
  if (is_repeatable) {
    spec = "'*'";
  } else if (names.size() > 1) {
    spec = "'(" + join_words(names) + ")'";
  }
  const std::string list = join_words(names, ",");
  spec.append(names.size() > 1 ? "{" + list + "}" : list).append("'[" + text + "]");
  const Value value = classify_option_value(option);
  const int values = value == Value::none ? 0 : std::max(1, option.get_items_expected_min());
  for (int i = 0; i < values; ++i) {
    spec.append(":value:");
    if (value == Value::choice) spec.append("(" + join_words(parse_choices(option)) + ")");
    if (value == Value::file) spec.append("_files");
  }
  return spec + "'";
}

std::string format_zsh_arguments(const CLI::App& app, const std::string& indent) {
  std::string text = indent + "_arguments -s" + (list_commands(app).empty() ? "" : " -C");
  for (const CLI::Option* option : collect_options(app)) {
    text.append(" \\\n").append(indent).append("  ").append(format_zsh_option(*option));
  }
  if (!collect_positionals(app).empty()) text.append(" \\\n" + indent + "  '*:file:_files'");
  return text;
}

std::vector<std::string> collect_names(const std::vector<const CLI::App*>& commands) {
  std::vector<std::string> names(commands.size());
  std::transform(commands.begin(), commands.end(), names.begin(),
                 [](const CLI::App* command) { return command->get_name(); });
  return names;
}

}  // namespace

std::string format_manual_page(const CLI::App& app) {
  const HelpFormatter formatter;
  std::string page =
      ".TH " + escape_roff(app.get_name()) + " 1 \"\" \"vlp " VLP_VERSION "\" \"VLP\"\n";
  page.append(".SH NAME\n").append(format_name_line(app));
  page.append(".SH SYNOPSIS\n.B ").append(escape_roff(app.get_name())).append("\n[OPTIONS]");
  for (const CLI::Option* option : collect_positionals(app)) {
    page.append(" ").append(escape_roff(formatter.make_option_usage(option)));
  }
  page.append(list_commands(app).empty() ? "\n" : " COMMAND ...\n");
  page.append(".SH DESCRIPTION\n").append(format_roff_paragraphs(app.get_description(), false));
  if (!collect_positionals(app).empty()) {
    page.append(".SH ARGUMENTS\n").append(format_roff_options(collect_positionals(app), true));
  }
  page.append(".SH OPTIONS\n").append(format_roff_options(collect_options(app), false));
  for (const CLI::App* command : list_commands(app)) {
    page.append(".SH COMMAND ").append(escape_roff(command->get_name())).append("\n");
    page.append(format_roff_paragraphs(command->get_description(), false));
    page.append(format_roff_options(collect_positionals(*command), true));
    page.append(format_roff_options(collect_options(*command), false));
  }
  if (!app.get_footer().empty()) {
    page.append(".SH FURTHER\n").append(format_roff_paragraphs(app.get_footer(), true));
  }
  page.append(
      ".SH EXIT STATUS\n.TP\n0\nDone.\n.TP\n1\nDone, but a gate failed.\n.TP\n2\nBad input or "
      "usage; a line on stderr names file, line and key.\n.TP\n3\nThe data do not determine the "
      "result; a line on stderr states what to add.\n");
  return page;
}

std::string format_bash_completion(const CLI::App& app) {
  const std::string function = make_function_name(app.get_name());
  const auto commands = list_commands(app);
  const auto names = collect_names(commands);
  std::string text =
      "# Completion of " + app.get_name() + " for bash; made from its options.\n" + function +
      "() {\n"
      "  local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
      "  local options words='' files='' value='' command='' word\n"
      "  COMPREPLY=()\n";
  if (!commands.empty()) {
    text.append("  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    case $word in\n      ");
    text += join_words(names, "|") + ") command=$word; break ;;\n    esac\n  done\n";
    text += "  case $command in\n";
    for (const CLI::App* command : commands) {
      text += fmt::format("    {})\n{}      ;;\n", command->get_name(),
                          format_bash_options(*command, "      "));
    }
    text.append("    *)\n").append(format_bash_options(app, "      "));
    text.append("      [ \"$value\" ] || words='" + join_words(names) + "'\n      ;;\n  esac\n");
  } else {
    text.append(format_bash_options(app, "  "));
  }
  if (commands.empty() && !collect_positionals(app).empty())
    text.append("  [ \"$value\" ] || files=yes\n");
  text.append(
      "  if [[ $current == -* && ! $value ]]; then\n"
      "    words=$options files=''\n"
      "  fi\n"
      "  if [ \"$files\" ]; then\n"
      "    compopt -o filenames 2>/dev/null\n"
      "    mapfile -t COMPREPLY < <(compgen -f -- \"$current\")\n"
      "  else\n"
      "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$current\")\n"
      "  fi\n"
      "}\n");
  return text + "complete -F " + function + " " + app.get_name() + "\n";
}

std::string format_zsh_completion(const CLI::App& app) {
  const auto commands = list_commands(app);
  std::string text = "#compdef " + app.get_name() + "\n# Made from its options.\n";
  if (commands.empty()) return text + format_zsh_arguments(app, "") + "\n";
  const auto names = collect_names(commands);
  text.append("local curcontext=$curcontext state line\n").append(format_zsh_arguments(app, ""));
  text.append(" \\\n  '1:command:(" + join_words(names) + ")' \\\n  '*::argument:->command'\n");
  text.append("[[ $state == command ]] || return\ncase $words[1] in\n");
  for (const CLI::App* command : commands) {
    text.append("  " + command->get_name() + ")\n").append(format_zsh_arguments(*command, "    "));
    text.append("\n    ;;\n");
  }
  return text + "esac\n";
}

std::string format_reference(const CLI::App& app, std::string_view which) {
  if (which == "man") return format_manual_page(app);
  if (which == "bash") return format_bash_completion(app);
  if (which == "zsh") return format_zsh_completion(app);
  return {};
}

}  // namespace vlp
