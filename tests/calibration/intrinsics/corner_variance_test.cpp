// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// What corners are good for, by their residuals, and lenses from corners that are not all as good.
#include "calibration/intrinsics/corner_variance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

/// Corners known to 0.01 to 0.1 px by their pixels.
std::vector<CornerError> errors_of(const CornerVariance& truth, Random& random) {
  std::vector<CornerError> errors;
  for (int i = 0; i < 4000; ++i) {
    const double sd_px = 0.01 * std::pow(10, random.uniform(0, 1));
    const double off_px = std::sqrt(truth.of(sd_px));
    const Eigen::Vector2d residual = off_px * Eigen::Vector2d(random.normal(), random.normal());
    errors.push_back({residual.squaredNorm() / 2, sd_px});
  }
  return errors;
}

TEST(CornerVariances, AreOfTheNoiseAndOfTheRest) {
  Random random(1);
  for (const auto& [rest_px, scale] :
       {std::pair{0.02, 1.2}, {0.0, 1.0}, {0.05, 0.0}, {0.2, 1.0}, {0.005, 2.0}}) {
    const CornerVariance truth{rest_px * rest_px, scale * scale};
    const CornerVariance found = corner_variance(errors_of(truth, random));
    for (const double sd_px : {0.01, 0.03, 0.1}) {
      EXPECT_NEAR(std::sqrt(found.of(sd_px) / truth.of(sd_px)), 1, 0.08)
          << rest_px << " " << scale << " " << sd_px;
    }
  }
}

TEST(CornerVariances, AreNotThoseOfAFewOutliers) {
  Random random(2);
  const CornerVariance truth{1e-4, 1};
  auto errors = errors_of(truth, random);
  for (std::size_t i = 0; i < errors.size(); i += 100) errors[i].square_px2 = 4;
  const CornerVariance found = corner_variance(errors);
  for (const double sd_px : {0.01, 0.1}) {
    EXPECT_NEAR(std::sqrt(found.of(sd_px) / truth.of(sd_px)), 1, 0.15);
  }
}

TEST(CornerVariances, OfCornersThatAreAllAsGoodAreOne) {
  const std::vector<CornerError> errors{{4e-4, 0.01}, {1e-4, 0.01}, {1e-4, 0.01}};
  EXPECT_NEAR(corner_variance(errors).of(0.01), 2e-4, 1e-9);
}

/// Least squares of corners that know how good they are, or do not.
TEST(CornerVariances, MakeTheBestOfCorners) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  double told_px2 = 0, untold_px2 = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Random random(seed);
    IntrinsicsInput input = views.input(16, random, 0);
    input.warp = WarpChoice::off;
    for (auto& view : input.views) {
      for (auto& corner : view) {
        // From the middle to a corner of the image.
        const double off = (corner.pixel - Eigen::Vector2d(400, 300)).norm() / 500;
        corner.sd_px = 0.01 * std::exp(3 * off);
        corner.pixel += corner.sd_px * Eigen::Vector2d(random.normal(), random.normal());
      }
    }
    const auto square_px2 = [&] {
      const IntrinsicsSolution solution = solve_intrinsics(input);
      EXPECT_TRUE(solution.ok());
      const auto difference =
          projection_difference(views.lens, solution.lens(), views.imager_px, even);
      return std::pow(difference->rms_px, 2);
    };
    told_px2 += square_px2();
    for (auto& view : input.views) {
      for (auto& corner : view) corner.sd_px = 0;
    }
    untold_px2 += square_px2();
  }
  EXPECT_LT(std::sqrt(told_px2 / untold_px2), 0.85);
  RecordProperty("told_over_untold", std::to_string(std::sqrt(told_px2 / untold_px2)));
}

/// Their mean square is 1, so that what is left is in px.
TEST(CornerVariances, LeaveResidualsInPixels) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  IntrinsicsInput input = views.input(16, random, 0.05);
  const IntrinsicsSolution untold = solve_intrinsics(input);
  double sd_px = 0.01;
  for (auto& view : input.views) {
    for (auto& corner : view)
      corner.sd_px = sd_px = 0.04 - sd_px;  // which has nothing to do with it
  }
  const IntrinsicsSolution told = solve_intrinsics(input);
  ASSERT_TRUE(told.ok() && untold.ok());
  EXPECT_NEAR(told.rms_px, untold.rms_px, 0.02 * untold.rms_px);
}

}  // namespace
}  // namespace vlp
