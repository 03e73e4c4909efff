// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/tilt/tilt_calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "captures/number_text.h"
#include "geometry/angles.h"
#include "rig/calibration_builder.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

constexpr int kDigits = 3;
constexpr double kOneYaw_rad = rad_from_deg(10);
constexpr double kOnePlace = 0.1;  // of the lamps' height above the camera
constexpr const char* kUndeterminedMessage =
    "the captures do not determine the tilt: too few lamps are visible, or they are in one line; "
    "add captures with more lamps, at other positions and yaws";

/// Captures whose lamps agree with the map and with a camera at one zenith, with their poses.
struct Placement {
  std::vector<AdjustmentCapture> captures;
  std::vector<Pose> poses;
  /// Mean height of the lamps above the camera.
  double height_m = 0;
  /// Number of detections of each lamp of the map.
  std::vector<int> detection_counts;
  /// Sum of the squared residuals of the captures in the undistorted image.
  double squares_px2 = 0;

  int count_detections() const {
    return std::accumulate(detection_counts.begin(), detection_counts.end(), 0);
  }
  int degrees_of_freedom() const {
    return 2 * count_detections() - 4 * static_cast<int>(poses.size());
  }
};

/// Returns the captures of three lamps of the map or more, without detections of other lamps.
/// Counts the other captures, and all detections of the returned captures.
std::vector<AdjustmentCapture> select_captures(std::span<const Frame> frames, const LampMap& map,
                                               const std::vector<KnownMotion>& motions,
                                               TiltCalibration& result) {
  std::vector<AdjustmentCapture> captures;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    AdjustmentCapture capture{frames[i].image, frames[i].detections};
    std::erase_if(capture.detections, [&](const Detection& detection) {
      return find_lamp_by_id(map.lamps, detection.lamp) == nullptr;
    });
    if (capture.detections.size() < 3) {
      ++result.captures_of_few_lamps;
      continue;
    }
    if (!motions.empty()) capture.motion = motions[i];
    result.detections_rejected += static_cast<int>(capture.detections.size());
    captures.push_back(std::move(capture));
  }
  return captures;
}

/// Locates each capture separately, as a stationary camera. Rejects lamps and captures that
/// contradict the map.
Placement locate_separately(const std::vector<AdjustmentCapture>& captures, LampMap map,
                            const Calibration& calibration) {
  for (Lamp& lamp : map.lamps) lamp.sd_m.reset();
  const Positioner positioner(map, extract_geometry(calibration));
  Placement placement;
  placement.detection_counts.resize(map.lamps.size());
  std::vector<Detection> detections;
  for (const AdjustmentCapture& capture : captures) {
    // Residuals beyond the given noise may be due to the unknown tilt, so that sigma_px is not
    // used.
    detections = capture.detections;
    for (Detection& detection : detections) detection.sigma_px.reset();
    const Fix fix = positioner.compute_position_fix(detections);
    if (!fix.has_succeeded() || fix.lamps < 3) continue;
    AdjustmentCapture placed = capture;
    const auto rejected_end =
        fix.rejected_ids.begin() +
        std::min(static_cast<std::ptrdiff_t>(fix.rejected_lamps), std::ssize(fix.rejected_ids));
    std::erase_if(placed.detections, [&](const Detection& detection) {
      return std::find(fix.rejected_ids.begin(), rejected_end, detection.lamp) != rejected_end;
    });
    for (const Detection& detection : placed.detections) {
      const Lamp* lamp = find_lamp_by_id(map.lamps, detection.lamp);
      ++placement.detection_counts[static_cast<std::size_t>(lamp - map.lamps.data())];
      placement.height_m += lamp->position_m.z() - fix.state.pose.position_m.z();
    }
    placement.squares_px2 += fix.lamps * fix.residual_px * fix.residual_px;
    placement.poses.push_back(fix.state.pose);
    placement.captures.push_back(std::move(placed));
  }
  placement.height_m /= std::max(1, placement.count_detections());
  return placement;
}

/// Variation of yaws and positions of the captures.
struct PoseVariation {
  /// Approximate RMS sine of the yaws relative to their mean.
  double yaw;
  /// RMS distance of the positions from their mean, divided by the height of the lamps.
  double place;
};

PoseVariation compute_pose_variation(const Placement& placement) {
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  Eigen::Vector2d mean_heading = Eigen::Vector2d::Zero();
  const double n = static_cast<double>(placement.poses.size());
  for (const Pose& pose : placement.poses) {
    mean_m += pose.position_m / n;
    mean_heading += Eigen::Vector2d(std::cos(pose.yaw_rad), std::sin(pose.yaw_rad)) / n;
  }
  double square_m2 = 0;
  for (const Pose& pose : placement.poses) {
    square_m2 += (pose.position_m - mean_m).squaredNorm() / n;
  }
  return {std::sqrt(std::max(0.0, 1 - mean_heading.squaredNorm())),
          std::sqrt(square_m2) / placement.height_m};
}

/// Returns the reason why yaws and positions of the captures cannot determine the tilt (and the
/// map), and the remedy. Returns an empty string if they can.
std::string explain_undetermined(const Placement& placement, const LampMap& map, bool refine_map) {
  if (placement.captures.size() < 2) {
    return "two captures or more with three consistent lamps of the map or more are needed; "
           "there " +
           std::string(placement.captures.empty() ? "is none" : "is one") +
           ": add captures with more lamps, or correct lamp map and camera";
  }
  const PoseVariation variation = compute_pose_variation(placement);
  const bool one_yaw = variation.yaw < std::sin(kOneYaw_rad),
             one_place = variation.place < kOnePlace;
  if (one_yaw && one_place) {
    return "all captures have one position and yaw, where a small error of the lamp map cannot be "
           "separated from a tilt; turn the camera in place, or drive, and add captures";
  }
  if (!refine_map) return "";
  if (one_yaw) {
    return "all captures have one yaw, which cannot separate a tilt of the lamp map from the tilt "
           "of the camera; turn the camera and add captures, or leave out --refine-map";
  }
  if (one_place) {
    return "all captures are at one position, which does not determine the distances of the lamps; "
           "add captures at other positions, or leave out --refine-map";
  }
  const auto& counts = placement.detection_counts;
  if (const auto once = std::find(counts.begin(), counts.end(), 1); once != counts.end()) {
    return "lamp " + std::to_string(map.lamps[static_cast<std::size_t>(once - counts.begin())].id) +
           " is in one capture only: add captures with it, or leave out --refine-map";
  }
  const auto lamps = std::ssize(counts) - std::count(counts.begin(), counts.end(), 0);
  return placement.degrees_of_freedom() > 2 + 3 * lamps - 5 ? "" : kUndeterminedMessage;
}

/// Returns the reason if a standard deviation exceeds the limits of the options, otherwise an empty
/// string.
std::string explain_uncertainty(const TiltCalibration& result,
                                const TiltCalibrationOptions& options) {
  const double sd_rad = std::sqrt(result.covariance.diagonal().maxCoeff());
  if (!(sd_rad <= options.max_sd_rad)) {
    return "the standard deviation of the tilt would be " +
           format_digits(deg_from_rad(sd_rad), kDigits) +
           " degrees: add captures with more lamps, at other positions and yaws";
  }
  for (const auto& lamp : result.corrections) {
    const double sd_m = lamp.sd_m.maxCoeff();
    if (!(sd_m <= options.max_lamp_sd_m)) {
      return "lamp " + std::to_string(lamp.id) + " would have a standard deviation of " +
             format_digits(1e3 * sd_m, kDigits) +
             " mm: add captures with it, at other positions and yaws, or leave out --refine-map";
    }
  }
  return "";
}

bool all_have_sigma(std::span<const Frame> frames) {
  return std::all_of(frames.begin(), frames.end(), [](const Frame& frame) {
    return std::all_of(frame.detections.begin(), frame.detections.end(),
                       [](const Detection& detection) { return detection.sigma_px.has_value(); });
  });
}

/// Adjusts the captures that agree with the map. A capture that contradicts the map for a level
/// camera may agree with it at the zenith that the other captures determine, and is then used.
/// Iterates until the number of detections is unchanged, at most six times.
AdjustmentResult adjust_repeatedly(const std::vector<AdjustmentCapture>& captures,
                                   AdjustmentInput& input, TiltCalibration& result) {
  constexpr int max_iterations = 6;
  constexpr double no_limit = std::numeric_limits<double>::infinity();
  AdjustmentResult found;
  for (int iteration = 0, detections = 0; iteration < max_iterations; ++iteration) {
    Placement placement = locate_separately(captures, input.lamps, input.calibration);
    result.undetermined =
        explain_undetermined(placement, input.lamps, input.map_prior == MapPrior::frame);
    if (!result.undetermined.empty() || placement.count_detections() == detections) break;
    detections = placement.count_detections();
    if (iteration == 0) {
      result.residual_before_px = std::sqrt(placement.squares_px2 / placement.degrees_of_freedom());
    }
    input.captures = std::move(placement.captures);
    found = adjust_bundle(input, {no_limit, no_limit});
    if (!found.has_succeeded()) {
      result.undetermined = kUndeterminedMessage;
      break;
    }
    input.calibration.rotation_center = found.center;
  }
  return found;
}

}  // namespace

TiltCalibration estimate_tilt_from_lamps(std::span<const Frame> frames, const LampMap& map,
                                         const Camera& camera,
                                         const TiltCalibrationOptions& options) {
  TiltCalibration result;
  result.map = map;
  const auto captures = select_captures(frames, map, options.motions, result);
  AdjustmentInput input{{}, map, {}};
  input.calibration.camera = camera;
  input.calibration.intrinsics_report.emplace().covariance = options.lens_covariance;
  input.lens_is_held = true;
  if (options.refine_map) input.map_prior = MapPrior::frame;
  input.captures_are_checked = true;
  input.weighs_in_undistorted_image = true;
  const AdjustmentResult found = adjust_repeatedly(captures, input, result);
  result.captures = found.captures;
  result.captures_rejected = static_cast<int>(captures.size()) - found.captures;
  result.detections = found.detections;
  result.detections_rejected -= found.detections;
  if (!result.undetermined.empty()) return result;
  if (all_have_sigma(frames)) result.noise_scale = found.noise_scale;
  result.center = found.center;
  result.covariance = found.center_covariance;
  if (options.lens_covariance) result.joint_covariance = found.lens_and_center_covariance();
  result.residual_px = found.residual_px;
  if (options.refine_map) {
    result.corrections = found.lamps;
    for (std::size_t i = 0; i < map.lamps.size(); ++i) {
      result.map.lamps[i].position_m = found.refined_map.lamps[i].position_m;
    }
  }
  result.undetermined = explain_uncertainty(result, options);
  return result;
}

}  // namespace vlp
