// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace vlp {

/// What became of one gate.
struct GateResult {
  std::string name;
  /// Of value and limit: "mm", "deg", or empty for a share or a ratio.
  std::string unit;
  double value;
  double limit;
  /// value <= limit; never where there is no value (NaN).
  bool passed;
};

}  // namespace vlp
