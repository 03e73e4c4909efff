// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_captures.h"

#include <stdexcept>

namespace vlp {

std::optional<KnownMotion> find_motion(const Capture& capture,
                                       const std::optional<KnownMotion>& default_motion,
                                       double yaw_rate_sd_rad_per_s) {
  if (!capture.velocity_m_per_s && !capture.yaw_rate_rad_per_s) return default_motion;
  KnownMotion motion = default_motion.value_or(KnownMotion());
  if (capture.velocity_m_per_s) {
    motion.velocity_m_per_s = *capture.velocity_m_per_s;
    motion.velocity_sd_m_per_s = capture.velocity_sd_m_per_s.value_or(0);
  }
  if (capture.yaw_rate_rad_per_s) {
    motion.yaw_rate_rad_per_s = *capture.yaw_rate_rad_per_s;
    motion.yaw_rate_sd_rad_per_s = yaw_rate_sd_rad_per_s;
  }
  return motion;
}

std::vector<KnownMotion> list_capture_motions(std::span<const Frame> frames,
                                              const CapturesTable& captures,
                                              const std::optional<KnownMotion>& default_motion,
                                              double yaw_rate_sd_rad_per_s) {
  std::vector<KnownMotion> motions;
  motions.reserve(frames.size());
  bool any = false;
  for (const Frame& frame : frames) {
    const auto entry = captures.find(frame.image);
    const auto known = entry == captures.end()
                           ? default_motion
                           : find_motion(entry->second, default_motion, yaw_rate_sd_rad_per_s);
    motions.push_back(known.value_or(KnownMotion()));
    any = any || may_move(motions.back());
  }
  if (!any) motions.clear();
  return motions;
}

void check_timing_known(const Camera& camera) {
  if (camera.row_time_s && camera.readout) return;
  throw std::invalid_argument(
      "a moving camera needs row_time_s and readout in its calibration; give --row-time-s and "
      "--readout to vlp-intrinsics, or --readout to programs that read captures");
}

}  // namespace vlp
