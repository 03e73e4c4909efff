// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace CLI {
class App;
}  // namespace CLI

/// Manual page and shell completions of a program, generated from its options as --help is. The
/// build prints them with `PROGRAM --reference man|bash|zsh` and installs them.
namespace vlp {

/// Returns the manual page (section 1) of a program, generated from its options, as roff text.
std::string format_manual_page(const CLI::App& app);

/// Return the completion scripts: options, subcommands, the choices of an option, and files for
/// options that take a text.
std::string format_bash_completion(const CLI::App& app);
std::string format_zsh_completion(const CLI::App& app);

/// Returns format_manual_page() for "man", format_bash_completion() for "bash",
/// format_zsh_completion() for "zsh", and an empty string for other names.
std::string format_reference(const CLI::App& app, std::string_view which);

}  // namespace vlp
