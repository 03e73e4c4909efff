// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "captures/detections_table.h"
#include "frontend/lamp_intake.h"
#include "session/locate_step.h"

namespace vlp {

/// Detects the lamps in images (observe_lamps()) and locates the camera of each image. `input`
/// holds everything except the frames. If the tilt of a camera is estimated, its lamps are detected
/// again in the plane that is level by its fix (redetect_tilted_captures()).
///
/// Skipped images and remarks of the intake are part of the result. It fails as locate_frames()
/// does, or if no lamp is identified.
/// @throws as observe_lamps() and locate_frames()
LocateResult locate_images(const LampImages& images, ImageUse use, LocateInput input,
                           const FrontendOptions& options, const IntakeProgress& progress = {});

/// Function that detects the lamps of the named images again, in their level planes. Returns a
/// frame per image, by name.
using Redetector = std::function<std::vector<Frame>(const LevelRotations&)>;

/// Repeats the detection of lamps in captures whose tilt is estimated, in the plane that is level
/// by the fix. Stops when the fix moves by less than a tenth of its standard deviations.
///
/// Reason: lamps are discs in the level plane, and centers detected in another plane are biased. If
/// the tilt may be large or no fix exists yet, the first repetition fits ellipses. They are close
/// to the image of a disc in any plane. A fix that a detection in its plane does not confirm is
/// discarded. A capture without a fix either way keeps the detection with more lamps.
///
/// Replaces the frames of `input`. Returns the level rotations of the frames that changed.
LevelRotations redetect_tilted_captures(LocateInput& input, const Redetector& redetect);

}  // namespace vlp
