// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Splined lenses, estimated from the corners of boards seen through a fisheye of 190 degrees.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/projection_uncertainty.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/valid_region.h"
#include "calibration/intrinsics/wide_views.h"
#include "camera/spline_grid.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

constexpr LensModel kSplined = splined_lens_model({3, 14, 14, 205});

/// Returns boards all over the image of a lens with rays up to 100 degrees off its axis.
IntrinsicsInput splined_input(int count, Random& random, double noise_px) {
  const WideBoards boards{0.1, 0.2, 100 * std::numbers::pi / 180, true};
  IntrinsicsInput input = wide_input(false, count, random, noise_px, {0, 0}, boards);
  input.lens_model = kSplined;
  return input;
}

TEST(SolveSplinedLens, MatchesTrueLensUpTo94DegreesOffAxis) {
  constexpr double noise_px = 0.02;  // as in rendered boards
  Random random(18);
  const auto input = splined_input(40, random, noise_px);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded()) << describe_status(solution.status);
  EXPECT_EQ(solution.views.size(), 40U);
  EXPECT_FALSE(solution.solved_parameters.core);
  EXPECT_NEAR(solution.rms_px, noise_px, 0.003);
  EXPECT_NEAR(solution.problem.noise_px, noise_px, 0.005);
  EXPECT_LT(up_to(90, solution.fitted_lens()).mean_px, 0.03);
  EXPECT_LT(up_to(94, solution.fitted_lens()).worst_px, 0.1);
  const CalibrationReport report = make_lens_report(solution, input);
  EXPECT_LT(report.uncertainty_mean_px, 0.05);
  ASSERT_TRUE(report.split_half_difference);
  EXPECT_LT(report.split_half_difference->mean_px, 0.1);
  // The frame is that of the true lens, which is symmetric.
  const auto turn =
      fit_lens_rotation(wide_lens(), solution.fitted_lens(), list_inlier_pixels(solution.problem));
  ASSERT_TRUE(turn);
  EXPECT_LT(Eigen::AngleAxisd(*turn).angle() * 180 / std::numbers::pi, 0.02);
  EXPECT_NEAR(solution.fitted_lens().principal_point_px().x(), 501, 0.2);
  EXPECT_NEAR(solution.fitted_lens().principal_point_px().y(), 498, 0.2);
  const ProjectionUncertainty uncertainty(solution);
  EXPECT_EQ(uncertainty.intrinsics_covariance().topRows<4>().norm(), 0);
}

// The edge of a tag at a slant may be misdetected. Near the rim, where corners are sparse, a
// splined lens would overfit it.
TEST(SolveSplinedLens, RejectsWholeTagsWithDisplacedEdgeAsOutliers) {
  constexpr double noise_px = 0.02, displacement_px = 2.5;
  constexpr std::size_t count = 40, corners_per_tag = 4;
  Random random(18);
  auto input = splined_input(count, random, noise_px);
  for (std::size_t view = 0; view < count; view += 8) {
    // Two corners of the tag that is farthest out.
    auto& corners = input.views[view];
    std::size_t farthest = 0;
    const auto off_axis_px = [&](std::size_t k) {
      return (corners[k].pixel - wide_lens().principal_point_px()).norm();
    };
    for (std::size_t k = 0; k < corners.size(); k += corners_per_tag) {
      if (off_axis_px(k) > off_axis_px(farthest)) farthest = k;
    }
    corners[farthest].pixel.x() += displacement_px;
    corners[farthest + 1].pixel.x() += displacement_px;
  }
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded()) << describe_status(solution.status);
  EXPECT_GE(solution.outliers, 20);  // the tags whole
  EXPECT_LT(up_to(90, solution.fitted_lens()).mean_px, 0.03);
  EXPECT_LT(up_to(94, solution.fitted_lens()).worst_px, 0.15);
}

TEST(SolveSplinedLens, FailsWhenGridIsNarrowerThanFieldOfView) {
  Random random(19);
  IntrinsicsInput input = splined_input(12, random, 0.05);
  input.lens_model = splined_lens_model({3, 10, 10, 120});
  const IntrinsicsSolution solution = solve_intrinsics(input);
  EXPECT_FALSE(solution.has_succeeded());
}

// Outliers are found with OPENCV_FISHEYE, which does not quite fit this lens. That alone rejects no
// tag. Tags with a displaced edge are rejected, by that test or as outliers of mrcal.
TEST(SolveSplinedLens, RejectsOnlyDisplacedTagsWhenFisheyeModelFitsPoorly) {
  constexpr double noise_px = 0.02, displacement_px = 2.5;
  constexpr std::size_t count = 40, corners_per_tag = 4;
  Random random(18);
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  IntrinsicsInput input = views.input(count, random, noise_px);
  input.lens_model = splined_lens_model({3, 14, 11, 90});
  const IntrinsicsSolution good = solve_intrinsics(input);
  ASSERT_TRUE(good.has_succeeded()) << describe_status(good.status);
  EXPECT_EQ(good.outliers, 0);
  for (std::size_t view = 0; view < count; view += 8) {
    auto& corners = input.views[view];
    const auto off_axis_px = [&](std::size_t k) {
      return (corners[k].pixel - views.lens.principal_point_px()).norm();
    };
    std::size_t farthest = 0;
    for (std::size_t k = 0; k < corners.size(); k += corners_per_tag) {
      if (off_axis_px(k) > off_axis_px(farthest)) farthest = k;
    }
    corners[farthest].pixel.x() += displacement_px;
    corners[farthest + 1].pixel.x() += displacement_px;
  }
  const IntrinsicsSolution slipped = solve_intrinsics(input);
  ASSERT_TRUE(slipped.has_succeeded()) << describe_status(slipped.status);
  EXPECT_GE(slipped.outliers, 20);  // the tags whole
  const ImageRegion region = make_valid_region(list_inlier_pixels(slipped.problem), input.imager_px,
                                               slipped.fitted_lens());
  const auto difference = compare_projections(
      views.lens, slipped.fitted_lens(), input.imager_px, [&](const Eigen::Vector2d& pixel) {
        return polygon_contains(region, pixel) ? 1.0 : INFINITY;
      });
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->mean_px, 0.03);
  EXPECT_LT(difference->worst_px, 0.15);
}

/// Returns the mean rotation of the boards from one solution to another, in the camera frame.
Eigen::Vector3d mean_turn(const IntrinsicsSolution& from, const IntrinsicsSolution& to) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < from.problem.poses.size(); ++i) {
    const Eigen::AngleAxisd turn(rotation_from_vector(to.problem.poses[i].rotation) *
                                 rotation_from_vector(from.problem.poses[i].rotation).transpose());
    sum += turn.angle() * turn.axis();
  }
  return sum / static_cast<double>(from.problem.poses.size());
}

// Compares projections of twenty seeds of noise on the same boards with the reported uncertainty.
TEST(ProjectionUncertainty, ProjectionCovarianceMatchesScatterOfSplinedLens) {
  constexpr int seeds = 20;
  constexpr double noise_px = 0.1;
  Random of_boards(41);
  IntrinsicsInput exact = splined_input(16, of_boards, 0);
  exact.lens_model = splined_lens_model({3, 10, 10, 205});
  exact.warp = WarpChoice::off;
  const auto solved = [&](std::uint64_t seed) {
    IntrinsicsInput input = exact;
    Random random(seed);
    for (auto& view : input.views) {
      for (auto& corner : view) {
        const double v = random.normal(), u = random.normal();
        corner.pixel += noise_px * Eigen::Vector2d(u, v);
      }
    }
    return solve_intrinsics(input);
  };
  std::vector<IntrinsicsSolution> solutions;
  for (int seed = 0; seed < seeds; ++seed) {
    solutions.push_back(solved(300 + static_cast<std::uint64_t>(seed)));
    ASSERT_TRUE(solutions.back().has_succeeded());
  }
  // Relative to their mean, because a common bias is not part of the uncertainty.
  const IntrinsicsSolution& first = solutions.front();
  const ProjectionUncertainty uncertainty(first);
  const Lens lens = first.fitted_lens();
  double squares = 0, freedoms = 0;
  for (const Eigen::Vector2d& pixel : make_pixel_grid(kWideImager)) {
    const auto ray = lens.unproject_pixel(pixel);
    if (!ray || ray->direction.normalized().z() < 0) continue;
    std::vector<Eigen::Vector2d> seen;
    Eigen::Vector2d mean(0, 0);
    for (const IntrinsicsSolution& solution : solutions) {
      const Eigen::Vector3d turned =
          rotation_from_vector(mean_turn(first, solution)) * ray->direction;
      seen.push_back(solution.fitted_lens().project_point(turned).value());
      mean += seen.back() / seeds;
    }
    const Eigen::Matrix2d information = uncertainty.projection_covariance(pixel).inverse();
    for (const Eigen::Vector2d& one : seen) squares += (one - mean).dot(information * (one - mean));
    freedoms += 2 * (seeds - 1);
  }
  EXPECT_NEAR(squares / freedoms, 1, 0.25);
}

}  // namespace
}  // namespace vlp
