// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string>

namespace vlp {

/// What became of one gate.
struct GateResult {
  /// Of a gate that is text alone: the text.
  std::string name;
  /// Of value and limit: "mm", "deg", or empty for a share or a ratio.
  std::string unit;
  double value;
  double limit;
  /// value <= limit; never where there is no value (NaN).
  bool passed;

  /// Of a stage before, of which there is no figure here: neither value nor limit (NaN).
  bool is_text() const { return std::isnan(value) && std::isnan(limit); }
};

}  // namespace vlp
