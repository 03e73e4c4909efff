// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/detections_table.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Describes the errors of the map of a station's lamps (calibration/map/map_errors.h), one line
/// each. Requires three captures. Offsets below `min_offset_px` in the image are ignored. The
/// default is large, so that small errors of the map do not excuse a camera that is being
/// calibrated. It can be smaller for a known camera.
std::vector<std::string> describe_lamp_faults(std::span<const Frame> frames, const LampMap& map,
                                              const Calibration& calibration,
                                              double min_offset_px = 2.5);

/// Describes the lamps of the map that no capture contains, one line each. Requires three captures.
std::vector<std::string> describe_missing_lamps(std::span<const Frame> frames, const LampMap& map);

/// Describes captures at other places than in their table, or by another camera
/// (describe_check_outliers()), from fixes of three lamps or more. Returns an empty string if there
/// are none.
std::string describe_place_fault(std::span<const Frame> frames, const LampMap& map,
                                 const Calibration& calibration, const CapturesTable& places);

/// Describes captures whose residuals are outliers (describe_residual_outliers()), from fixes of
/// three lamps or more. Returns an empty string if there are none.
std::string describe_capture_fault(std::span<const Frame> frames, const LampMap& map,
                                   const Calibration& calibration);

/// Common offset of all captures at known points.
struct CommonOffset {
  /// Fix minus known point: in the frame of the level camera if `in_camera`, otherwise in the
  /// world.
  Eigen::Vector2d offset_m;
  /// True if it rotates with the camera: the camera moved since it was calibrated. Otherwise the
  /// known points or the lamps moved.
  bool in_camera;
  /// Number of captures.
  std::size_t captures;
};

/// Finds an offset of more than 5 mm, without which the errors of captures at known points are a
/// third or less.
///
/// Returns std::nullopt if there is none, and for fewer than five fixes. Returns std::nullopt, too,
/// if the camera did not rotate between the captures, because the two frames cannot be separated
/// then.
std::optional<CommonOffset> find_common_offset(std::span<const Frame> frames, const LampMap& map,
                                               const Calibration& calibration,
                                               const CapturesTable& places);

/// Describes an offset with its size and direction, and its possible reasons, in one line.
std::string describe(const CommonOffset& offset);

}  // namespace vlp
