// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "evaluation/gate.h"

namespace vlp {

/// One test of a JUnit report.
struct JUnitTest {
  enum class Result {
    passed,
    failed,  // measured, and a gate is not passed
    error    // could not be measured
  };

  std::string name;
  Result result = Result::passed;
  /// Cause of the failure or error and its remedy, human-readable. Empty if the test passed.
  std::string message = {};
  /// Kind of an error, for example "wrong_map"; empty for the other results.
  std::string error_type = {};
  /// Text printed with the test, even if it passed.
  std::vector<std::string> warnings = {};
};

/// Returns a test for each gate, in their order; `failed` with describe_failed_gate() if the gate
/// is not passed.
/// @pre all have a limit
std::vector<JUnitTest> make_gate_tests(std::span<const CheckedMetric> gates);

/// Formats a report of one suite as JUnit XML, for CI systems. Errors become `error`, failures
/// `failure`, warnings `system-err`.
std::string format_junit_xml(const std::string& suite_name, std::span<const JUnitTest> tests);

}  // namespace vlp
