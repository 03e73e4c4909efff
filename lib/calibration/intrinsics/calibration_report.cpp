// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/calibration_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calibration/intrinsics/edge_shift.h"
#include "calibration/intrinsics/expected_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "calibration/intrinsics/view_pose.h"
#include "camera/spline_grid.h"

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
  ImageRegion region = known_region(seen_px(solution.problem), input.imager_px, lens.model());
  // Beyond it splines are anything.
  const ImageRegion compared = is_splined(lens.model()) ? region : ImageRegion();
  const auto expected =
      expected_difference(lens, input.imager_px, uncertainty.intrinsics_covariance(), compared);
  const double region_share = share_of_image(region, input.imager_px);
  CalibrationReport report{std::move(region),
                           region_share,
                           0,
                           0,
                           {0, 0},
                           0,
                           uncertainty.focal_sd_px(),
                           std::sqrt(by_views(0, 0)),
                           expected.rms_px,
                           expected_difference(lens, input.imager_px, by_views, compared).rms_px,
                           {}};
  double inside = 0;
  for (const Eigen::Vector2d& pixel : pixel_grid(input.imager_px)) {
    // Beyond the farthest corner a fisheye may end, as splines do; there they refuse pixels.
    const bool ends = lens.model() == LensModel::fisheye || is_splined(lens.model());
    if (ends && !lens.unproject(pixel)) continue;
    const double sigma_px = uncertainty.worst_px(pixel);
    if (!lies_in(report.region, pixel)) {
      report.uncertainty_beyond_px = std::max(report.uncertainty_beyond_px, sigma_px);
      continue;
    }
    ++inside;
    report.uncertainty_mean_px += sigma_px;
    if (sigma_px <= report.uncertainty_worst_px) continue;
    report.uncertainty_worst_px = sigma_px;
    report.uncertainty_worst_at = pixel;
  }
  report.uncertainty_mean_px /= std::max(inside, 1.0);
  const IntrinsicsSolution even = solve_intrinsics(every_other(solution, input, 0));
  const IntrinsicsSolution odd = solve_intrinsics(every_other(solution, input, 1));
  if (!even.ok() || !odd.ok()) return report;
  // Of a splined lens, half of the views leave holes, which tell nothing of it.
  std::vector<ProjectionUncertainty> halves;
  if (is_splined(lens.model())) halves = {ProjectionUncertainty(even), ProjectionUncertainty(odd)};
  constexpr double hole = 3;  // sqrt(2) is usual
  report.halves = projection_difference(
      even.lens(), odd.lens(), input.imager_px, [&](const Eigen::Vector2d& pixel) {
        const double sigma_px = uncertainty.worst_px(pixel);
        const bool told = lies_in(report.region, pixel) &&
                          std::ranges::none_of(halves, [&](const ProjectionUncertainty& half) {
                            return half.worst_px(pixel) > hole * sigma_px;
                          });
        return told ? sigma_px : std::numeric_limits<double>::infinity();
      });
  return report;
}

std::vector<double> held_out_rms_px(const IntrinsicsSolution& solution,
                                    const IntrinsicsInput& held_out) {
  const Lens lens = solution.lens();
  auto views = held_out.views;
  for (auto& view : views) {
    view = held_out.lattice.bent(std::move(view), solution.problem.warp_m);
  }
  const auto shifts = edge_shifts(views, lens);
  std::vector<double> rms_px;
  for (std::size_t i = 0; i < views.size(); ++i) {
    take_out_shift(views[i], shifts[i]);
    const auto pose = view_pose(views[i], lens);
    rms_px.push_back(pose ? pose->rms_px : std::numeric_limits<double>::infinity());
  }
  return rms_px;
}

HeldOut held_out_fit(const IntrinsicsSolution& solution, const IntrinsicsInput& held_out) {
  HeldOut fit;
  double squares = 0;
  const auto rms_px = held_out_rms_px(solution, held_out);
  for (std::size_t i = 0; i < rms_px.size(); ++i) {
    if (!std::isfinite(rms_px[i])) continue;
    const std::size_t corners = held_out.views[i].size();
    ++fit.views;
    fit.corners += static_cast<int>(corners);
    squares += rms_px[i] * rms_px[i] * 2 * static_cast<double>(corners);
  }
  if (fit.corners > 0) fit.rms_px = std::sqrt(squares / (2 * fit.corners));
  return fit;
}

}  // namespace vlp
