// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calibration.h"

/// How a stage of the calibration adds its part. Each part rests on those before it:
///   camera -> rotation_center -> dispersion;
/// an adjustment makes camera and rotation_center anew, together, and leaves no dispersion.
/// A stage replaces its own part, keeps the parts that its own rests on, and drops those that
/// rested on the old one; the history goes with the parts. `entry.part` is filled in here.
namespace vlp {

/// The first stage: every other part rests on the camera, so nothing of an older file is kept.
Calibration with_camera(Camera camera, std::optional<IntrinsicsReport> report, HistoryEntry entry);

Calibration with_rotation_center(Calibration calibration, const RotationCenter& rotation_center,
                                 HistoryEntry entry);

/// `calibration` has the adjusted camera, and keeps its intrinsics_report.
Calibration with_adjustment(Calibration calibration, const RotationCenter& rotation_center,
                            Adjustment adjustment, HistoryEntry entry);

Calibration with_dispersion(Calibration calibration, const Dispersion& dispersion,
                            HistoryEntry entry);

}  // namespace vlp
