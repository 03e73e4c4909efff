// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/yaml_writer.h"

#include <cmath>
#include <stdexcept>

#include "rig/yaml_text.h"

namespace vlp {

void write_value(YamlWriter& out, double value) {
  if (!std::isfinite(value)) throw std::invalid_argument("a number to be saved is not finite");
  out << format_exact_number(value);
}

}  // namespace vlp
