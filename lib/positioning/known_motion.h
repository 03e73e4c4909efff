// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "positioner.h"

namespace vlp {

/// Whether lamps that are read at different times are, or may be, seen from different places.
inline bool moves(const KnownMotion& motion) {
  return !motion.velocity_m_per_s.isZero(0) || motion.yaw_rate_rad_per_s != 0 ||
         motion.velocity_sd_m_per_s > 0 || motion.yaw_rate_sd_rad_per_s > 0;
}

}  // namespace vlp
