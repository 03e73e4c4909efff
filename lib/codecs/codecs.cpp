// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

#include <dlfcn.h>

#include <stdexcept>

namespace vlp {
namespace {

/// Loads the library and never unloads it. It is found by the run path of the program. Functions
/// are bound when they are called: to bind all of its libraries takes 15 ms more.
const Codecs& load_codecs() {
  using Make = const Codecs* (*)();
  void* const library = ::dlopen(VLP_CODECS_LIBRARY, RTLD_LAZY | RTLD_LOCAL);
  if (library == nullptr) {
    throw std::runtime_error(std::string("images cannot be read or written: ") + ::dlerror() +
                             ": install the programs again");
  }
  // POSIX allows the conversion of a symbol's address to a function pointer.
  const auto make = reinterpret_cast<Make>(::dlsym(library, "vlp_codecs"));  // NOLINT
  if (make == nullptr) {
    throw std::runtime_error(std::string("images cannot be read or written: ") +
                             VLP_CODECS_LIBRARY +
                             " is of another version: install the programs again");
  }
  return *make();
}

}  // namespace

const Codecs& codecs() {
  static const Codecs& loaded = load_codecs();
  return loaded;
}

}  // namespace vlp
