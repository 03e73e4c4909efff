// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lamp_faults.h"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "calibration/map/map_errors.h"
#include "positioning/positioner.h"
#include "session/check_outliers.h"

namespace vlp {
namespace {

/// Fewer captures determine no fault.
constexpr std::size_t kMinFrames = 3;
/// Fewer fixes at known points do not show what is typical of them.
constexpr std::size_t kMinErrors = 5;
/// Fix of a capture minus its known point.
struct PlaceError {
  std::string image;
  Eigen::Vector2d horizontal_m;
  double yaw_rad;
  /// Index of the frame.
  std::size_t frame;
};

/// Returns the errors of fixes of three lamps or more at known points, in the order of the frames.
std::vector<PlaceError> place_errors(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, const CapturesTable& places) {
  const Positioner positioner(map, calibration);
  std::vector<PlaceError> errors;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    const auto place = places.find(frame.image);
    if (place == places.end() || place->second.place == PlaceOf::axis) continue;
    const auto& [x_m, y_m] = std::tie(place->second.x_m, place->second.y_m);
    const Fix fix = positioner.locate(frame.detections);
    if (!x_m || !y_m || !fix.ok() || fix.lamps < 3) continue;
    const auto& pose = fix.estimate.pose;
    errors.push_back(
        {frame.image, pose.position_m.head<2>() - Eigen::Vector2d(*x_m, *y_m), pose.yaw_rad, i});
  }
  return errors;
}

}  // namespace

std::vector<std::string> describe_lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                              const Calibration& calibration,
                                              double min_offset_px) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  MapErrorOptions options;
  options.min_offset_px = min_offset_px;
  for (const MapError& error : find_map_errors(frames, map, calibration, options).errors) {
    if (!error.lamps.empty() || error.kind == MapErrorKind::mirrored) {
      faults.push_back(describe(error));
    }
  }
  return faults;
}

std::vector<std::string> describe_missing_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : find_unseen_lamps(frames, map)) faults.push_back(describe(error));
  return faults;
}

std::string describe_place_fault(std::span<const Frame> frames, const LampMap& map,
                                 const Calibration& calibration, const CapturesTable& places) {
  std::vector<CheckError> errors;
  for (const PlaceError& error : place_errors(frames, map, calibration, places)) {
    errors.push_back({error.image, error.horizontal_m.norm(), error.frame});
  }
  return describe_check_outliers(errors);
}

std::string describe_capture_fault(std::span<const Frame> frames, const LampMap& map,
                                   const Calibration& calibration) {
  const Positioner positioner(map, calibration);
  std::vector<CaptureResidual> residuals;
  residuals.reserve(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.locate(frames[i].detections);
    if (fix.ok() && fix.lamps >= 3) residuals.push_back({frames[i].image, fix.residual_px, i});
  }
  return describe_residual_outliers(residuals);
}

std::optional<CommonOffset> find_common_offset(std::span<const Frame> frames, const LampMap& map,
                                               const Calibration& calibration,
                                               const CapturesTable& places) {
  constexpr double max_ratio = 1.0 / 3;
  const std::vector<PlaceError> errors = place_errors(frames, map, calibration, places);
  if (errors.size() < kMinErrors) return std::nullopt;
  const auto count = static_cast<double>(errors.size());
  const auto in_camera = [](const PlaceError& error) -> Eigen::Vector2d {
    return Eigen::Rotation2Dd(-error.yaw_rad) * error.horizontal_m;
  };
  Eigen::Vector2d camera_offset_m(0, 0), world_offset_m(0, 0);
  for (const PlaceError& error : errors) {
    camera_offset_m += in_camera(error) / count;
    world_offset_m += error.horizontal_m / count;
  }
  double squares = 0, camera_squares = 0, world_squares = 0;
  for (const PlaceError& error : errors) {
    squares += error.horizontal_m.squaredNorm();
    camera_squares += (in_camera(error) - camera_offset_m).squaredNorm();
    world_squares += (error.horizontal_m - world_offset_m).squaredNorm();
  }
  const auto explains = [&](double offset_m, double left, double other_left) {
    constexpr double max_square_ratio = max_ratio * max_ratio;
    return offset_m >= kMinOutlierError_m && left <= max_square_ratio * squares &&
           left <= max_square_ratio * other_left;
  };
  if (explains(camera_offset_m.norm(), camera_squares, world_squares)) {
    return CommonOffset{camera_offset_m, true, errors.size()};
  }
  if (explains(world_offset_m.norm(), world_squares, camera_squares)) {
    return CommonOffset{world_offset_m, false, errors.size()};
  }
  return std::nullopt;
}

std::string describe(const CommonOffset& offset) {
  constexpr double millimeters = 1e3;
  const Eigen::Vector2d offset_mm = millimeters * offset.offset_m;
  return fmt::format(
      "all {} captures of the check are off by {:.1f} mm in one direction of the {} (x {:+.1f} mm, "
      "y {:+.1f} mm): {}",
      offset.captures, offset_mm.norm(), offset.in_camera ? "camera" : "room", offset_mm.x(),
      offset_mm.y(),
      offset.in_camera ? "it is loose in its housing or on its mount, or another camera took them"
                       : "the known points or the lamps have moved");
}

}  // namespace vlp
