// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app.h"
#include "evaluation/check_gates.h"
#include "report_option.h"

namespace vlp {

/// What vlp-evaluate is told.
struct EvaluateOptions {
  std::string fixes, truth, path, compare, lamps, calibration, gates_file, json, junit;
  std::vector<double> line_m;  // X0 Y0 X1 Y1
  std::vector<std::string> gates, unmet;
  double noise_px = 0;
  std::optional<double> station_mm;
  int threads = all_cores();
  ReportOption report;
};

void add_evaluate_options(CLI::App& app, EvaluateOptions& options);

/// The gates of the file, and those of the command line, which hold where both say something.
/// Throws InputError and std::invalid_argument.
std::vector<Gate> gates_of(const EvaluateOptions& options);

/// Throws std::invalid_argument when options do not go together.
void check_evaluate_options(const EvaluateOptions& options, const std::vector<Gate>& gates);

/// The files that are read, without those of the report; some names may be empty.
std::vector<std::string> inputs_of(const EvaluateOptions& options);

}  // namespace vlp
