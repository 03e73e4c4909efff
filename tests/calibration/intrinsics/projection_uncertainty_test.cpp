// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_uncertainty.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(ProjectionUncertainty, MaxProjectionSdIsLargerForFrontalThanForTiltedViews) {
  SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  const auto tilted = solve_intrinsics(views.input(12, random, 0.1));
  views.tilt_rad = 0.12;
  const auto frontal = solve_intrinsics(views.input(12, random, 0.1));
  ASSERT_TRUE(tilted.has_succeeded());
  ASSERT_TRUE(frontal.has_succeeded());
  const Eigen::Vector2d place(700, 80);
  EXPECT_GT(ProjectionUncertainty(frontal).projection_sd_along_worst_direction_px(place),
            5 * ProjectionUncertainty(tilted).projection_sd_along_worst_direction_px(place));
}

TEST(ProjectionUncertainty, IntrinsicsRegularizationBiasMatchesNegativeFocalLengthError) {
  // 110 degrees: the coefficients are far from zero, and the corner noise is a fiftieth of that for
  // which mrcal scales the regularization.
  const std::array wide{416.7,  416.9,  398.2,     302.1,   0.733348, 0.0897113,
                        0.0001, 0.0002, 0.0009234, 1.06639, 0.246743, 0.00924612};
  const SyntheticViews views{synthetic_board(false), Lens(LensModel::opencv8, wide)};
  Random random(3);
  const auto solution = solve_intrinsics(views.input(30, random, 0.02));
  ASSERT_TRUE(solution.has_succeeded());
  const ProjectionUncertainty uncertainty(solution);
  const Eigen::VectorXd& pull = uncertainty.intrinsics_regularization_bias();
  const double focal_off_px = solution.problem.intrinsics[0] - wide[0];
  const double noise_px = std::sqrt(uncertainty.intrinsics_covariance()(0, 0));
  EXPECT_GT(std::abs(focal_off_px), 5 * noise_px);
  EXPECT_NEAR(focal_off_px, -pull[0], 0.4 * std::abs(focal_off_px));
}

TEST(ProjectionUncertainty, IntrinsicsRegularizationBiasIsZeroForFisheye) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  IntrinsicsInput input = views.input(12, random, 0.1);
  input.lens_model = LensModel::fisheye;
  const auto solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_EQ(ProjectionUncertainty(solution).intrinsics_regularization_bias(),
            Eigen::VectorXd::Zero(8));
}

TEST(ProjectionUncertainty, MaxProjectionSdMatchesMrcalForIndependentCorners) {
  if (run_program("/usr/bin/python3 -c 'import mrcal'").exit_code != 0) {
    GTEST_SKIP() << "mrcal for Python is not installed";
  }
  const TemporaryFolder folder;
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    Random random(8);
    const auto solution = solve_intrinsics(views.input(20, random, 0.05));
    ASSERT_TRUE(solution.has_succeeded());
    write_mrcal_cameramodel(folder / "camera.cameramodel", solution);
    const auto mrcals =
        run_program("/usr/bin/python3 -c \"import mrcal, numpy as np; m = mrcal.cameramodel('" +
                    (folder / "camera.cameramodel").string() +
                    "'); print(mrcal.projection_uncertainty(mrcal.unproject(np.array((790, 10), "
                    "float), *m.intrinsics()), m, atinfinity = True, "
                    "what = 'worstdirection-stdev'))\"");
    ASSERT_EQ(mrcals.exit_code, 0) << mrcals.errors;
    const double ours =
        ProjectionUncertainty(solution).projection_sd_along_worst_direction_px({790, 10});
    EXPECT_NEAR(std::stod(mrcals.output), ours, 1e-6 * ours);
  }
}

TEST(ProjectionUncertainty, SdByTagsMatchesSdByCornersForIndependentErrors) {
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    Random random(4);
    const IntrinsicsInput input = views.input(30, random, 0.1);
    const auto solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    const ProjectionUncertainty by_corners(solution), by_tags(solution, input.lattice);
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(400, 300), Eigen::Vector2d(40, 80)}) {
      EXPECT_NEAR(by_tags.projection_sd_along_worst_direction_px(pixel) /
                      by_corners.projection_sd_along_worst_direction_px(pixel),
                  1, 0.2);
    }
  }
}

TEST(ComputeLensCalibrationReport, DifferenceOfHalvesMatchesTwiceExpectedRms) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  const IntrinsicsInput input = views.input(24, random, 0.1);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  const CalibrationReport report = compute_lens_calibration_report(solution, input);
  ASSERT_TRUE(report.split_half_difference);
  // Twice the difference from the truth, within a factor for the few degrees of freedom.
  EXPECT_LT(report.split_half_difference->rms_px, 2.5 * 2 * report.expected_rms_px);
  EXPECT_GT(report.split_half_difference->rms_px, 0.3 * 2 * report.expected_rms_px);
}

TEST(EvaluateLensOnHeldOutViews, RmsOfHeldOutViewsMatchesCornerNoise) {
  SyntheticViews views{synthetic_board(true), synthetic_lens()};
  views.warp_m = {0.0006, 0.0004};
  Random random(6);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(20, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  const HeldOutFit held_out =
      evaluate_lens_on_held_out_views(solution, views.input(6, random, 0.05));
  EXPECT_EQ(held_out.views, 6);
  EXPECT_NEAR(held_out.rms_px, 0.05, 0.006);
}

TEST(RecommendNextBoardView, NamesImagePartWithFewestCornersAndLeastTiltedSide) {
  ViewCoverage coverage;
  coverage.corners = {9, 9, 9, 9, 9, 2, 9, 9, 9};
  coverage.tilts_rad = {0.5, 0.6, 0.1, 0.5};
  EXPECT_EQ(recommend_next_board_view(coverage),
            "the board in the right middle of the image, its upper side 30 to 40 degrees nearer to "
            "the camera");
}

TEST(ComputeBoardViewCoverage, ReturnsTiltOnlyForSideNearerToCamera) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(9);
  const IntrinsicsInput input = views.input(12, random, 0);
  IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  solution.problem.poses.resize(1);
  solution.problem.poses[0].rotation = {0, 0.3, 0};  // its right comes nearer
  const auto [left, right, upper, lower] = compute_board_view_coverage(solution, input).tilts_rad;
  EXPECT_EQ(left, 0);
  EXPECT_NEAR(right, 0.3, 1e-9);
  EXPECT_NEAR(upper, 0, 1e-9);
  EXPECT_NEAR(lower, 0, 1e-9);
}

}  // namespace
}  // namespace vlp
