// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include "calibration/plots/calibration_plots.h"
#include "calibration/rotation/turning_axis.h"
#include "geometry/angles.h"
#include "positioning/positioner.h"
#include "rig/stage.h"
#include "station/known_places.h"
#include "station/unit_stages.h"

namespace vlp {
namespace {

constexpr double kMillimetres = 1e3;

/// The lower median. Precondition: not empty.
double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<StationCapture> at_station(const StationConfig& config,
                                       const std::vector<Frame>& frames,
                                       const CapturesTable& places) {
  std::vector<StationCapture> captures;
  for (const Frame& frame : frames) {
    const auto entry = places.find(frame.image);
    const Capture known = entry == places.end() ? Capture{} : entry->second;
    if (known.x_m && known.y_m) {
      captures.push_back({frame.detections, {*known.x_m, *known.y_m}, known.inclination});
    } else if (config.dispersion_station_m) {
      captures.push_back({frame.detections, *config.dispersion_station_m, known.inclination});
    }
  }
  return captures;
}

}  // namespace

StageResult solve_rotation(const StationConfig& config, const Calibration& calibration,
                           const std::vector<Frame>& frames) {
  const Camera& camera = calibration.camera;
  const SpotCaptures spot = spot_captures(frames, config.lamps, camera);
  if (spot.status != SpotStatus::ok) {
    return {"the turn on the spot: " + std::string(explanation_of(spot.status))};
  }
  const RotationFit fit = fit_turning_axis(spot, camera);
  if (!fit.converged) return {"the turn on the spot: no rotation centre fits the captures"};
  const CircleCenters circles = fit_circle_centers(spot, camera);
  StageResult result{"", with_rotation_center(calibration, fit.center, {})};
  result.values = {{"rotation_px", fit.residual_px},
                   {"rotation_spread_px", circles.spread_px},
                   {"tilt_deg", deg_from_rad(tilt_of(fit.center).angle_rad)}};
  if (const auto& covariance = fit.center.covariance) {
    result.values.push_back({"rotation_sd_px", std::sqrt(covariance->trace())});
  }
  if (const auto& arm_m = fit.center.lever_arm_m) {
    result.values.push_back({"lever_arm_mm", kMillimetres * arm_m->norm()});
  }
  result.drawing = [spot, circles, fit, camera] {
    return drawing_of(plot_of(camera.id, spot, circles, fit, camera));
  };
  return result;
}

StageResult solve_dispersion(const StationConfig& config, const Calibration& calibration,
                             const std::vector<Frame>& frames, const CapturesTable& places) {
  const auto captures = at_station(config, frames, places);
  std::string problem =
      places_problem(captures.size(), frames.size(), config.enough.dispersion_captures);
  if (!problem.empty()) return {std::move(problem)};
  const DispersionFit fit =
      fit_dispersion(captures, config.lamps, calibration, DispersionMethod::camera);
  if (fit.status != DispersionStatus::ok) {
    return {"the fixes at the station: " + std::string(explanation_of(fit.status))};
  }
  StageResult result{"", with_dispersion(calibration, fit.dispersion, {})};
  result.values = {{"dispersion_mm", kMillimetres * fit.dispersion.radius_m},
                   {"dispersion_offset_px", fit.dispersion.offset_px.norm()}};
  if (const auto& world_m = fit.world_offset_m) {
    result.values.push_back({"world_mm", kMillimetres * world_m->norm()});
  }
  result.drawing = [fit] { return drawing_of(plot_of("Fixes at a known station", fit)); };
  return result;
}

StageResult check_fixes(const StationConfig& config, const Calibration& calibration,
                        const std::vector<Frame>& frames, const CapturesTable& places) {
  const Positioner positioner(config.lamps, calibration);
  int captures = 0, lamps = 0, fitting = 0;
  std::set<int> seen;
  std::vector<double> errors_mm, residuals_px;
  Eigen::Vector2d sum_mm = Eigen::Vector2d::Zero();
  for (const Frame& frame : frames) {
    const auto entry = places.find(frame.image);
    if (entry == places.end() || !entry->second.x_m || !entry->second.y_m) continue;
    ++captures;
    Sensors sensors;
    sensors.inclination = entry->second.inclination;
    const Fix fix = positioner.locate(frame.detections, sensors);
    lamps += static_cast<int>(frame.detections.size());
    for (const Detection& detection : frame.detections) seen.insert(detection.lamp);
    if (!fix.ok()) continue;
    fitting += fix.lamps;
    const Eigen::Vector2d known_m(*entry->second.x_m, *entry->second.y_m);
    const Eigen::Vector2d error_mm =
        kMillimetres * (fix.estimate.pose.position_m.head<2>() - known_m);
    errors_mm.push_back(error_mm.norm());
    if (fix.lamps > 2) residuals_px.push_back(fix.residual_px);
    sum_mm += error_mm;
  }
  std::string problem = places_problem(static_cast<std::size_t>(captures), frames.size(),
                                       config.enough.check_captures);
  if (!problem.empty()) return {std::move(problem)};
  StageResult result{"", calibration};
  const auto fixes = static_cast<double>(errors_mm.size());
  result.values = {{"check_fixes", fixes / captures},
                   {"check_lamps", lamps > 0 ? static_cast<double>(fitting) / lamps : 0},
                   {"check_lamps_seen", static_cast<double>(seen.size()) /
                                            static_cast<double>(config.lamps.lamps.size())}};
  if (errors_mm.empty()) return result;
  double mean_mm = 0;
  for (const double error_mm : errors_mm) mean_mm += error_mm / fixes;
  result.values.push_back({"check_mean_mm", mean_mm});
  result.values.push_back(
      {"check_worst_mm", *std::max_element(errors_mm.begin(), errors_mm.end())});
  result.values.push_back({"check_offset_mm", (sum_mm / fixes).norm()});
  if (!residuals_px.empty()) result.values.push_back({"check_residual_px", median(residuals_px)});
  return result;
}

}  // namespace vlp
