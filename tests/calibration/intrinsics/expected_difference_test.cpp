// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/view_jackknife.h"

namespace vlp {
namespace {

constexpr int kSeeds = 20;
constexpr double kNoise = 0.1;

/// Mean squares, over the seeds, of the differences from the truth and of the expected differences.
struct Scatter {
  double found = 0, by_noise = 0, by_views = 0, degrees_of_freedom = 0;
  double worst_found = 0, worst_by_noise = 0;
};

/// The board of each view may have another warp, which no model of the solver includes.
Scatter scatter(double bent_m) {
  Scatter sum;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Random random(100 + static_cast<std::uint64_t>(seed));
    SyntheticViews views{synthetic_board(seed % 2 == 1), synthetic_lens()};
    IntrinsicsInput input = views.input(0, random, 0);
    while (input.views.size() < 25) {
      views.warp_m = bent_m * Eigen::Vector2d{random.normal(), random.normal()};
      input.views.push_back(views.input(1, random, kNoise).views[0]);
    }
    const IntrinsicsSolution solution = solve_intrinsics(input);
    EXPECT_TRUE(solution.has_succeeded());
    const Lens lens = solution.fitted_lens();
    const ProjectionDifference difference =
        compare_projections(views.lens, lens, views.imager_px, [](const auto&) {
          return 1;
        }).value();
    const auto noise = predict_difference(lens, views.imager_px,
                                          ProjectionUncertainty(solution).intrinsics_covariance());
    const auto by_views = predict_difference(lens, views.imager_px, jackknife_covariance(solution));
    sum.found += difference.rms_px * difference.rms_px / kSeeds;
    sum.by_noise += noise.rms_px * noise.rms_px / kSeeds;
    sum.by_views += by_views.rms_px * by_views.rms_px / kSeeds;
    sum.degrees_of_freedom += noise.degrees_of_freedom;
    const double worst_px = predict_max_difference_px(
        lens, views.imager_px, ProjectionUncertainty(solution).intrinsics_covariance());
    sum.worst_found += difference.worst_px * difference.worst_px / kSeeds;
    sum.worst_by_noise += worst_px * worst_px / kSeeds;
  }
  return sum;
}

// A mean square of n terms has the relative standard deviation sqrt(2 / n); the limit is three
// times that.
TEST(PredictDifference, MatchesActualLensErrorForPixelNoise) {
  const Scatter of = scatter(0);
  const double sd = std::sqrt(2 / of.degrees_of_freedom);
  EXPECT_LT(sd, 0.3);
  EXPECT_NEAR(of.found / of.by_noise, 1, 3 * sd);
  // A single pixel has fewer independent terms: as many as there are lenses.
  EXPECT_NEAR(of.worst_found / of.worst_by_noise, 1, 3 * std::sqrt(2.0 / kSeeds));
  // Views have independent noise here, so that the jackknife estimates the same, with a positive
  // bias.
  EXPECT_GT(of.by_views / of.by_noise, 0.7);
  EXPECT_LT(of.by_views / of.by_noise, 2.5);
}

TEST(JackknifeCovariance, CoversErrorsOfBoardWarpThatVariesPerView) {
  const Scatter of = scatter(0.0005);
  const double sd = std::sqrt(2 / of.degrees_of_freedom);
  EXPECT_GT(of.found / of.by_noise, 1 + 3 * sd);  // noise alone does not explain it
  EXPECT_LT(of.found / of.by_views, 1 + 3 * sd);
  EXPECT_GT(of.found / of.by_views, 0.3);
}

}  // namespace
}  // namespace vlp
