// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "calibration/dispersion/dispersion.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_sharpness.h"
#include "calibration/rotation/circle_center.h"
#include "report/plots/dispersion_plot.h"
#include "report/plots/intrinsics_plot.h"
#include "report/plots/rotation_plot.h"

namespace vlp {

/// Collects corners and residuals of a solution, and the uncertainty of its projection. Includes
/// the sharpness if it was measured. `lattice` is that of the solution's boards.
/// @pre solution.ok()
IntrinsicsPlot make_plot(const std::string& title, const IntrinsicsSolution& solution,
                         const BoardLattice& lattice,
                         const std::optional<LensSharpness>& sharpness);

/// Collects the lamps of a rotation in place with their circles, and the rotation center.
RotationPlot make_plot(const std::string& title, const RotationCaptures& spot,
                       const CircleCenters& circles, const RotationFit& fit, const Camera& camera);

/// Collects the fixes at a known reference point, before and after the correction.
DispersionPlot make_plot(const std::string& title, const DispersionFit& fit);

}  // namespace vlp
