// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace CLI {
class App;
}  // namespace CLI

/// What is installed beside a program, from the same source as its --help: its own options.
/// `PROGRAM --reference man|bash|zsh` prints it; the build does, and nobody else has to.
namespace vlp {

/// The manual page, in section 1, in roff.
std::string manual_page(const CLI::App& app);

/// What the shell completes: options, subcommands, the choices of an option, files where an option
/// does not want a number.
std::string bash_completion(const CLI::App& app);
std::string zsh_completion(const CLI::App& app);

/// The one of the three that is asked for; nothing of another name.
std::string reference_of(const CLI::App& app, std::string_view which);

}  // namespace vlp
