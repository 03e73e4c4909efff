// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "camera/lens.h"

namespace vlp {

/// The parameters of a splined lens that puts rays where `lens` does, by least squares over the
/// rays of all the grid's pieces that `lens` has in the image or near it. The core is given, which
/// control points make up for; those that no ray tells of go on straight. Preconditions:
/// is_splined(model), and the core is fx, fy, cx, cy.
std::vector<double> splined_like(const Lens& lens, const std::array<int, 2>& imager_px,
                                 LensModel model, const std::vector<double>& core);

}  // namespace vlp
