// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// Result of a run.
enum class Verdict {
  pass,
  /// The camera was measured and does not meet the limits.
  fail,
  /// The camera was not evaluated, because of the station, the operator or an aborted run. The run
  /// counts neither for the yield nor for trends and has to be repeated.
  invalid
};

/// Returns PASS, FAIL or INVALID.
constexpr const char* to_string(Verdict verdict) {
  constexpr std::array names{"PASS", "FAIL", "INVALID"};
  return names[static_cast<std::size_t>(verdict)];
}

/// Reason why a unit does not pass.
struct Cause {
  std::string text;
  /// True if the camera itself is the reason: a metric outside its gate, or blur. False for the
  /// measuring equipment and its use.
  bool of_camera = false;
};

/// Returns the verdict of the first cause, because later causes can follow from it; PASS without
/// causes.
inline Verdict decide_verdict(const std::vector<Cause>& causes) {
  if (causes.empty()) return Verdict::pass;
  return causes.front().of_camera ? Verdict::fail : Verdict::invalid;
}

}  // namespace vlp
