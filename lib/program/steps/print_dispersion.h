// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "calibration/dispersion/dispersion.h"

namespace vlp {

/// The circles of the fixes before and after, and what was told apart, on stdout. `captures` are
/// those at known places.
void print_dispersion(const DispersionFit& fit, std::size_t captures);

}  // namespace vlp
