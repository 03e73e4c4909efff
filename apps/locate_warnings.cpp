// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "locate_warnings.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "captures/outside_image.h"
#include "positioning/residual_noise.h"

namespace vlp {

void warn_of_noise(const std::vector<Frame>& frames, const std::vector<Fix>& fixes) {
  double stated_px = 0;
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      stated_px = std::max(stated_px, detection.sigma_px.value_or(0));
    }
  }
  constexpr double too_noisy = 3;
  const auto shown_px = residual_noise_px(fixes);
  if (shown_px && *shown_px > too_noisy * stated_px) {
    spdlog::warn(
        "the residuals show {:.2g} px of noise, {:.2g} px are stated: sd is too small; are "
        "calibration and lamp map right and complete?",
        *shown_px, stated_px);
  }
}

void warn_of_image(const std::vector<Frame>& frames, const Camera& camera) {
  const std::size_t outside = count_far_outside(frames, camera.imager_px);
  if (outside == 0) return;
  spdlog::warn(
      "{} detections far outside the camera's {} x {} px: is the calibration this camera's?",
      outside, camera.imager_px[0], camera.imager_px[1]);
}

void warn_of_captures(const std::vector<Frame>& frames, const CapturesTable& captures) {
  const auto without = std::count_if(frames.begin(), frames.end(), [&](const Frame& frame) {
    return captures.find(frame.image) == captures.end();
  });
  if (captures.empty() || without == 0) return;
  spdlog::warn(
      "{} of {} images are not in captures.csv: image names have to be equal (here '{}', "
      "there '{}')",
      without, frames.size(), frames.front().image, captures.begin()->first);
}

void warn_of_lamps_left_out(const std::vector<Frame>& frames, const std::vector<Fix>& fixes) {
  int unknown = 0, rejected = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    unknown += fixes[i].unknown_lamps;
    rejected += fixes[i].rejected_lamps;
    if (fixes[i].rejected_lamps > 0) {
      spdlog::debug("{}: lamp {} contradicts the others and is left out", frames[i].image,
                    fixes[i].rejected_lamp_id);
    }
  }
  if (unknown > 0)
    spdlog::warn("{} detections of lamps that are not in the map, left out", unknown);
  if (rejected > 0) spdlog::warn("{} detections that contradict the others, left out", rejected);
}

}  // namespace vlp
