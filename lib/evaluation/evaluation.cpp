// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/evaluation.h"

#include <algorithm>

namespace vlp {
namespace {

Path path_of(const EvaluationInput& input) {
  if (input.path) return *input.path;
  return {{(*input.line_m)[0], (*input.line_m)[1]}, {}};
}

void add_horizontal(Evaluation& evaluation, const std::vector<FixError>& errors, int threads) {
  std::vector<double> sizes_m;
  std::vector<std::size_t> units;
  sizes_m.reserve(errors.size());
  units.reserve(errors.size());
  for (const FixError& error : errors) {
    sizes_m.push_back(error.horizontal_m.norm());
    units.push_back(error.unit);
  }
  evaluation.intervals_m = error_intervals(sizes_m, units, threads);
  evaluation.horizontal_m = figures_of(sizes_m);
  evaluation.distribution_m = distribution_of(std::move(sizes_m));
}

std::optional<SignedFigures> signed_figures(const std::vector<FixError>& errors,
                                            std::optional<double> FixError::*part) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const FixError& error : errors) {
    if (error.*part) values.push_back(*(error.*part));
  }
  if (values.empty()) return std::nullopt;
  return signed_figures_of(std::move(values));
}

void add_comparison(Evaluation& evaluation, const EvaluationInput& input,
                    const std::vector<FixError>& errors) {
  if (!input.truth) check_same_images(input.fixes, *input.others);
  const FixErrors others = errors_of(input, *input.others);
  evaluation.comparison =
      compare(input.fixes.rows, errors, input.others->rows, others.errors, input.threads);
}

}  // namespace

FixErrors errors_of(const EvaluationInput& input, const FromFile<FixRow>& fixes) {
  if (input.truth) return errors_against_truth(fixes, *input.truth, input.station_m);
  return errors_against_path(fixes.rows, path_of(input));
}

Evaluation evaluate(const EvaluationInput& input) {
  const auto [captures, missing, errors] = errors_of(input, input.fixes);
  Evaluation evaluation;
  evaluation.against = input.truth ? "truth" : input.path ? "path" : "line";
  evaluation.captures = captures;
  evaluation.fixes = errors.size();
  evaluation.missing = missing;
  if (errors.empty()) return evaluation;
  add_horizontal(evaluation, errors, input.threads);
  evaluation.height_m = signed_figures(errors, &FixError::height_m);
  evaluation.yaw_rad = signed_figures(errors, &FixError::yaw_rad);
  evaluation.drawn = "runs of fixes";
  if (input.truth) {
    evaluation.stations = bias_and_scatter(errors, input.truth->rows);
    evaluation.drawn = evaluation.stations ? "stations" : "captures";
    evaluation.stated = stated_ratio(input.fixes.rows, errors);
  }
  if (input.truth && input.limit) {
    const auto& [lamps, camera, noise_px] = *input.limit;
    evaluation.limit =
        limit_ratio(errors, input.truth->rows, lamps, camera, noise_px, input.threads);
  }
  if (input.line_m) evaluation.fit = fit_line(input.fixes.rows, *input.line_m);
  if (input.others) add_comparison(evaluation, input, errors);
  return evaluation;
}

}  // namespace vlp
