// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/common_curve.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/board_lattice.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_choice.h"
#include "detection/boards/tone_curve.h"
#include "geometry/median.h"

namespace vlp {
namespace {

/// Returns the detection with corners corrected for one of kGammas.
SeenBoard behind(const SeenBoard& seen, std::size_t curve) {
  SeenBoard coded;
  for (const SeenTag& tag : seen.tags) {
    if (curve == 0 || tag.behind_curves.empty()) {
      coded.tags.push_back({tag.id, tag.corners_px, tag.bows, tag.sds_px, {}, tag.steps});
      continue;
    }
    const auto& [corners_px, bows, sds_px, steps] = tag.behind_curves[curve - 1];
    coded.tags.push_back({tag.id, corners_px, bows, sds_px, {}, steps});
  }
  return coded;
}

/// Returns at most 24 views with enough corners, evenly spaced among all of them.
std::vector<const SeenBoard*> some_of(const std::vector<BoardView>& views,
                                      const BoardLattice& lattice) {
  constexpr std::size_t most = 24;
  std::vector<const SeenBoard*> enough;
  for (const BoardView& view : views) {
    if (lattice.enough(view.seen)) enough.push_back(&view.seen);
  }
  if (enough.size() <= most) return enough;
  std::vector<const SeenBoard*> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(enough[i * enough.size() / most]);
  return some;
}

/// Solves OPENCV8 and OPENCV_FISHEYE and returns the solution with the smaller residuals.
IntrinsicsSolution lens_of_either(IntrinsicsInput input) {
  auto fisheye = may_be_wide(input) ? fit_fisheye(input) : std::nullopt;
  if (fisheye && fisheye->farthest_rad >= kRightAngle_rad) return std::move(fisheye->solution);
  input.lens_model = LensModel::opencv8;
  IntrinsicsSolution solution = solve_intrinsics(input);
  const bool other = fisheye && !(solution.ok() && solution.rms_px < fisheye->solution.rms_px);
  return other ? std::move(fisheye->solution) : solution;
}

/// Returns the median standard deviation of the corners from pixel noise; std::nullopt if unknown.
std::optional<double> told_sd_px(const IntrinsicsInput& input) {
  std::vector<double> told;
  for (const auto& view : input.views) {
    for (const auto& corner : view) {
      if (corner.sd_px > 0) told.push_back(corner.sd_px);
    }
  }
  if (told.empty()) return {};
  return upper_median(std::move(told));
}

/// Returns the RMS residual of the lens for each curve, divided by the noise of the corners;
/// std::nullopt if no lens is found.
std::optional<PerCurve> left_over_noise(const std::vector<BoardView>& views, const Board& board) {
  constexpr double exact_px = 1e-6;
  IntrinsicsInput input{BoardLattice(board), {}, views.front().imager_px, LensModel::opencv8};
  auto some = some_of(views, input.lattice);
  PerCurve ratios{};
  for (std::size_t curve = 0; curve < ratios.size(); ++curve) {
    input.views.clear();
    for (const SeenBoard* seen : some) {
      input.views.push_back(input.lattice.corners(behind(*seen, curve)));
    }
    const IntrinsicsSolution solution =
        curve == 0 ? lens_of_either(input) : solve_intrinsics(input);
    const auto noise_px = told_sd_px(input);
    if (!solution.ok() || !noise_px) return {};
    ratios[curve] = std::max(solution.rms_px, exact_px) / *noise_px;
    if (curve > 0) continue;
    // The other curves are solved with the same model, warp and views, so that ratios are
    // comparable.
    input.lens_model = solution.problem.lens_model;
    input.warp = solution.solved_for.warp ? WarpChoice::on : WarpChoice::off;
    std::vector<const SeenBoard*> kept;
    for (const std::size_t view : solution.views) kept.push_back(some[view]);
    some = std::move(kept);
  }
  return ratios;
}

bool tells_levels(const BoardView& view) { return !view.seen.curve_costs.empty(); }

bool may_have_curve(const BoardView& view) {
  return std::ranges::any_of(view.seen.tags,
                             [](const SeenTag& tag) { return !tag.behind_curves.empty(); });
}

}  // namespace

double take_common_curve(std::vector<BoardView>& views, const Board& board) {
  constexpr double levels_sd = 0.2, residuals = 50;
  const PerCurve by_levels = costs_of_levels(views);
  const bool plain = 2 * std::ranges::count_if(views, may_have_curve) <=
                     std::ranges::count_if(views, tells_levels);
  if (plain || !check_board(board, views, {}).problem.empty()) return take_curve(views, by_levels);
  const auto ratios = left_over_noise(views, board);
  if (!ratios) return take_curve(views, by_levels);
  const double levels_gamma = gamma_of(by_levels);
  const double n = residuals / *std::ranges::min_element(*ratios);
  PerCurve costs{};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const double off = std::log(kGammas[i] / levels_gamma) / levels_sd;
    costs[i] = n * std::log((*ratios)[i]) + off * off / 2;
  }
  return take_curve(views, costs);
}

}  // namespace vlp
