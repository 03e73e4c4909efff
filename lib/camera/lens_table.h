// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

#include "lens_model.h"

namespace vlp {

/// A parameter after fx fy cx cy.
struct LensDistortion {
  std::string_view name;
  /// With which a lens is nearly STEREOGRAPHIC, from where solves start. Not zero where that is a
  /// stationary point.
  double start;
};

/// What a lens model is besides its equations, which are in camera/lens.cpp.
struct LensModelRow {
  LensModel model;
  std::string_view name;
  std::span<const LensDistortion> distortions;
};

/// Those with names of their own, in the order of the enumeration.
std::span<const LensModelRow> lens_models();

/// None of a splined lens: its control points have no names and start at zero.
std::span<const LensDistortion> distortions_of(LensModel model);

}  // namespace vlp
