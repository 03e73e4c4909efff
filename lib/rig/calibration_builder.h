// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "calibration.h"

/// Steps of the calibration. Each part depends on those before it:
///   camera -> rotation_center -> dispersion
/// An adjustment replaces camera and rotation_center together and removes the dispersion. A step
/// replaces its part, keeps the parts before it, and removes the parts that depend on the old one.
/// The history changes with the parts. The functions set `entry.part`.
namespace vlp {

/// Returns a calibration that consists of this camera and its report, with `entry` as its only
/// history. There is no rotation center, dispersion or adjustment, because these depend on the
/// camera.
Calibration make_calibration(Camera camera, std::optional<IntrinsicsReport> report,
                             HistoryEntry entry);

/// Returns the calibration with this rotation center and `entry` in its history. Dispersion and
/// adjustment are removed, because they depend on the old one.
/// @param covariance  joint covariance of lens and rotation center; std::nullopt if unknown
Calibration add_rotation_center(Calibration calibration, const RotationCenter& rotation_center,
                                std::optional<JointCovariance> covariance, HistoryEntry entry);

/// Returns the calibration with this rotation center, adjustment and history entry. The dispersion
/// is removed. `calibration` has the adjusted camera and keeps its intrinsics_report.
Calibration add_adjustment(Calibration calibration, const RotationCenter& rotation_center,
                           Adjustment adjustment, JointCovariance covariance, HistoryEntry entry);

/// Returns the calibration without dispersion, its history and its rows of the covariance. Also
/// removes the rows of lamps that are correlated with the dispersion only.
Calibration remove_dispersion(Calibration calibration);

/// Returns camera and rotation center without their covariances.
Calibration extract_geometry(const Calibration& calibration);

/// Returns the calibration with this dispersion and `entry` in its history.
/// @param covariance  joint covariance of all steps; std::nullopt if unknown
Calibration add_dispersion(Calibration calibration, const Dispersion& dispersion,
                           std::optional<JointCovariance> covariance, HistoryEntry entry);

}  // namespace vlp
