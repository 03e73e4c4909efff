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

/// Corners and residuals of a solution for boards of that lattice, and the uncertainty of its
/// projection, with the sharpness if it was measured. Precondition: ok().
IntrinsicsPlot plot_of(const std::string& title, const IntrinsicsSolution& solution,
                       const BoardLattice& lattice, const std::optional<LensSharpness>& sharpness);

/// The lamps of a turn on the spot with their circles, and the rotation centre.
RotationPlot plot_of(const std::string& title, const SpotCaptures& spot,
                     const CircleCenters& circles, const RotationFit& fit, const Camera& camera);

/// The fixes at a known station, before and after.
DispersionPlot plot_of(const std::string& title, const DispersionFit& fit);

}  // namespace vlp
