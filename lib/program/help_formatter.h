// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vlp {

/// Formatter of --help for CLI11, in 80 columns. Descriptions of options wrap within their column.
///
/// In the description of a program, lines that begin with a space (examples, lists) are kept
/// unchanged and have to fit. The other lines form paragraphs, separated by blank lines, and wrap.
/// In the footer, each line wraps at its second column.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_footer(const CLI::App* app) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
};

}  // namespace vlp
