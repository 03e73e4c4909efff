// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

// Not installed, and not exported by the shared library.
#pragma GCC visibility push(hidden)
namespace vlp {

/// Kind of a name in files and on the command line.
enum class NameKind {
  key,     ///< key of a YAML file
  column,  ///< column of a CSV table
  metric,  ///< metric, also as the name of a gate
  option,  ///< option of a program, with its dashes
  value,   ///< value of an option
};

/// Returns the present name of a key, column, metric, option or value that was called `former` in
/// earlier versions. Empty if nothing of this kind had that name.
std::string_view find_current_name_for_former(NameKind kind, std::string_view former);

/// Returns the former name for a present one; empty if there is none.
std::string_view find_former_name_for_current(NameKind kind, std::string_view present);

/// Describes a renaming for a message: "'spot' is now called 'pivot'".
std::string describe_renaming(std::string_view former, std::string_view present);

}  // namespace vlp
#pragma GCC visibility pop
