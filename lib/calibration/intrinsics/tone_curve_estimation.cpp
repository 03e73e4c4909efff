// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/tone_curve_estimation.h"

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
BoardDetection correct_corners(const BoardDetection& seen, std::size_t curve) {
  BoardDetection corrected;
  for (const TagDetection& tag : seen.tags) {
    if (curve == 0 || tag.tone_curve_fits.empty()) {
      corrected.tags.push_back(
          {tag.id, tag.corners_px, tag.curvatures, tag.corner_sds_px, {}, tag.steps});
      continue;
    }
    const auto& [corners_px, curvatures, corner_sds_px, steps] = tag.tone_curve_fits[curve - 1];
    corrected.tags.push_back({tag.id, corners_px, curvatures, corner_sds_px, {}, steps});
  }
  return corrected;
}

/// Returns at most 24 views with enough corners, evenly spaced among all of them.
std::vector<const BoardDetection*> select_detections(const std::vector<BoardView>& views,
                                                     const BoardLattice& lattice) {
  constexpr std::size_t max_views = 24;
  std::vector<const BoardDetection*> sufficient;
  for (const BoardView& view : views) {
    if (lattice.can_determine_pose(view.detection)) sufficient.push_back(&view.detection);
  }
  if (sufficient.size() <= max_views) return sufficient;
  std::vector<const BoardDetection*> selected;
  for (std::size_t i = 0; i < max_views; ++i)
    selected.push_back(sufficient[i * sufficient.size() / max_views]);
  return selected;
}

/// Returns the median standard deviation of the corners from pixel noise; std::nullopt if unknown.
std::optional<double> compute_median_sd_px(const IntrinsicsInput& input) {
  std::vector<double> known_sds_px;
  for (const auto& view : input.views) {
    for (const auto& corner : view) {
      if (corner.sd_px > 0) known_sds_px.push_back(corner.sd_px);
    }
  }
  if (known_sds_px.empty()) return {};
  return upper_median(std::move(known_sds_px));
}

/// Returns the RMS residual of the lens for each curve, divided by the noise of the corners;
/// std::nullopt if no lens is found.
std::optional<ValuesPerGamma> compare_gammas(const std::vector<BoardView>& views,
                                             const Board& board) {
  constexpr double exact_px = 1e-6;
  IntrinsicsInput input{BoardLattice(board), {}, views.front().imager_px, LensModel::opencv8};
  auto selected = select_detections(views, input.lattice);
  ValuesPerGamma ratios{};
  for (std::size_t curve = 0; curve < ratios.size(); ++curve) {
    input.views.clear();
    for (const BoardDetection* seen : selected) {
      input.views.push_back(input.lattice.list_corners(correct_corners(*seen, curve)));
    }
    const IntrinsicsSolution solution =
        curve == 0 ? solve_opencv8_or_fisheye(InitialSolutions(input)) : solve_intrinsics(input);
    const auto noise_px = compute_median_sd_px(input);
    if (!solution.has_succeeded() || !noise_px) return {};
    ratios[curve] = std::max(solution.rms_px, exact_px) / *noise_px;
    if (curve > 0) continue;
    // The other curves are solved with the same model, warp and views, so that ratios are
    // comparable.
    input.lens_model = solution.problem.lens_model;
    input.warp = solution.solved_parameters.warp ? WarpChoice::on : WarpChoice::off;
    std::vector<const BoardDetection*> kept;
    for (const std::size_t view : solution.views) kept.push_back(selected[view]);
    selected = std::move(kept);
  }
  return ratios;
}

bool has_gray_level_costs(const BoardView& view) { return !view.detection.curve_costs.empty(); }

bool may_have_tone_curve(const BoardView& view) {
  return std::ranges::any_of(view.detection.tags,
                             [](const TagDetection& tag) { return !tag.tone_curve_fits.empty(); });
}

}  // namespace

double correct_tone_curve(std::vector<BoardView>& views, const Board& board) {
  constexpr double levels_sd = 0.2, residuals = 50;
  const ValuesPerGamma level_costs = sum_tone_curve_costs(views);
  const bool has_no_curve = 2 * std::ranges::count_if(views, may_have_tone_curve) <=
                            std::ranges::count_if(views, has_gray_level_costs);
  if (has_no_curve || !check_board_layout(board, views, {}).problem.empty())
    return correct_views_for_tone_curve(views, level_costs);
  const auto ratios = compare_gammas(views, board);
  if (!ratios) return correct_views_for_tone_curve(views, level_costs);
  const double levels_gamma = estimate_gamma(level_costs);
  const double n = residuals / *std::ranges::min_element(*ratios);
  ValuesPerGamma costs{};
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const double off = std::log(kGammas[i] / levels_gamma) / levels_sd;
    costs[i] = n * std::log((*ratios)[i]) + off * off / 2;
  }
  return correct_views_for_tone_curve(views, costs);
}

}  // namespace vlp
