// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Returns the address of a function of a shared library; implements load_function().
void* load_symbol(const char* library, const char* function, const std::string& problem,
                  int binding);

/// Loads a shared library and returns one of its functions. The library is searched in the run path
/// of the program and is never unloaded.
///
/// @tparam Function  type of the function, such as int(double)
/// @param library    file name of the library
/// @param function   name of an extern "C" function
/// @param problem    beginning of the error message, such as "images cannot be read or written"
/// @param binding    RTLD_NOW; or RTLD_LAZY to bind functions when they are called, which starts
///     faster, but ends the process if one is missing
/// @return           the function, not null
/// @throws std::runtime_error if the library cannot be loaded or lacks the function
template <typename Function>
Function* load_function(const char* library, const char* function, const std::string& problem,
                        int binding) {
  // POSIX allows the conversion of a symbol's address to a function pointer.
  return reinterpret_cast<Function*>(  // NOLINT
      load_symbol(library, function, problem, binding));
}

}  // namespace vlp
