// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_features.h"

#include <cassert>
#include <cmath>

namespace vlp {

LampFeatures compute_lamp_features(const Stripes& stripes) {
  assert(stripes.period_lines > 0);
  return {std::log(stripes.period_lines), stripes.duty, stripes.count_per_line, stripes.lit_area};
}

}  // namespace vlp
