// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/image_fix.h"

#include <cmath>
#include <utility>

#include "positioning/pose_estimation.h"

namespace vlp {
namespace {

/// Standard deviation of roll and pitch above which the first repetition fits ellipses.
constexpr double kMaxSmallTilt_rad = 0.05;

bool has_fix_converged(const Fix& before, const Fix& after) {
  constexpr double tolerance_sd = 0.1;
  if (!after.has_succeeded()) return true;
  const auto change = subtract_states(after.state, before.state).head<4>().array();
  return (change.square() <=
          tolerance_sd * tolerance_sd * after.noise_covariance.diagonal().head<4>().array())
      .all();
}

}  // namespace

ImageFix locate_with_repeated_detection(const Positioner& positioner, const Sensors& sensors,
                                        std::vector<Detection> first,
                                        const DetectionInPlane& detect) {
  constexpr int max_iterations = 6;
  std::size_t repetitions = 0;
  const auto locate = [&](std::vector<Detection> detections) {
    const Fix fix = positioner.compute_position_fix(detections, sensors);
    return ImageFix{fix, std::move(detections), repetitions};
  };
  const auto repeat = [&](const std::optional<Eigen::Matrix3d>& level_from_camera) {
    ++repetitions;
    return locate(detect(level_from_camera));
  };
  ImageFix found = locate(std::move(first));
  const double tilt_sd_rad = sensors.tilt_sd_rad();
  if (!(tilt_sd_rad > 0)) return found;
  if (tilt_sd_rad > kMaxSmallTilt_rad || !found.fix.has_succeeded()) {
    ImageFix by_ellipses = repeat(std::nullopt);
    const bool has_more_lamps =
        !found.fix.has_succeeded() && by_ellipses.detections.size() > found.detections.size();
    if (by_ellipses.fix.has_succeeded() || has_more_lamps) found = std::move(by_ellipses);
  }
  for (int i = 0; i < max_iterations && found.fix.has_succeeded(); ++i) {
    ImageFix next =
        repeat(positioner.compute_level_from_camera(found.fix.state.motion.inclination));
    const bool has_converged = has_fix_converged(found.fix, next.fix);
    found = std::move(next);
    if (has_converged) break;
  }
  return found;
}

ImageFix locate_camera_in_image(const Positioner& positioner, const LampDetector& detector,
                                const ImageView& image, const Sensors& sensors) {
  const auto inclination = sensors.known_inclination();
  return locate_with_repeated_detection(
      positioner, sensors,
      inclination ? detector.detect_lamps(image, positioner.compute_level_from_camera(*inclination))
                  : detector.detect_lamps(image),
      [&](const auto& level_from_camera) {
        return detector.detect_lamps(image, level_from_camera);
      });
}

}  // namespace vlp
