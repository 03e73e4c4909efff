// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/reference_point_fixes.h"

#include <algorithm>
#include <set>

#include "positioning/positioner.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Returns the mean height of the detected lamps, in the world.
double compute_lamp_height(const ReferencePointCapture& capture, const LampMap& map) {
  double sum_m = 0;
  int count = 0;
  for (const Detection& detection : capture.detections) {
    const Lamp* lamp = find_lamp(map.lamps, detection.lamp);
    if (lamp == nullptr) continue;
    sum_m += lamp->position_m.z();
    ++count;
  }
  return sum_m / count;
}

Fix locate_camera(const Positioner& positioner, const ReferencePointCapture& capture) {
  Sensors sensors;
  sensors.inclination = capture.inclination;
  return positioner.locate(capture.detections, sensors);
}

}  // namespace

Eigen::MatrixXd LampDerivatives::compute_changes() const {
  Eigen::MatrixXd moves = by_positions;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    moves.middleCols<3>(3 * static_cast<Eigen::Index>(i)) *= *lamps[i].sd_m;
  }
  return moves;
}

ReferencePointFixes::ReferencePointFixes(std::span<const ReferencePointCapture> captures,
                                         const LampMap& map, const Calibration& calibration)
    : captures_(captures), map_(map), calibration_(calibration) {
  calibration_.dispersion.reset();
  const Positioner positioner(map_, calibration_);
  for (const ReferencePointCapture& capture : captures_) {
    const Fix fix = locate_camera(positioner, capture);
    if (!fix.ok() && first_failure_ == FixStatus::ok) first_failure_ = fix.status;
  }
}

std::vector<std::optional<ReferencePointFixes::Estimate>> ReferencePointFixes::at(
    const Eigen::Vector2d& offset_px) const {
  return at(offset_px, map_);
}

std::vector<std::optional<ReferencePointFixes::Estimate>> ReferencePointFixes::at(
    const Eigen::Vector2d& offset_px, const LampMap& map) const {
  Calibration calibration = calibration_;
  calibration.dispersion = Dispersion{offset_px, 0, {0, 0}, 1, {}};
  const Positioner positioner(map, calibration);
  std::vector<std::optional<Estimate>> fixes(captures_.size());
  for (std::size_t i = 0; i < captures_.size(); ++i) {
    const Fix fix = locate_camera(positioner, captures_[i]);
    if (!fix.ok()) continue;
    const Pose& pose = fix.estimate.pose;
    fixes[i] = Estimate{pose.position_m.head<2>() - captures_[i].reference_point_m,
                        fix.noise_covariance.topLeftCorner<2, 2>(),
                        pose.yaw_rad,
                        compute_lamp_height(captures_[i], map) - pose.position_m.z(),
                        fix.residual_px * fix.residual_px * fix.lamps,
                        2 * fix.lamps - 4};
  }
  return fixes;
}

LampDerivatives ReferencePointFixes::compute_lamp_derivatives(
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
  Eigen::MatrixXd& by_positions = derivatives.by_positions;
  by_positions = Eigen::MatrixXd::Zero(2 * std::ssize(captures_), 3 * std::ssize(uncertain));
  if (uncertain.empty()) return derivatives;
  const auto here = at(offset_px);
  LampMap moved = map_;
  for (Eigen::Index column = 0; column < by_positions.cols(); ++column) {
    const std::size_t lamp = uncertain[static_cast<std::size_t>(column / 3)];
    double& coordinate_m = moved.lamps[lamp].position_m[column % 3];
    // A small step, so that no lamp is rejected for it.
    constexpr double max_step_m = 1e-4;
    const double step_m = std::min(*map_.lamps[lamp].sd_m, max_step_m);
    coordinate_m += step_m;
    const auto there = at(offset_px, moved);
    coordinate_m = map_.lamps[lamp].position_m[column % 3];
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (!here[i] || !there[i]) continue;
      by_positions.block<2, 1>(2 * static_cast<Eigen::Index>(i), column) =
          (there[i]->error_m - here[i]->error_m) / step_m;
    }
  }
  return derivatives;
}

}  // namespace vlp
