// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_choice.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "geometry/angles.h"
#include "geometry/statistical_bounds.h"

namespace vlp {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Candidates in the order of their number of parameters.
constexpr std::array kModels{LensModel::opencv4, LensModel::fisheye, LensModel::opencv5,
                             LensModel::opencv8, LensModel::opencv12};
/// Blocks of views of the cross-validation.
constexpr std::size_t kBlocks = kMinViewsToCompare;
/// Standard errors within which a smaller model is selected, and may describe the lens.
constexpr double kMaxErrors = 1, kMaxPlausibleErrors = 2;

/// Fits a model to the corners of a solution, starting from its lens.
std::optional<IntrinsicsSolution> fit_model_to_corners(const IntrinsicsSolution& start,
                                                       LensModel model) {
  const BoardProblem& from = start.problem;
  if (model == from.lens_model) return start;
  IntrinsicsSolution fit = start;
  fit.problem.lens_model = model;
  if (model == LensModel::opencv12 && from.lens_model == LensModel::opencv8) {
    fit.problem.intrinsics.resize(num_lens_parameters(model), 0);
  } else {
    Camera camera;
    camera.lens_model = from.lens_model;
    camera.imager_px = from.imager_px;
    camera.intrinsics = from.intrinsics;
    try {
      fit.problem.intrinsics = convert_lens_model(camera, model).camera.intrinsics;
    } catch (const std::invalid_argument&) {
      return {};  // no lens of the model is similar
    }
  }
  if (!solve_intermediate_stage(fit.problem, fit.solved_parameters)) return {};
  fit.update_statistics();
  return fit;
}

/// Logarithms of the mean squared residuals of the held-out views.
using LogSquares = Eigen::VectorXd;

/// Computes the logarithms for a fit; infinite if a view is not determined.
LogSquares compute_log_squares(const IntrinsicsSolution& fit) {
  const std::vector<double> squares_px2 = compute_left_out_squares_px2(fit, kBlocks);
  LogSquares logs(std::ssize(squares_px2));
  for (std::size_t view = 0; view < squares_px2.size(); ++view)
    logs[static_cast<Eigen::Index>(view)] = std::log(squares_px2[view]);
  return logs.allFinite() ? logs : LogSquares::Constant(logs.size(), kInfinity);
}

/// Returns the largest mean of one value per view that is not significant: the standard error, from
/// the means of blocks of consecutive views, times the factor of `errors` and of the few blocks.
double compute_max_mean(const Eigen::VectorXd& values, Eigen::Index blocks, double errors) {
  const Eigen::Index views = values.size();
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(blocks);
  for (Eigen::Index view = 0; view < views; ++view)
    sums[view * blocks / views] += values[view] - values.mean();
  const double freedom = static_cast<double>(blocks - 1), count = static_cast<double>(views);
  const double variance =
      sums.squaredNorm() * static_cast<double>(blocks) / freedom / count / count;
  return std::sqrt(compute_squared_t_bound(errors, freedom) * variance);
}

/// Compares the candidates with the best one: sets their excess and its limits.
void compare_with_best(const std::vector<LogSquares>& logs, LensChoice& choice) {
  const auto best = std::ranges::min_element(logs, {}, [](const auto& log) { return log.mean(); });
  const auto relative_rms = [](double mean_log) { return std::expm1(mean_log / 2); };
  for (std::size_t i = 0; i < logs.size(); ++i) {
    LensCandidate& candidate = choice.candidates[i];
    const double mean = logs[i].mean();
    if (!std::isfinite(mean)) continue;
    const Eigen::VectorXd ratios = logs[i] - *best;
    candidate.rms_px = std::exp(mean / 2);
    candidate.excess = relative_rms(ratios.mean());
    candidate.max_excess = relative_rms(compute_max_mean(ratios, ratios.size(), kMaxErrors));
    candidate.max_plausible_excess =
        relative_rms(std::max(compute_max_mean(ratios, ratios.size(), kMaxPlausibleErrors),
                              compute_max_mean(ratios, kBlocks, kMaxPlausibleErrors)));
  }
  const auto first = std::ranges::find(choice.candidates, false, &LensCandidate::is_rejected);
  if (first == choice.candidates.end()) return;
  const double max_excess = first->excess;
  for (LensCandidate& candidate : choice.candidates)
    candidate.max_excess = std::max(candidate.max_excess, max_excess);
}

}  // namespace

double compute_max_corner_angle_rad(const IntrinsicsSolution& solution) {
  const Lens lens = solution.fitted_lens();
  double smallest = 1;
  for (const Eigen::Vector2d& pixel : list_inlier_pixels(solution.problem)) {
    if (const auto ray = lens.unproject_pixel(pixel)) {
      smallest = std::min(smallest, ray->direction.normalized().z());
    }
  }
  return std::acos(smallest);
}

std::optional<FisheyeFit> fit_fisheye_lens(const InitialSolutions& initial) {
  constexpr double max_rms_px = 2;
  IntrinsicsSolution solution = solve_intrinsics(initial, LensModel::fisheye);
  if (!solution.has_succeeded() || solution.rms_px > max_rms_px) return {};
  const double max_corner_angle_rad = compute_max_corner_angle_rad(solution);
  return FisheyeFit{std::move(solution), max_corner_angle_rad};
}

bool may_exceed_right_angle(const InitialSolutions& initial) {
  constexpr double margin_rad = 0.05;
  const auto fisheye = initial.solve_first_stages(LensModel::fisheye);
  return !fisheye || compute_max_corner_angle_rad(*fisheye) >= kRightAngle_rad - margin_rad;
}

bool is_fisheye_worse(const InitialSolutions& initial, LensModel other) {
  constexpr double min_square_ratio = 1.5;
  const auto fisheye = initial.solve_first_stages(LensModel::fisheye);
  const auto compared = initial.solve_first_stages(other);
  if (!fisheye || !compared || fisheye->views != compared->views) return false;
  const double ratio = fisheye->rms_px / compared->rms_px;
  return ratio * ratio > min_square_ratio && !may_exceed_right_angle(initial);
}

bool may_be_wide_angle(const InitialSolutions& initial) {
  constexpr double wide_rad = 0.7;
  const IntrinsicsInput& input = initial.input();
  if (input.views.empty()) return false;
  const Lens lens = make_initial_lens(input, initial.focal_lengths_px().front());
  double farthest_px = 0;
  for (const auto& corners : input.views) {
    for (const auto& corner : corners) {
      farthest_px = std::max(farthest_px, (corner.pixel - lens.principal_point_px()).norm());
    }
  }
  return 2 * std::atan(farthest_px / lens.focal_px().x() / 2) > wide_rad;
}

IntrinsicsSolution solve_opencv8_or_fisheye(const InitialSolutions& initial) {
  std::optional<FisheyeFit> fisheye;
  if (may_be_wide_angle(initial) && !is_fisheye_worse(initial, LensModel::opencv8)) {
    fisheye = fit_fisheye_lens(initial);
  }
  if (fisheye && fisheye->max_corner_angle_rad >= kRightAngle_rad)
    return std::move(fisheye->solution);
  IntrinsicsSolution solution = solve_intrinsics(initial, LensModel::opencv8);
  const bool other =
      fisheye && !(solution.has_succeeded() && solution.rms_px < fisheye->solution.rms_px);
  return other ? std::move(fisheye->solution) : solution;
}

std::optional<LensChoice> compare_lens_models(const IntrinsicsSolution& reference) {
  if (reference.views.size() < kMinViewsToCompare) return {};
  LensChoice choice{reference.problem.lens_model, {}};
  const double max_angle_rad = compute_max_corner_angle_rad(reference);
  if (max_angle_rad >= kRightAngle_rad) choice.beyond_right_angle_rad = max_angle_rad;
  std::vector<LogSquares> logs;
  const auto views = std::ssize(reference.views);
  for (const LensModel model : kModels) {
    const bool is_candidate = model == LensModel::fisheye || choice.beyond_right_angle_rad == 0;
    const bool extends_last = model == LensModel::opencv12 && choice.candidates.back().fit;
    const IntrinsicsSolution& start = extends_last && reference.problem.lens_model != model
                                          ? *choice.candidates.back().fit
                                          : reference;
    auto fit = is_candidate ? fit_model_to_corners(start, model) : std::nullopt;
    logs.push_back(fit ? compute_log_squares(*fit) : LogSquares::Constant(views, kInfinity));
    choice.candidates.push_back({.model = model, .fit = std::move(fit)});
  }
  compare_with_best(logs, choice);
  const auto selected = std::ranges::find(choice.candidates, false, &LensCandidate::is_rejected);
  if (selected == choice.candidates.end()) return {};
  choice.model = selected->model;
  return choice;
}

std::optional<LensChoice> select_lens_model(const InitialSolutions& initial) {
  if (initial.input().views.size() < kMinViewsToChoose) return {};
  IntrinsicsSolution reference = solve_opencv8_or_fisheye(initial);
  if (!reference.has_succeeded()) reference = solve_intrinsics(initial, LensModel::opencv4);
  if (!reference.has_succeeded()) return {};
  return compare_lens_models(reference);
}

std::string describe_lens_choice(const LensChoice& choice) {
  std::string selected, others;
  for (const LensCandidate& candidate : choice.candidates) {
    std::string figures(lens_model_name(candidate.model));
    figures +=
        std::isfinite(candidate.rms_px)
            ? fmt::format(" {:.4f} px ({:.1f} % above the best, limit {:.1f} %)", candidate.rms_px,
                          100 * candidate.excess, 100 * candidate.max_excess)
            : " no lens";
    if (candidate.model == choice.model) {
      selected = figures + " in held-out views";
    } else if (choice.beyond_right_angle_rad == 0) {
      others += "; " + figures;
    }
  }
  if (choice.beyond_right_angle_rad > 0) {
    others = fmt::format(
        "; the board is visible up to {:.0f} degrees off axis, where no LENSMODEL_OPENCVn has rays",
        deg_from_rad(choice.beyond_right_angle_rad));
  }
  return selected + others;
}

}  // namespace vlp
