// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "../camera/lens.h"
#include "../geometry/frames.h"
#include "../rig/lamp_map.h"

namespace vlp {

/// Returns the indices in the map of the lamps that a camera whose level frame is at `level` sees
/// whole: the centre, and the outline if its size is known, are above it and within the image. A
/// camera that stands level has the identity for camera_from_level.
std::vector<std::size_t> lamps_in_view(const LampMap& map, const Lens& lens,
                                       const std::array<int, 2>& imager_px,
                                       const Eigen::Matrix3d& camera_from_level, const Pose& level);

}  // namespace vlp
