// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace vlp {

/// How a run ends.
enum class Verdict {
  pass,
  /// The camera was measured, and is not good enough.
  fail,
  /// The camera was not judged: the station, the operator or an end before the end stood in the
  /// way. It counts in no yield and no trend; the run is to be done again.
  invalid
};

/// PASS, FAIL or INVALID.
constexpr const char* name_of(Verdict verdict) {
  constexpr std::array names{"PASS", "FAIL", "INVALID"};
  return names[static_cast<std::size_t>(verdict)];
}

/// Why a unit does not pass.
struct Cause {
  std::string text;
  /// Whether it is the camera's: a figure of it that misses its gate, or blur. All else is of what
  /// it is measured with, or how.
  bool of_camera = false;
};

/// The first cause decides: what follows rests on it.
inline Verdict verdict_of(const std::vector<Cause>& causes) {
  if (causes.empty()) return Verdict::pass;
  return causes.front().of_camera ? Verdict::fail : Verdict::invalid;
}

}  // namespace vlp
