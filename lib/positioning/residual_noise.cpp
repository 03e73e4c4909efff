// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/residual_noise.h"

#include <algorithm>
#include <cmath>

#include "rig/detection.h"

namespace vlp {

std::optional<double> residual_noise_px(std::span<const Fix> fixes) {
  double sum_of_squares = 0, degrees_of_freedom = 0;
  for (const Fix& fix : fixes) {
    if (!fix.ok() || !(fix.redundancy > 0)) continue;
    sum_of_squares += fix.sightings * fix.residual_px * fix.residual_px;
    degrees_of_freedom += fix.redundancy;
  }
  if (!(degrees_of_freedom > 0)) return std::nullopt;
  return std::clamp(std::sqrt(sum_of_squares / degrees_of_freedom), kMinSigma_px, kMaxSigma_px);
}

}  // namespace vlp
