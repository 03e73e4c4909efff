// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/errors/bias_and_scatter.h"
#include "evaluation/errors/bootstrap.h"
#include "evaluation/errors/comparison.h"
#include "evaluation/errors/error_figures.h"
#include "evaluation/errors/error_ratios.h"
#include "evaluation/errors/fix_errors.h"
#include "evaluation/errors/line_fit.h"

namespace vlp {

/// What fixes are held against: one of a truth, a path and a commanded line.
struct EvaluationInput {
  FromFile<FixRow> fixes;
  std::optional<FromFile<TruthRow>> truth;
  std::optional<Path> path;
  std::optional<CommandedLine> line_m;
  /// Captures whose true places are so near are of one station.
  double station_m = 1e-3;
  /// To compare with.
  std::optional<FromFile<FixRow>> others;
  /// For the theoretical limit; with a truth that has z_m and yaw_rad.
  struct Limit {
    LampMap lamps;
    Camera camera;
    double noise_px;
  };
  std::optional<Limit> limit;
  int threads = 1;
};

/// What the fixes are worth. With no fix nothing below `missing` holds.
struct Evaluation {
  /// "truth", "path" or "line".
  std::string against;
  std::size_t captures = 0, fixes = 0;
  /// Captures without a fix, by status.
  std::map<std::string, std::size_t> missing;
  double missing_share() const {
    return static_cast<double>(captures - fixes) / static_cast<double>(captures);
  }

  ErrorFigures horizontal_m{};
  std::vector<std::pair<double, double>> distribution_m;
  std::optional<ErrorIntervals> intervals_m;
  /// What the intervals drew: "stations", "captures" or "runs of fixes".
  std::string drawn;
  std::optional<SignedFigures> height_m, yaw_rad;
  /// With a truth: where stations have two fixes or more.
  std::optional<BiasAndScatter> stations;
  /// With a commanded line: where the fixes have a direction.
  std::optional<LineFit> fit;
  /// With a truth.
  std::optional<StatedRatio> stated;
  std::optional<LimitRatio> limit;
  std::optional<Comparison> comparison;
};

/// What single fixes are off. Throws InputError when image names do not match.
FixErrors errors_of(const EvaluationInput& input, const FromFile<FixRow>& fixes);

/// Throws InputError when image names do not match.
Evaluation evaluate(const EvaluationInput& input);

}  // namespace vlp
