// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "positioner.h"

namespace vlp {

/// Returns true if velocity or yaw rate of the camera are not zero, or may differ from zero
/// (standard deviation > 0). Lamps on different rows are then seen from different poses.
inline bool may_move(const KnownMotion& motion) {
  return !motion.velocity_m_per_s.isZero(0) || motion.yaw_rate_rad_per_s != 0 ||
         motion.velocity_sd_m_per_s > 0 || motion.yaw_rate_sd_rad_per_s > 0;
}

}  // namespace vlp
