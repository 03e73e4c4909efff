// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/levelling/lamp_bundle.h"
#include "camera/lens.h"
#include "captures/detections_table.h"
#include "positioning/row_clock.h"
#include "rig/lamp_map.h"

namespace vlp {

/// The lamps of the map in one capture, taken through the lens; their whitening as in positioning:
/// noise that is stated is of the image as taken, other noise is 1 px in the undistorted image.
/// Detections of other lamps and pixels that no ray to the front reaches are left out. Nothing
/// when a lamp stands twice or the capture holds more than kMaxSightings. Without a row clock all
/// are read at once.
std::optional<std::vector<LampBundle::Observation>> measured_lamps(
    std::span<const Detection> detections, const LampMap& map, const Lens& lens,
    const std::optional<RowClock>& row_clock);

/// What there is of one capture.
struct MeasuredCapture {
  std::vector<LampBundle::Observation> seen;
  KnownMotion motion;
};

/// The fix of a capture of three lamps or more by fix_robustly(), as if it stood, and those of its
/// lamps that agree; nothing where there is none.
std::optional<LampBundle::Capture> placed_capture(const MeasuredCapture& measured,
                                                  const std::vector<Eigen::Vector3d>& lamps_m,
                                                  const Eigen::Matrix3d& level_from_camera);

}  // namespace vlp
