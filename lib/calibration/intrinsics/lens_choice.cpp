// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/lens_choice.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/calibration_report.h"
#include "geometry/angles.h"
#include "geometry/median.h"

namespace vlp {
namespace {

using Squares = std::vector<double>;

/// Candidates in the order of their number of parameters.
constexpr std::array kModels{LensModel::opencv4, LensModel::fisheye, LensModel::opencv5,
                             LensModel::opencv8, LensModel::opencv12};

/// Views of two of the three parts, which are solved, and views of the third.
struct Fold {
  InitialSolutions solved;
  IntrinsicsInput held_out;
};

std::vector<Fold> split_into_folds(const IntrinsicsInput& input) {
  constexpr std::size_t parts = 3;
  std::vector<Fold> folds;
  for (std::size_t part = 0; part < parts; ++part) {
    IntrinsicsInput solved = input, held_out = input;
    solved.views.clear();
    held_out.views.clear();
    for (std::size_t view = 0; view < input.views.size(); ++view) {
      (view % parts == part ? held_out : solved).views.push_back(input.views[view]);
    }
    folds.push_back({InitialSolutions(std::move(solved)), std::move(held_out)});
  }
  return folds;
}

/// Returns the mean squared residual per axis of each view, px^2, from solves without it; infinity
/// if it has no pose. Returns std::nullopt if a solve fails.
std::optional<Squares> cross_validate(const std::vector<Fold>& folds, LensModel model) {
  Squares squares;
  for (const auto& [solved, held_out] : folds) {
    const IntrinsicsSolution solution = solve_intrinsics(solved, model);
    if (!solution.has_succeeded()) return {};
    for (const double rms_px : compute_held_out_view_residual_rms_px(solution, held_out)) {
      squares.push_back(rms_px * rms_px);
    }
  }
  return squares;
}

double mean_square(const Squares& squares) {
  return std::accumulate(squares.begin(), squares.end(), 0.0) / static_cast<double>(squares.size());
}

/// Mean over the views of log(a / b), and its standard error.
struct MeanLogRatio {
  double mean, error;
};

MeanLogRatio compute_mean_log_residual_ratio(const Squares& a, const Squares& b) {
  const auto n = static_cast<double>(a.size());
  double sum = 0, sum_of_squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::log(a[i] / b[i]);
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum_of_squares += std::pow(std::log(a[i] / b[i]) - sum / n, 2);
  }
  return {sum / n, std::sqrt(sum_of_squares / (n - 1) / n)};
}

/// Removes the views that no model fits from all models: the lens is not the cause of their
/// residuals.
void remove_views_no_model_fits(std::vector<std::optional<Squares>>& model_squares) {
  constexpr double max_ratio = 9;
  constexpr double inf = std::numeric_limits<double>::infinity();
  double typical = inf;
  Squares smallest;
  for (const auto& squares : model_squares) {
    if (!squares) continue;
    typical = std::min(typical, upper_median(*squares));
    smallest.resize(squares->size(), inf);
    for (std::size_t view = 0; view < smallest.size(); ++view) {
      smallest[view] = std::min(smallest[view], (*squares)[view]);
    }
  }
  for (auto& squares : model_squares) {
    if (!squares) continue;
    Squares kept;
    for (std::size_t view = 0; view < smallest.size(); ++view) {
      if (smallest[view] <= max_ratio * typical && std::isfinite(smallest[view])) {
        kept.push_back((*squares)[view]);
      }
    }
    const bool fits =
        std::all_of(kept.begin(), kept.end(), [](double square) { return std::isfinite(square); });
    squares = fits && kept.size() > 1 ? std::optional(kept) : std::nullopt;
  }
}

/// Returns the largest angle of a corner off the axis.
double compute_max_corner_angle_rad(const IntrinsicsSolution& solution) {
  const Lens lens = solution.fitted_lens();
  double smallest = 1;
  for (const Eigen::Vector2d& pixel : collect_inlier_corner_pixels(solution.problem)) {
    if (const auto ray = lens.unproject_pixel(pixel)) {
      smallest = std::min(smallest, ray->direction.normalized().z());
    }
  }
  return std::acos(smallest);
}

}  // namespace

std::optional<FisheyeFit> fit_fisheye_lens(const InitialSolutions& initial) {
  constexpr double max_rms_px = 2;
  IntrinsicsSolution solution = solve_intrinsics(initial, LensModel::fisheye);
  if (!solution.has_succeeded() || solution.rms_px > max_rms_px) return {};
  const double max_corner_angle_rad = compute_max_corner_angle_rad(solution);
  return FisheyeFit{std::move(solution), max_corner_angle_rad};
}

bool is_fisheye_model_clearly_worse(const InitialSolutions& initial, LensModel other) {
  constexpr double min_square_ratio = 1.5, max_angle_rad = kRightAngle_rad - 0.05;
  const auto fisheye = initial.solve_first_stages(LensModel::fisheye);
  const auto compared = initial.solve_first_stages(other);
  if (!fisheye || !compared || fisheye->views != compared->views) return false;
  const double ratio = fisheye->rms_px / compared->rms_px;
  return ratio * ratio > min_square_ratio && compute_max_corner_angle_rad(*fisheye) < max_angle_rad;
}

bool may_be_wide_angle_lens(const InitialSolutions& initial) {
  constexpr double wide_rad = 0.7;
  const IntrinsicsInput& input = initial.input();
  if (input.views.empty()) return false;
  const Lens lens = make_stereographic_lens(input, initial.initial_focal_lengths_px().front());
  double farthest_px = 0;
  for (const auto& corners : input.views) {
    for (const auto& corner : corners) {
      farthest_px = std::max(farthest_px, (corner.pixel - lens.principal_point_px()).norm());
    }
  }
  return 2 * std::atan(farthest_px / lens.focal_px().x() / 2) > wide_rad;
}

std::optional<LensChoice> select_lens_model(const InitialSolutions& initial) {
  if (initial.input().views.size() < kMinViewsToChoose) return {};
  LensChoice choice{};
  choice.fisheye = fit_fisheye_lens(initial);
  if (choice.fisheye && choice.fisheye->max_corner_angle_rad >= kRightAngle_rad) {
    choice.beyond_right_angle_rad = choice.fisheye->max_corner_angle_rad;
  }
  const std::vector<Fold> folds = split_into_folds(initial.input());
  std::vector<std::optional<Squares>> squares;
  for (const LensModel model : kModels) {
    const bool is_candidate = model == LensModel::fisheye || choice.beyond_right_angle_rad == 0;
    squares.push_back(is_candidate ? cross_validate(folds, model) : std::nullopt);
  }
  remove_views_no_model_fits(squares);
  constexpr double errors = 2;
  const Squares* best = nullptr;
  for (std::size_t i = 0; i < kModels.size(); ++i) {
    choice.candidates.push_back({kModels[i]});
    if (!squares[i]) continue;
    choice.candidates.back().rms_px = std::sqrt(mean_square(*squares[i]));
    if (best == nullptr || compute_mean_log_residual_ratio(*squares[i], *best).mean < 0)
      best = &*squares[i];
  }
  if (best == nullptr) return {};
  for (std::size_t i = 0; i < kModels.size(); ++i) {
    if (!squares[i]) continue;
    const auto [mean, error] = compute_mean_log_residual_ratio(*squares[i], *best);
    if (mean > errors * error) continue;
    choice.model = kModels[i];
    break;
  }
  return choice;
}

std::string describe_lens_model_choice(const LensChoice& choice) {
  std::string taken, others;
  if (choice.beyond_right_angle_rad > 0) {
    others = fmt::format(
        "the board is visible up to {:.0f} degrees off axis, where no LENSMODEL_OPENCVn has rays",
        deg_from_rad(choice.beyond_right_angle_rad));
  }
  for (const auto& [model, rms_px] : choice.candidates) {
    const std::string left =
        std::isfinite(rms_px) ? fmt::format("{:.3f} px", rms_px) : std::string("no lens");
    if (model == choice.model) {
      taken = fmt::format("{}, {}", lens_model_name(model), left);
    } else if (choice.beyond_right_angle_rad == 0) {
      others += fmt::format("{}{} {}", others.empty() ? "" : ", ", lens_model_name(model), left);
    }
  }
  return fmt::format("{} rms in held-out views; {}", taken, others);
}

}  // namespace vlp
