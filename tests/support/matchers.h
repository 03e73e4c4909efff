// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <Eigen/Core>

namespace vlp {

/// Matches an Eigen vector or matrix whose entries are all within `tolerance` of `expected`.
MATCHER_P2(IsNear, expected, tolerance, "is near the expected matrix") {
  const double worst = (arg - expected).cwiseAbs().maxCoeff();
  *result_listener << "worst difference " << worst;
  return worst <= tolerance;  // false for NaN
}

/// Expects entries within `tolerance` times the largest entry of `expected`.
inline void expect_relatively_near(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected,
                                   double tolerance) {
  EXPECT_THAT(found, IsNear(expected, tolerance * expected.cwiseAbs().maxCoeff()))
      << found << "\n\n"
      << expected;
}

}  // namespace vlp
