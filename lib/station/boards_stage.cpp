// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>

#include <cmath>

#include "calibration/intrinsics/board_check.h"
#include "calibration/intrinsics/calibration_report.h"
#include "calibration/plots/calibration_plots.h"
#include "rig/stage.h"
#include "station/unit_stages.h"

namespace vlp {
namespace {

IntrinsicsReport report_of(const IntrinsicsSolution& solution, const IntrinsicsInput& input,
                           const CalibrationReport& report) {
  const Eigen::Vector2d warp_m =
      solution.problem.warp_m.cwiseProduct(input.lattice.warp_of_board());
  // Infinite where the lens sees no ray.
  const bool known = std::isfinite(report.uncertainty_worst_px);
  return {static_cast<int>(solution.views.size()),
          solution.corners,
          solution.outliers,
          solution.rms_px,
          std::array{warp_m.x(), warp_m.y()},
          known ? std::optional(report.uncertainty_worst_px) : std::nullopt};
}

/// How far the lens is from the nominal one.
void compare(const StationConfig& config, const IntrinsicsSolution& solution,
             std::vector<NamedValue>& values) {
  constexpr double percent = 100;
  const auto& found = solution.problem.intrinsics;
  const auto& nominal = config.type.intrinsics;
  const double focal =
      std::max(std::abs(found[0] / nominal[0] - 1), std::abs(found[1] / nominal[1] - 1));
  values.push_back({"focal_percent", percent * focal});
  values.push_back({"center_px", std::hypot(found[2] - nominal[2], found[3] - nominal[3])});
  const Lens type(config.type.lens_model, nominal);
  const auto difference = projection_difference(solution.lens(), type, config.type.imager_px,
                                                [](const Eigen::Vector2d&) { return 1.0; });
  if (difference) values.push_back({"nominal_px", difference->worst_px});
}

}  // namespace

StageResult solve_boards(const StationConfig& config, const std::string& camera_id,
                         const std::vector<BoardView>& views) {
  const BoardCheck layout = check_board(config.board, views, {});
  if (!layout.problem.empty()) return {"wrong board: " + layout.problem};
  IntrinsicsInput input{
      BoardLattice(config.board), {}, config.type.imager_px, config.type.lens_model};
  for (const BoardView& view : views) {
    if (input.lattice.enough(view.seen)) input.views.push_back(input.lattice.corners(view.seen));
  }
  const IntrinsicsSolution solution = solve_intrinsics(input);
  if (!solution.ok()) {
    return {fmt::format("{} views of the board: {}", input.views.size(),
                        explanation_of(solution.status))};
  }
  const BoardCheck exact = check_board(config.board, views, solution.lens());
  if (!exact.problem.empty()) return {"wrong board: " + exact.problem};
  const CalibrationReport report = report_on(solution, input);
  const ViewCoverage coverage = coverage_of(solution, input);
  StageResult result{""};
  Camera camera = config.type;
  camera.id = camera_id;
  camera.intrinsics = solution.problem.intrinsics;
  result.calibration = with_camera(camera, report_of(solution, input, report), {});
  result.values = {{"rms_px", solution.rms_px},
                   {"uncertainty_px", report.uncertainty_worst_px},
                   {"coverage", coverage.share}};
  if (report.halves) result.values.push_back({"halves_px", report.halves->rms_px});
  compare(config, solution, result.values);
  result.drawing = [solution,
                    title = camera_id + ", " + std::string(name_of(config.type.lens_model))] {
    return drawing_of(plot_of(title, solution));
  };
  return result;
}

}  // namespace vlp
