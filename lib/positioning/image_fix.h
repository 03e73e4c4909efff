// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "../lamps/lamp_detector.h"
#include "positioner.h"

namespace vlp {

/// Fix of an image, and the detections that it uses.
struct ImageFix {
  Fix fix;
  std::vector<Detection> detections;
  /// 0 for the first detections, otherwise the number of the repetition that returned them.
  std::size_t repetition = 0;
};

/// Function that detects the lamps of an image again, in the plane that is level by the rotation
/// level_from_camera; std::nullopt: by ellipses in the image.
using DetectionInPlane =
    std::function<std::vector<Detection>(const std::optional<Eigen::Matrix3d>& level_from_camera)>;

/// Computes the fix of an image. If roll and pitch are estimated, repeats the detection of the
/// lamps with the level plane of the fix. Ends when the fix moves by less than a tenth of its
/// standard deviations.
///
/// Reason: lamps are discs in the level plane, and centers detected in another plane are biased. If
/// the tilt may be large or no fix exists yet, the first repetition fits ellipses. They are close
/// to the image of a disc in any plane. A fix that a detection in its plane does not confirm is
/// discarded. Without a fix either way, keeps the detection with more lamps.
///
/// @param first  detections in the plane that is level by the given inclination
ImageFix locate_with_repeated_detection(const Positioner& positioner, const Sensors& sensors,
                                        std::vector<Detection> first,
                                        const DetectionInPlane& detect);

/// Detects the lamps of an image in the level plane and computes its fix, as
/// locate_with_repeated_detection(). Allocates memory on the heap.
/// @throws std::invalid_argument as LampDetector::detect_lamps()
ImageFix locate_camera_in_image(const Positioner& positioner, const LampDetector& detector,
                                const ImageView& image, const Sensors& sensors = {});

}  // namespace vlp
