// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// Verdict on a camera: of a run at a station, of a session, and of a report.
enum class Verdict {
  /// The camera was measured and meets all limits.
  pass,
  /// The camera was measured and fails at least one limit of its own.
  fail,
  /// The camera was not evaluated. At a station the reason is the station, the operator or an
  /// aborted run; the run counts neither for the yield nor for trends and has to be repeated. In a
  /// session a step failed.
  invalid
};

/// Returns PASS, FAIL or INVALID.
constexpr const char* verdict_name(Verdict verdict) {
  constexpr std::array names{"PASS", "FAIL", "INVALID"};
  return names[static_cast<std::size_t>(verdict)];
}

/// Returns the word in session.json: "pass", "gate" or "no result".
constexpr const char* verdict_text(Verdict verdict) {
  constexpr std::array names{"pass", "gate", "no result"};
  return names[static_cast<std::size_t>(verdict)];
}

/// Reason why a unit does not pass.
struct Cause {
  std::string text;
  /// True if the camera itself is the reason: a metric outside its gate, or blur. False for the
  /// measuring equipment and its use.
  bool is_camera_fault = false;
};

/// Returns the verdict of the first cause, because later causes can follow from it; PASS without
/// causes.
inline Verdict decide_verdict(const std::vector<Cause>& causes) {
  if (causes.empty()) return Verdict::pass;
  return causes.front().is_camera_fault ? Verdict::fail : Verdict::invalid;
}

}  // namespace vlp
