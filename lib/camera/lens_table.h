// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "lens_model.h"

namespace vlp {

/// Distortion parameter of a lens model, which follows fx fy cx cy.
struct LensDistortion {
  std::string_view name;
  /// Initial value of the distortion parameter for a solve. With all initial values the lens is
  /// nearly STEREOGRAPHIC. The value is not 0 if 0 is a stationary point of the solve.
  double start = 1e-6;
};

/// Name and parameters of a lens model. Its equations are in camera/lens_model.h.
struct LensModelRow {
  LensModel model;
  std::string_view name;
  std::span<const LensDistortion> distortions;
};

/// Returns the models with fixed names (all except splined lenses), in the order of LensModel.
std::span<const LensModelRow> list_lens_models();

/// Returns the distortions of a model. Empty for a splined lens: its control points have no names
/// and their initial value is 0.
std::span<const LensDistortion> list_distortions(LensModel model);

}  // namespace vlp
