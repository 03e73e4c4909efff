// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/calibration_report.h"

#include <cmath>

#include "calibration/intrinsics/expected_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "calibration/intrinsics/view_pose.h"

namespace vlp {
namespace {

IntrinsicsInput every_other(const IntrinsicsSolution& solution, const IntrinsicsInput& input,
                            std::size_t first) {
  IntrinsicsInput half = input;
  half.views.clear();
  for (std::size_t i = first; i < solution.views.size(); i += 2) {
    half.views.push_back(input.views[solution.views[i]]);
  }
  return half;
}

}  // namespace

CalibrationReport report_on(const IntrinsicsSolution& solution, const IntrinsicsInput& input) {
  const ProjectionUncertainty uncertainty(solution);
  const Lens lens = solution.lens();
  const Eigen::MatrixXd by_views = covariance_by_views(solution);
  const auto expected =
      expected_difference(lens, input.imager_px, uncertainty.intrinsics_covariance());
  CalibrationReport report{0,
                           0,
                           {0, 0},
                           uncertainty.focal_sd_px(),
                           std::sqrt(by_views(0, 0)),
                           expected.rms_px,
                           expected_difference(lens, input.imager_px, by_views).rms_px,
                           {}};
  const auto pixels = pixel_grid(input.imager_px);
  for (const Eigen::Vector2d& pixel : pixels) {
    const double sigma_px = uncertainty.worst_px(pixel);
    report.uncertainty_mean_px += sigma_px / static_cast<double>(pixels.size());
    if (sigma_px <= report.uncertainty_worst_px) continue;
    report.uncertainty_worst_px = sigma_px;
    report.uncertainty_worst_at = pixel;
  }
  const IntrinsicsSolution even = solve_intrinsics(every_other(solution, input, 0));
  const IntrinsicsSolution odd = solve_intrinsics(every_other(solution, input, 1));
  if (even.ok() && odd.ok()) {
    report.halves = projection_difference(
        even.lens(), odd.lens(), input.imager_px,
        [&](const Eigen::Vector2d& pixel) { return uncertainty.worst_px(pixel); });
  }
  return report;
}

HeldOut held_out_fit(const IntrinsicsSolution& solution, const IntrinsicsInput& held_out) {
  const Lens lens = solution.lens();
  HeldOut fit;
  double squares = 0;
  for (const auto& view : held_out.views) {
    const auto corners = held_out.lattice.bent(view, solution.problem.warp_m);
    const auto pose = view_pose(corners, lens);
    if (!pose) continue;
    ++fit.views;
    fit.corners += static_cast<int>(corners.size());
    squares += pose->rms_px * pose->rms_px * 2 * static_cast<double>(corners.size());
  }
  if (fit.corners > 0) fit.rms_px = std::sqrt(squares / (2 * fit.corners));
  return fit;
}

}  // namespace vlp
