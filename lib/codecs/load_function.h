// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// Loads a library of the programs, which is never unloaded, and returns the address of one of its
/// functions. The library is found by the run path of the program. Its functions are bound when
/// they are called, because binding those of all libraries that it needs takes 15 ms more.
///
/// @param library   name of the file
/// @param function  name of an extern "C" function
/// @param problem   beginning of the message, such as "images cannot be read or written"
/// @throws std::runtime_error if the library cannot be loaded or lacks the function
void* load_function(const char* library, const char* function, const std::string& problem);

}  // namespace vlp
