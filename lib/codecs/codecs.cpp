// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

#include <dlfcn.h>

#include "codecs/load_function.h"

namespace vlp {
namespace {

const Codecs& load_codecs() {
  using Make = const Codecs* (*)();
  // Binding the functions of all its libraries at once takes 15 ms.
  // POSIX allows the conversion of a symbol's address to a function pointer.
  const auto make = reinterpret_cast<Make>(  // NOLINT
      load_library_function(VLP_CODECS_LIBRARY, "vlp_codecs", "images cannot be read or written",
                            RTLD_LAZY));
  return *make();
}

}  // namespace

const Codecs& get_codecs() {
  static const Codecs& loaded = load_codecs();
  return loaded;
}

}  // namespace vlp
