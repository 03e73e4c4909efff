// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/reference_point_fixes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <set>
#include <span>

#include "calibration/dispersion/offset_separation.h"
#include "geometry/angles.h"
#include "geometry/median.h"
#include "geometry/robust_scatter.h"
#include "geometry/statistical_bounds.h"
#include "positioning/positioner.h"
#include "rig/calibration_builder.h"
#include "rig/find_lamp.h"

namespace vlp {

namespace {

/// Returns the mean height of the detected lamps, in the world.
double compute_lamp_height(const ReferencePointCapture& capture, const LampMap& map) {
  double sum_m = 0;
  int count = 0;
  for (const Detection& detection : capture.detections) {
    const Lamp* lamp = find_lamp_by_id(map.lamps, detection.lamp);
    if (lamp == nullptr) continue;
    sum_m += lamp->position_m.z();
    ++count;
  }
  return sum_m / count;
}

bool is_rejected(const Fix& fix, int lamp) {
  const auto count =
      std::min(static_cast<std::size_t>(fix.rejected_lamps), fix.rejected_ids.size());
  return std::ranges::count(std::span(fix.rejected_ids).first(count), lamp) > 0;
}

/// Makes a positioner whose fixes have the covariance of the stated noise alone.
Positioner make_unchecked_positioner(LampMap map, const Calibration& geometry) {
  for (Lamp& lamp : map.lamps) lamp.sd_m.reset();
  PositionerOptions options;
  options.checks_residuals = false;
  return Positioner(map, geometry, options);
}

Fix locate_camera_of_capture(const Positioner& positioner, const ReferencePointCapture& capture) {
  Sensors sensors;
  sensors.inclination = capture.inclination;
  return positioner.compute_position_fix(capture.detections, sensors);
}

}  // namespace

Eigen::MatrixXd LampDerivatives::scale_by_lamp_sds() const {
  Eigen::MatrixXd moves = jacobian_wrt_positions;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    moves.middleCols<3>(3 * static_cast<Eigen::Index>(i)) *= *lamps[i].sd_m;
  }
  return moves;
}

ReferencePointFixes::ReferencePointFixes(std::span<const ReferencePointCapture> captures,
                                         const LampMap& map, const Calibration& calibration)
    : captures_(captures), map_(map), calibration_(extract_geometry(calibration)) {}

FixStatus remove_outlier_lamps(std::vector<ReferencePointCapture>& captures, const LampMap& map,
                               const Calibration& calibration) {
  FixStatus first_failure = FixStatus::ok;
  const Positioner positioner(map, remove_dispersion(calibration));
  for (ReferencePointCapture& capture : captures) {
    const Fix fix = locate_camera_of_capture(positioner, capture);
    if (fix.has_succeeded()) {
      std::erase_if(capture.detections,
                    [&](const Detection& detection) { return is_rejected(fix, detection.lamp); });
    } else if (first_failure == FixStatus::ok) {
      first_failure = fix.status;
    }
  }
  return first_failure;
}

bool scale_contradicted_noise(std::vector<ReferencePointCapture>& captures, const LampMap& map,
                              Calibration calibration, const Eigen::Vector2d& offset_px) {
  calibration.dispersion = Dispersion{offset_px, 0, {0, 0}, 1};
  const Positioner positioner(map, calibration);
  const Positioner unchecked = make_unchecked_positioner(map, calibration);
  bool has_changed = false;
  for (ReferencePointCapture& capture : captures) {
    const Fix fix = locate_camera_of_capture(positioner, capture),
              stated = locate_camera_of_capture(unchecked, capture);
    if (!fix.has_succeeded() || !stated.has_succeeded() || fix.lamps != stated.lamps) continue;
    const double factor = std::sqrt(fix.noise_covariance.trace() / stated.noise_covariance.trace());
    constexpr double rounding = 1e-6;
    if (!(factor > 1 + rounding)) continue;
    for (Detection& detection : capture.detections) {
      if (detection.sigma_px) *detection.sigma_px *= factor;
    }
    has_changed = true;
  }
  return has_changed;
}

std::vector<std::optional<ReferencePointFixes::Estimate>> ReferencePointFixes::locate_with_offset(
    const Eigen::Vector2d& offset_px) const {
  return locate_with_offset(offset_px, map_);
}

std::vector<std::optional<ReferencePointFixes::Estimate>> ReferencePointFixes::locate_with_offset(
    const Eigen::Vector2d& offset_px, const LampMap& map) const {
  Calibration calibration = calibration_;
  calibration.dispersion = Dispersion{offset_px, 0, {0, 0}, 1};
  const Positioner positioner = make_unchecked_positioner(map, calibration);
  std::vector<std::optional<Estimate>> fixes(captures_.size());
  for (std::size_t i = 0; i < captures_.size(); ++i) {
    const Fix fix = locate_camera_of_capture(positioner, captures_[i]);
    if (!fix.has_succeeded()) continue;
    const Pose& pose = fix.state.pose;
    fixes[i] = Estimate{pose.position_m.head<2>() - captures_[i].reference_point_m,
                        fix.noise_covariance.topLeftCorner<2, 2>(),
                        pose.yaw_rad,
                        compute_lamp_height(captures_[i], map) - pose.position_m.z(),
                        fix.residual_px * fix.residual_px * fix.lamps,
                        2 * fix.lamps - 4};
  }
  return fixes;
}

LampDerivatives ReferencePointFixes::differentiate_by_lamps(
    const Eigen::Vector2d& offset_px) const {
  std::set<int> detected;
  for (const ReferencePointCapture& capture : captures_) {
    for (const Detection& detection : capture.detections) detected.insert(detection.lamp);
  }
  LampDerivatives derivatives;
  std::vector<std::size_t> uncertain;
  for (std::size_t i = 0; i < map_.lamps.size(); ++i) {
    const Lamp& lamp = map_.lamps[i];
    if (lamp.sd_m.value_or(0) > 0 && detected.contains(lamp.id)) uncertain.push_back(i);
  }
  derivatives.lamps.reserve(uncertain.size());
  for (const std::size_t lamp : uncertain) derivatives.lamps.push_back(map_.lamps[lamp]);
  Eigen::MatrixXd& jacobian_wrt_positions = derivatives.jacobian_wrt_positions;
  jacobian_wrt_positions =
      Eigen::MatrixXd::Zero(2 * std::ssize(captures_), 3 * std::ssize(uncertain));
  if (uncertain.empty()) return derivatives;
  const auto here = locate_with_offset(offset_px);
  LampMap moved = map_;
  for (Eigen::Index column = 0; column < jacobian_wrt_positions.cols(); ++column) {
    const std::size_t lamp = uncertain[static_cast<std::size_t>(column / 3)];
    double& coordinate_m = moved.lamps[lamp].position_m[column % 3];
    constexpr double max_step_m = 1e-4;
    const double step_m = std::min(*map_.lamps[lamp].sd_m, max_step_m);
    coordinate_m += step_m;
    const auto there = locate_with_offset(offset_px, moved);
    coordinate_m = map_.lamps[lamp].position_m[column % 3];
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (!here[i] || !there[i]) continue;
      jacobian_wrt_positions.block<2, 1>(2 * static_cast<Eigen::Index>(i), column) =
          (there[i]->error_m - here[i]->error_m) / step_m;
    }
  }
  return derivatives;
}

namespace {

constexpr double kMaxErrorFraction = 0.2;  // of the lamps' height

/// Computes the weight of residuals that contradict given noise: 0 up to the ratio that 20 % of
/// all residuals exceed, 1 from that of 5 %, linear in between.
double weight_contradiction(double ratio, double degrees_of_freedom) {
  constexpr double sigmas_of_20_percent = 0.8416, sigmas_of_5_percent = 1.6449;
  const double first =
      compute_chi_squared_bound(sigmas_of_20_percent, degrees_of_freedom) / degrees_of_freedom;
  const double last =
      compute_chi_squared_bound(sigmas_of_5_percent, degrees_of_freedom) / degrees_of_freedom;
  return std::clamp((ratio - first) / (last - first), 0.0, 1.0);
}

}  // namespace

double MeanFix::compute_yaw_variation() const {
  return std::sqrt(std::max(0.0, 1 - heading.squaredNorm()));
}

bool MeanFix::are_yaws_similar() const {
  constexpr double one_yaw_rad = rad_from_deg(10);
  return compute_yaw_variation() < std::sin(one_yaw_rad);
}

MeanFix compute_mean_fix(const OptionalFixes& fixes, const std::vector<bool>& used) {
  MeanFix mean_fix;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    mean_fix.heading += Eigen::Vector2d(std::cos(fixes[i]->yaw_rad), std::sin(fixes[i]->yaw_rad));
    mean_fix.height_m += fixes[i]->height_m;
    ++mean_fix.count;
  }
  mean_fix.heading /= mean_fix.count;
  mean_fix.height_m /= mean_fix.count;
  return mean_fix;
}

bool is_yaw_range_from_one_fix(const OptionalFixes& fixes, std::vector<bool> used) {
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!fixes[i] || !used[i]) continue;
    used[i] = false;
    if (compute_mean_fix(fixes, used).are_yaws_similar()) return true;
    used[i] = true;
  }
  return false;
}

bool are_all_fixes_far(const OptionalFixes& fixes) {
  return std::all_of(fixes.begin(), fixes.end(), [](const auto& fix) {
    return !fix || fix->error_m.norm() > kMaxErrorFraction * fix->height_m;
  });
}

double compute_variance_factor(double ratio, double degrees_of_freedom, bool noise_is_stated,
                               std::optional<double> pooled_ratio) {
  assert(degrees_of_freedom > 0);
  const double from_residuals = ratio * compute_student_factor(degrees_of_freedom);
  if (!noise_is_stated) return from_residuals;
  const double total_freedom = kGivenNoiseDegreesOfFreedom + degrees_of_freedom;
  const double combined = (kGivenNoiseDegreesOfFreedom + degrees_of_freedom * ratio) /
                          total_freedom * compute_student_factor(total_freedom);
  const double factor = std::max(1.0, combined);
  const double weight = weight_contradiction(pooled_ratio.value_or(ratio), degrees_of_freedom);
  return factor * std::pow(std::max(1.0, from_residuals / factor), weight);
}

std::vector<bool> flag_inlier_fixes(const OptionalFixes& fixes) {
  std::vector<double> x, y, squares;
  for (const auto& fix : fixes) {
    if (!fix) continue;
    x.push_back(fix->error_m.x());
    y.push_back(fix->error_m.y());
  }
  const Eigen::Vector2d middle_m(upper_median(x), upper_median(y));
  for (const auto& fix : fixes) {
    if (fix) squares.push_back((fix->error_m - middle_m).squaredNorm());
  }
  const double freedom = 2 * static_cast<double>(squares.size()) - 2;
  const double variance = std::max(estimate_variance_2d(squares, freedom), kFixRoundingVariance);
  const double limit = compute_outlier_bound_2d(kFixOutlierSigmas, freedom) * variance;
  std::vector<bool> near;
  near.reserve(fixes.size());
  for (const auto& fix : fixes) {
    near.push_back(fix && (fix->error_m - middle_m).squaredNorm() <= limit);
  }
  return near;
}

}  // namespace vlp
