// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/help_formatter.h"

#include <sstream>
#include <utility>
#include <vector>

namespace vlp {
namespace {

constexpr std::size_t kHelpWidth = 80;

/// Splits a word wider than `room` columns after its commas; returns other words unchanged.
std::vector<std::string> split_after_commas(const std::string& word, std::size_t room) {
  std::vector<std::string> parts(1);
  for (const char letter : word) {
    parts.back() += letter;
    if (word.size() > room && letter == ',') parts.emplace_back();
  }
  return parts;
}

/// Wraps `text` to lines of at most kHelpWidth columns. The first line continues at column `at`,
/// later lines begin at column `indent`.
std::string wrap_text(const std::string& text, std::size_t at, std::size_t indent) {
  std::istringstream words(text);
  std::string lines;
  for (std::string word; words >> word;) {
    bool gap = !lines.empty();
    for (const std::string& part : split_after_commas(word, kHelpWidth - indent)) {
      if (!lines.empty() && at + (gap ? 1 : 0) + part.size() > kHelpWidth) {
        lines.append("\n").append(indent, ' ');
        at = indent;
        gap = false;
      }
      lines.append(gap ? " " : "").append(part);
      at += (gap ? 1 : 0) + part.size();
      gap = false;
    }
  }
  return lines;
}

/// Formats a name on the left and its meaning on the right, from column `column` on; on the next
/// line if the name is too long.
std::string format_two_columns(const std::string& name, const std::string& meaning,
                               std::size_t column) {
  constexpr std::size_t kIndent = 2;
  std::string lines = std::string(kIndent, ' ') + wrap_text(name, kIndent, 3 * kIndent);
  if (!meaning.empty()) {
    const bool room = lines.size() < column;
    lines.append(room ? "" : "\n").append(room ? column - lines.size() : column, ' ');
    lines.append(wrap_text(meaning, column, column));
  }
  return lines.append("\n");
}

}  // namespace

std::string HelpFormatter::make_description(const CLI::App* app) const {
  std::istringstream description(CLI::Formatter::make_description(app));
  std::string text, paragraph;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) text.append(wrap_text(paragraph, 0, 0)).append("\n");
    paragraph.clear();
  };
  for (std::string line; std::getline(description, line);) {
    if (line.empty() || line.front() == ' ') {
      end_paragraph();
      text.append(line).append("\n");
    } else {
      paragraph.append(line).append(" ");
    }
  }
  end_paragraph();
  return text;
}

std::string HelpFormatter::make_usage(const CLI::App* app, std::string name) const {
  return wrap_text(CLI::Formatter::make_usage(app, std::move(name)), 0, 7).append("\n");
}

std::string HelpFormatter::make_footer(const CLI::App* app) const {
  std::istringstream footer(CLI::Formatter::make_footer(app));
  std::string text;
  for (std::string line; std::getline(footer, line);) {
    const std::size_t name = line.find_first_not_of(' ');
    const std::size_t gap = name == std::string::npos ? name : line.find("  ", name);
    const std::size_t text_at = gap == std::string::npos ? gap : line.find_first_not_of(' ', gap);
    const std::size_t column = text_at == std::string::npos ? 0 : text_at;
    text.append(line, 0, column)
        .append(wrap_text(line.substr(column), column, column))
        .append("\n");
  }
  return text;
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return format_two_columns(command->get_display_name(true), command->get_description(),
                            get_column_width());
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  return format_two_columns(make_option_name(option, is_positional) + make_option_opts(option),
                            make_option_desc(option), get_column_width());
}

}  // namespace vlp
