// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/lamp_faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "calibration/map/map_errors.h"
#include "geometry/median.h"
#include "positioning/positioner.h"

namespace vlp {
namespace {

/// Fewer captures determine no fault.
constexpr std::size_t kMinFrames = 3;
/// Fewer fixes at known points do not show what is typical of them.
constexpr std::size_t kMinErrors = 5;
/// Smaller errors at known points are no fault of the captures: a camera may have them.
constexpr double kMinError_m = 0.005;

/// Fix of a capture minus its known point.
struct PlaceError {
  std::string image;
  Eigen::Vector2d horizontal_m;
  double yaw_rad;
};

/// Returns the errors of fixes of three lamps or more at known points, in the order of the frames.
std::vector<PlaceError> place_errors(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, const CapturesTable& places) {
  const Positioner positioner(map, calibration);
  std::vector<PlaceError> errors;
  for (const Frame& frame : frames) {
    const auto place = places.find(frame.image);
    if (place == places.end() || place->second.place == PlaceOf::axis) continue;
    const auto& [x_m, y_m] = std::tie(place->second.x_m, place->second.y_m);
    const Fix fix = positioner.locate(frame.detections);
    if (!x_m || !y_m || !fix.ok() || fix.lamps < 3) continue;
    const auto& pose = fix.estimate.pose;
    errors.push_back(
        {frame.image, pose.position_m.head<2>() - Eigen::Vector2d(*x_m, *y_m), pose.yaw_rad});
  }
  return errors;
}

/// Returns names of images with runs of neighbours joined: "0000.png to 0004.png, 0010.png".
std::string join_images(const std::vector<PlaceError>& errors,
                        const std::vector<std::size_t>& indices) {
  constexpr std::size_t max_groups = 5;
  std::vector<std::string> groups;
  for (std::size_t begin = 0; begin < indices.size();) {
    std::size_t end = begin + 1;
    while (end < indices.size() && indices[end] == indices[end - 1] + 1) ++end;
    groups.push_back(errors[indices[begin]].image);
    if (end > begin + 1) {
      groups.back().append(end > begin + 2 ? " to " : ", ").append(errors[indices[end - 1]].image);
    }
    begin = end;
  }
  if (groups.size() <= max_groups) return fmt::format("{}", fmt::join(groups, ", "));
  const std::size_t more = groups.size() - max_groups;
  groups.resize(max_groups);
  return fmt::format("{} and {} more groups", fmt::join(groups, ", "), more);
}

}  // namespace

std::vector<std::string> lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                     const Calibration& calibration, double min_offset_px) {
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

std::vector<std::string> unseen_lamps(std::span<const Frame> frames, const LampMap& map) {
  std::vector<std::string> faults;
  if (frames.size() < kMinFrames) return faults;
  for (const MapError& error : find_unseen_lamps(frames, map)) faults.push_back(describe(error));
  return faults;
}

std::vector<std::string> place_faults(std::span<const Frame> frames, const LampMap& map,
                                      const Calibration& calibration, const CapturesTable& places) {
  constexpr double min_ratio = 8, millimetres = 1e3;
  const std::vector<PlaceError> errors = place_errors(frames, map, calibration, places);
  if (errors.size() < kMinErrors) return {};
  std::vector<double> sizes_m;
  sizes_m.reserve(errors.size());
  for (const PlaceError& error : errors) sizes_m.push_back(error.horizontal_m.norm());
  const double typical_m = upper_median(sizes_m);
  const double limit_m = std::max(kMinError_m, min_ratio * typical_m);
  std::vector<std::size_t> outliers;
  double max_m = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (sizes_m[i] < limit_m) continue;
    outliers.push_back(i);
    max_m = std::max(max_m, sizes_m[i]);
  }
  if (outliers.empty()) return {};
  if (outliers.size() == 1) {
    return {
        fmt::format("{} was not taken where its table says: it is {:.1f} mm off, others {:.2g} mm",
                    errors[outliers.front()].image, millimetres * max_m, millimetres * typical_m)};
  }
  return {
      fmt::format("captures {} are off by up to {:.1f} mm, the others by {:.2g} mm: taken "
                  "elsewhere than their table says, or by another camera",
                  join_images(errors, outliers), millimetres * max_m, millimetres * typical_m)};
}

std::string camera_fault(std::span<const Frame> frames, const LampMap& map,
                         const Calibration& calibration, const CapturesTable& places) {
  constexpr double max_ratio = 1.0 / 3, millimetres = 1e3;
  const std::vector<PlaceError> errors = place_errors(frames, map, calibration, places);
  if (errors.size() < kMinErrors) return "";
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
  const bool is_offset =
      camera_offset_m.norm() >= kMinError_m && camera_squares <= max_ratio * max_ratio * squares;
  if (!is_offset || camera_squares > max_ratio * max_ratio * world_squares) return "";
  return fmt::format(
      "the {} captures {} to {} are off by {:.1f} mm in one direction of the camera, which turns "
      "with it: were they taken by another camera, or was it moved on its mount?",
      errors.size(), errors.front().image, errors.back().image,
      millimetres * camera_offset_m.norm());
}

}  // namespace vlp
