// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "rig/calibration.h"

namespace vlp {

/// ", sd X Y UNIT" of a covariance, times a factor.
std::string sd_of(const std::optional<Matrix2>& covariance, double factor, const char* unit);

/// Centre, zenith and tilt on stdout, with what they are worth.
void print_center(const RotationCenter& center, const Camera& camera);

}  // namespace vlp
