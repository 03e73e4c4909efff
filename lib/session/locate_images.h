// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "captures/detections_table.h"
#include "frontend/lamp_intake.h"
#include "session/locate_step.h"

namespace vlp {

/// The positions of the cameras of a set of images.
struct LocatedImages {
  /// The detections that the fixes rest on.
  Observations seen;
  LocateResult located;
};

/// Detects the lamps in images (observe_lamps()) and locates the camera of each. `input` states
/// everything except frames. Where a camera's tilt is estimated, its lamps are detected again in
/// the plane that is level by its fix (redetect_tilted()).
///
/// Skipped images and remarks of the intake are part of the result, which fails as locate_frames()
/// does, or if no lamp is identified. Throws as observe_lamps() and locate_frames() do.
LocatedImages locate_images(const LampImages& images, ImageUse use, LocateInput input,
                            const FrontendOptions& options, const IntakeProgress& progress = {});

/// Detects the lamps of the named images in their level planes again: a frame per image, by name.
using Redetector = std::function<std::vector<Frame>(const LevelRotations&)>;

/// Lamps are discs in the level plane; centres that are detected in another plane are biased. For
/// captures whose tilt is estimated, detections are repeated in the plane that is level by the fix,
/// until the fix moves by less than a tenth of its standard deviations. Where the tilt may be large
/// or there is no fix yet, the first repetition fits ellipses, which are close to the image of a
/// disc in any plane. A fix that a detection in its plane does not confirm is discarded. A capture
/// without a fix either way keeps the detection with more lamps.
///
/// Replaces the frames of `input`. Returns the level rotations of those that changed.
LevelRotations redetect_tilted(LocateInput& input, const Redetector& redetect);

}  // namespace vlp
