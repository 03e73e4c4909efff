// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/errors/bootstrap.h"
#include "evaluation/errors/comparison.h"
#include "evaluation/errors/error_figures.h"
#include "evaluation/errors/error_ratios.h"
#include "evaluation/errors/fix_errors.h"
#include "evaluation/errors/line_fit.h"
#include "evaluation/gate.h"
#include "evaluation/metric.h"

namespace vlp {

/// Fixes to evaluate and their reference: one of a ground truth, a path and a commanded line.
struct EvaluationInput {
  FileRows<FixRow> fixes;
  std::optional<FileRows<TruthRow>> truth;
  std::optional<Path> path;
  std::optional<CommandedLine> line_m;
  /// Radius of a reference point, m: captures whose true positions are within this distance of its
  /// first capture belong to it.
  double reference_point_radius_m = 1e-3;
  /// Other fixes to compare with.
  std::optional<FileRows<FixRow>> other_fixes;
  /// Lamps, camera and pixel noise for the theoretical limit (CRLB). Needs a ground truth with z_m
  /// and yaw_rad.
  struct CrlbInput {
    LampMap lamps;
    Camera camera;
    double noise_px;
  };
  std::optional<CrlbInput> crlb_input;
  int threads = 1;
};

/// Accuracy of fixes. Without any fix, only the members up to `failures_by_status` are valid.
struct Evaluation {
  /// Kind of the reference of the errors: "truth", "path" or "line".
  std::string reference;
  std::size_t captures = 0, fixes = 0;
  /// Number of captures without a fix, by the word of their status.
  std::map<std::string, std::size_t> failures_by_status;
  double missing_fix_fraction() const {
    return static_cast<double>(captures - fixes) / static_cast<double>(captures);
  }

  /// Statistics of the horizontal errors (lengths), m.
  ErrorStatistics horizontal_m{};
  std::vector<std::pair<double, double>> distribution_m;
  std::optional<ErrorIntervals> intervals_m;
  /// Resampling unit of the intervals: "reference points", "captures" or "runs of fixes".
  std::string resampling_unit;
  std::optional<SignedErrorStatistics> height_m, yaw_rad;
  /// Only with a ground truth, if reference points have two fixes or more.
  std::optional<BiasAndRepeatability> bias_and_repeatability;
  /// Only with a commanded line, if the fixes determine a direction.
  std::optional<LineFit> line_fit;
  /// Only with a ground truth: describe_systematic_errors().
  std::vector<std::string> systematic_errors;
  /// Only with a ground truth.
  std::optional<NormalizedErrors> normalized_errors;
  std::optional<CrlbRatio> crlb_ratio;
  std::optional<Comparison> comparison;
};

/// Computes the errors of single fixes against the reference of `input`.
/// @throws InputError if image names do not match
FixErrors compute_fix_errors(const EvaluationInput& input, const FileRows<FixRow>& fixes);

/// Evaluates the fixes of `input`.
/// @throws InputError if image names do not match
Evaluation evaluate_fixes(const EvaluationInput& input);

/// Returns the metrics of MetricSource::evaluation and ::reference that were measured, in their
/// order.
std::vector<Metric> collect_metrics(const Evaluation& evaluation);

/// Returns gates of 0 for the metrics of the comparison that were measured: no quantity may be
/// worse than in the other fixes, and no capture may escape the comparison.
std::vector<Gate> make_comparison_gates(const std::vector<Metric>& metrics);

}  // namespace vlp
