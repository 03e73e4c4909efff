// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/load_function.h"

#include <dlfcn.h>

#include <stdexcept>

namespace vlp {

void* load_symbol(const char* library, const char* function, const std::string& problem,
                  int binding) {
  void* const loaded = ::dlopen(library, binding | RTLD_LOCAL);
  if (loaded == nullptr) {
    throw std::runtime_error(problem + ": " + ::dlerror() + ": install the programs again");
  }
  void* const address = ::dlsym(loaded, function);
  if (address == nullptr) {
    throw std::runtime_error(problem + ": " + library +
                             " is of another version: install the programs again");
  }
  return address;
}

}  // namespace vlp
