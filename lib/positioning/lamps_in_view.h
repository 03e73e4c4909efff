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

/// Returns the indices in the map of the lamps that are fully visible to a camera with its level
/// frame at `level`. Such a lamp has its center, and its outline if the size is known, above the
/// camera and within the image. `camera_from_level` is the identity for a level camera.
std::vector<std::size_t> find_lamps_in_view(const LampMap& map, const Lens& lens,
                                            const std::array<int, 2>& imager_px,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level);

}  // namespace vlp
