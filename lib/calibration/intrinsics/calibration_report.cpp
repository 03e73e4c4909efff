// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/calibration_report.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/edge_corrections.h"
#include "calibration/intrinsics/image_coverage.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "camera/spline_grid.h"
#include "geometry/polygon.h"

namespace vlp {

namespace {

/// Computes the uncertainty over the image: mean and maximum in the region, maximum outside.
void add_uncertainty(const ProjectionUncertainty& uncertainty, const Lens& lens,
                     const std::array<int, 2>& imager_px, CalibrationReport& report) {
  double inside = 0;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(imager_px)) {
    // A fisheye or a spline may end beyond the farthest corner and has no rays there.
    const bool can_end =
        lens.lens_model() == LensModel::fisheye || is_splined_lens_model(lens.lens_model());
    if (can_end && !lens.unproject_pixel(pixel)) continue;
    const double sigma_px = uncertainty.worst_direction_sd_px(pixel);
    if (!polygon_contains(report.region, pixel)) {
      report.uncertainty_beyond_px = std::max(report.uncertainty_beyond_px, sigma_px);
      continue;
    }
    ++inside;
    report.uncertainty_mean_px += sigma_px;
    report.uncertainty_worst_px = std::max(report.uncertainty_worst_px, sigma_px);
  }
  report.uncertainty_mean_px /= std::max(inside, 1.0);
}

/// Compares the lenses of the even and the odd views; std::nullopt if one of them is not
/// determined.
std::optional<ProjectionDifference> compare_view_halves(const IntrinsicsSolution& solution,
                                                        const IntrinsicsInput& input,
                                                        const ProjectionUncertainty& uncertainty,
                                                        const ImageRegion& region) {
  const IntrinsicsSolution even = solve_half_of_views(solution, 0);
  const IntrinsicsSolution odd = solve_half_of_views(solution, 1);
  if (!even.has_succeeded() || !odd.has_succeeded()) return std::nullopt;
  // Half of the views may not determine all parts of a splined lens.
  std::vector<ProjectionUncertainty> halves;
  if (is_splined_lens_model(solution.fitted_lens().lens_model()))
    halves = {{even, input.lattice}, {odd, input.lattice}};
  constexpr double max_ratio = 3;  // typically sqrt(2)
  return compare_projections(
      even.fitted_lens(), odd.fitted_lens(), input.imager_px, [&](const Eigen::Vector2d& pixel) {
        const double sigma_px = uncertainty.worst_direction_sd_px(pixel);
        const bool is_determined =
            polygon_contains(region, pixel) &&
            std::ranges::none_of(halves, [&](const ProjectionUncertainty& half) {
              return half.worst_direction_sd_px(pixel) > max_ratio * sigma_px;
            });
        return is_determined ? sigma_px : std::numeric_limits<double>::infinity();
      });
}

}  // namespace

CalibrationReport make_lens_report(const IntrinsicsSolution& solution,
                                   const IntrinsicsInput& input) {
  return make_lens_report(solution, input,
                          ProjectionUncertainty::compare_corners_and_tags(solution, input.lattice),
                          make_valid_region(list_inlier_pixels(solution.problem), input.imager_px,
                                            solution.fitted_lens()));
}

CalibrationReport make_lens_report(const IntrinsicsSolution& solution, const IntrinsicsInput& input,
                                   const ProjectionUncertainty::ByCornersAndByTags& uncertainties,
                                   ImageRegion region) {
  const auto& [independent, uncertainty] = uncertainties;
  const Lens lens = solution.fitted_lens();
  const Eigen::MatrixXd by_views = jackknife_covariance(solution);
  // Splines are undetermined outside the region.
  const ImageRegion compared = is_splined_lens_model(lens.lens_model()) ? region : ImageRegion();
  const auto expected =
      predict_difference(lens, input.imager_px, uncertainty.intrinsics_covariance(), compared);
  const double region_fraction = compute_area_fraction(region, input.imager_px);
  CalibrationReport report{std::move(region),
                           region_fraction,
                           0,
                           0,
                           0,
                           uncertainty.focal_x_sd_px(),
                           std::sqrt(by_views(0, 0)),
                           expected.rms_px,
                           predict_difference(lens, input.imager_px, by_views, compared).rms_px,
                           {}};
  add_uncertainty(uncertainty, lens, input.imager_px, report);
  if (!is_splined_lens_model(lens.lens_model())) {
    // With few views each of these covariances may be too small by chance.
    for (const Eigen::MatrixXd& covariance :
         {uncertainty.intrinsics_covariance(), independent.intrinsics_covariance(), by_views}) {
      if (!covariance.allFinite()) continue;
      report.uncertainty_worst_px =
          std::max(report.uncertainty_worst_px,
                   predict_max_difference_px(lens, input.imager_px, covariance, report.region));
    }
  }
  report.split_half_difference = compare_view_halves(solution, input, uncertainty, report.region);
  return report;
}

std::vector<double> compute_held_out_rms_px(const IntrinsicsSolution& solution,
                                            const IntrinsicsInput& held_out) {
  const Lens lens = solution.fitted_lens();
  auto views = held_out.views;
  for (auto& view : views) {
    correct_curvature(view, lens);
    view = held_out.lattice.apply_warp(std::move(view), solution.problem.warp_m);
  }
  const auto shifts = fit_displacements(views, lens);
  std::vector<double> rms_px;
  for (std::size_t i = 0; i < views.size(); ++i) {
    correct_displacement(views[i], shifts[i]);
    const auto pose = estimate_view_pose(views[i], lens);
    rms_px.push_back(pose ? pose->rms_px : std::numeric_limits<double>::infinity());
  }
  return rms_px;
}

HeldOutFit fit_held_out_views(const IntrinsicsSolution& solution, const IntrinsicsInput& held_out) {
  HeldOutFit fit;
  double squares = 0;
  const auto rms_px = compute_held_out_rms_px(solution, held_out);
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

ViewCoverage measure_view_coverage(const IntrinsicsSolution& solution,
                                   const IntrinsicsInput& input) {
  const auto [width, height] = input.imager_px;
  ViewCoverage coverage;
  ImageCoverage parts(input.imager_px);
  for (const std::size_t view : solution.views) {
    for (const auto& corner : input.views[view]) {
      const double u = corner.pixel.x(), v = corner.pixel.y();
      ++coverage.corners[static_cast<std::size_t>(ImageCoverage::cell_index(v, height, 3) * 3 +
                                                  ImageCoverage::cell_index(u, width, 3))];
      parts.add_corner(corner.pixel);
    }
  }
  coverage.covered_fraction = parts.covered_fraction();
  std::vector<Eigen::Vector3d> normals;
  for (const BoardPose& pose : solution.problem.poses) {
    // Points away from the camera; the board is nearer on the side to which it is tilted.
    const Eigen::Vector3d normal =
        Eigen::AngleAxisd(pose.rotation.norm(), pose.rotation.normalized()) *
        Eigen::Vector3d::UnitZ();
    for (const Eigen::Vector3d& other : normals) {
      coverage.tilt_rad =
          std::max(coverage.tilt_rad, std::atan2(normal.cross(other).norm(), normal.dot(other)));
    }
    normals.push_back(normal);
    const double x_rad = std::atan2(normal.x(), normal.z());
    const double y_rad = std::atan2(normal.y(), normal.z());
    auto& [left, right, upper, lower] = coverage.tilts_rad;
    left = std::max(left, -x_rad);
    right = std::max(right, x_rad);
    upper = std::max(upper, -y_rad);
    lower = std::max(lower, y_rad);
  }
  return coverage;
}

std::string recommend_next_view(const ViewCoverage& coverage) {
  constexpr std::array places{"top left",    "top middle",    "top right",
                              "left middle", "middle",        "right middle",
                              "bottom left", "bottom middle", "bottom right"};
  constexpr std::array sides{"left", "right", "upper", "lower"};
  const auto place = std::min_element(coverage.corners.begin(), coverage.corners.end());
  const auto side = std::min_element(coverage.tilts_rad.begin(), coverage.tilts_rad.end());
  return std::string("the board in the ") +
         places[static_cast<std::size_t>(place - coverage.corners.begin())] +
         " of the image, its " +
         sides[static_cast<std::size_t>(side - coverage.tilts_rad.begin())] +
         " side 30 to 40 degrees nearer to the camera";
}

}  // namespace vlp
