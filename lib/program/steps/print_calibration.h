// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "calibration/adjustment/adjustment.h"
#include "calibration/dispersion/dispersion.h"
#include "calibration/intrinsics/calibration_report.h"
#include "calibration/rotation/circle_center.h"
#include "rig/calibration.h"

namespace vlp {

/// Prints the solved lens and its uncertainty to stdout.
void print_lens(const IntrinsicsSolution& solution, const CalibrationReport& report,
                const ViewCoverage& coverage, const HeldOutFit& held_out);

/// Prints a rotation center to stdout: center in px, zenith in the camera frame, and tilt in
/// degrees. Center and tilt are followed by their standard deviations if these are known.
/// @pre there is a rotation center
void print_center(const Calibration& calibration);

/// Prints the result of a rotation in place to stdout, and a note if the lever arm is not
/// observable.
void print_rotation(const RotationFit& fit, const RotationCaptures& rotation,
                    const CircleCenters& circles, const Calibration& calibration);

/// Prints the circles of the fixes before and after the correction, and the errors of camera and
/// world, to stdout.
///
/// @param calibration  result of the step
/// @param captures     number of captures at known places
void print_dispersion(const DispersionFit& fit, const Calibration& calibration,
                      std::size_t captures);

/// Print the table of the corrections of lamps: its header, and the row of a lamp.
void print_lamp_header();
void print_lamp_row(int lamp, const Eigen::Vector3d& correction_m, const Eigen::Vector3d& sd_m,
                    const char* note = "");

/// Prints the result of a joint adjustment to stdout: tilt, lever arm, lens, known places, lamps.
///
/// @param before       initial calibration of the adjustment
/// @param lens_stated  true if the covariance of its lens is known
void print_adjustment(const AdjustmentResult& found, const Calibration& before, bool lens_stated);

}  // namespace vlp
