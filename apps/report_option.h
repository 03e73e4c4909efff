// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "evaluation/evaluation.h"
#include "evaluation/gates.h"

namespace vlp {

/// The report that vlp-evaluate writes; none without a file.
struct ReportOption {
  std::string file;
  std::vector<std::string> pictures;
  /// Fixes of a drive and its commanded line.
  std::vector<std::tuple<std::string, double, double, double, double>> tracks;
};

/// Adds --report, --picture and --track.
void add_report_options(CLI::App& app, ReportOption& option);

/// What the report is about, and from which files.
struct ReportSubject {
  const EvaluationInput& input;
  const Evaluation& evaluation;
  const std::vector<GateResult>& gates;
  /// Beside the verdict; may be empty.
  std::string caution;
  /// May be empty.
  std::string lamps, calibration;
  /// All files that were read, for the digests.
  std::vector<std::string> inputs;
};

/// The report's text. Throws InputError.
std::string report_of(const CLI::App& app, const ReportOption& option,
                      const ReportSubject& subject);

}  // namespace vlp
