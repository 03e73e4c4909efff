// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/calibration_plots.h"

#include <Eigen/Geometry>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/projection_uncertainty.h"

namespace vlp {

IntrinsicsPlot make_plot(const std::string& title, const IntrinsicsSolution& solution,
                         const BoardLattice& lattice,
                         const std::optional<LensSharpness>& sharpness) {
  const BoardProblem& problem = solution.problem;
  IntrinsicsPlot plot{title, problem.imager_px, {}, 0, {}};
  const auto residuals_px = compute_residuals(problem);
  for (std::size_t i = 0; i < residuals_px.size(); ++i) {
    if (!residuals_px[i].allFinite()) continue;
    const Eigen::Vector3d& point = problem.points[i];
    plot.corners.push_back({point.head<2>(), residuals_px[i], point.z() <= 0});
  }
  const ProjectionUncertainty uncertainty(solution, lattice);
  for (const Eigen::Vector2d& pixel : make_pixel_grid(problem.imager_px)) {
    if (pixel.y() == 0) ++plot.cols;
    plot.sd_px.push_back(uncertainty.worst_px(pixel));
  }
  if (sharpness) {
    plot.mtf50_cols = sharpness->mtf50.cols;
    plot.mtf50 = sharpness->mtf50.values;
  }
  return plot;
}

RotationPlot make_plot(const std::string& title, const RotationCaptures& spot,
                       const CircleCenters& circles, const RotationFit& fit, const Camera& camera) {
  RotationPlot plot{
      title, {}, fit.center.center_px, undistorted_pixel(camera, Eigen::Vector2d::Zero())};
  for (const auto& [lamp, height, circle] : circles.circles) {
    const Eigen::Vector2d radii_px = camera.focal_px();
    plot.traces.push_back({spot.lamps[lamp].id,
                           {},
                           undistorted_pixel(camera, circle.circle.center),
                           circle.circle.radius * radii_px});
    for (const RotationObservation& observation : spot.observations) {
      if (observation.lamp != lamp || spot.captures[observation.capture].height != height) continue;
      plot.traces.back().places_px.push_back(
          undistorted_pixel(camera, observation.ray.hnormalized()));
    }
  }
  return plot;
}

DispersionPlot make_plot(const std::string& title, const DispersionFit& fit) {
  DispersionPlot plot{title, {{}, fit.before}, {{}, fit.after}, {}};
  for (const auto& fix : fit.fixes) {
    if (fix.used) {
      plot.before.errors_m.push_back(fix.before_m);
      plot.after.errors_m.push_back(fix.after_m);
    } else {
      plot.outliers_m.push_back(fix.before_m);
    }
  }
  return plot;
}

}  // namespace vlp
