// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "support/body_rig.h"

namespace vlp {

/// Captures of a camera that moves in all directions and rotates, at two heights.
struct MovingCaptures {
  std::vector<Frame> frames;
  std::vector<KnownMotion> motions;
  std::vector<Pose> cameras;
};

/// Returns eight lamps and a camera tilted by 1.1 degrees with a row time of 55 us.
inline BodyRig make_tilted_body() {
  BodyRig rig{synthetic_lamps(), rolling_calibration(), {}, {}};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.02, 0.7);
  return rig;
}

/// Returns captures with exact motions. Each camera rotates at up to 1.5 rad/s.
inline MovingCaptures make_moving_captures(BodyRig rig, int count, double speed_m_per_s,
                                           Random& random, double sigma_px) {
  MovingCaptures captures;
  for (int i = 0; i < count; ++i) {
    BodyState& body = rig.body;
    body.pose = {{random.uniform(-0.5, 0.5), random.uniform(-0.3, 0.3), i % 2 ? 0.3 : 0.0},
                 random.uniform(-3.1, 3.1)};
    const double direction_rad = random.uniform(-3.1, 3.1), rate = random.uniform(-1.5, 1.5);
    body.motion.velocity_m_per_s =
        speed_m_per_s * Eigen::Vector2d(std::cos(direction_rad), std::sin(direction_rad));
    body.motion.yaw_rate_rad_per_s = speed_m_per_s > 0 ? rate : 0;
    captures.frames.push_back({std::to_string(i), seen_from(rig, sigma_px)});
    captures.motions.push_back(
        {body.motion.velocity_m_per_s, body.motion.yaw_rate_rad_per_s, 0, 0});
    captures.cameras.push_back(body.pose);
  }
  return captures;
}

/// Returns odometry readings of the motions, with errors of the given standard deviations.
inline std::vector<KnownMotion> simulate_odometry(const std::vector<KnownMotion>& motions,
                                                  double sd_m_per_s, double sd_rad_per_s,
                                                  Random& random) {
  std::vector<KnownMotion> read = motions;
  for (KnownMotion& motion : read) {
    for (double& one : motion.velocity_m_per_s) one += sd_m_per_s * random.normal();
    motion.yaw_rate_rad_per_s += sd_rad_per_s * random.normal();
    motion.velocity_sd_m_per_s = sd_m_per_s;
    motion.yaw_rate_sd_rad_per_s = sd_rad_per_s;
  }
  return read;
}

}  // namespace vlp
