// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/inconsistent_views.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "synthetic_views.h"

namespace vlp {
namespace {

using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kViews = 36;
constexpr double kNoise_px = 0.02;

/// Returns a lens similar to synthetic_lens(): focal length 2 % shorter, principal point 9 px away.
Lens other_lens() {
  const std::array parameters{509.0,  510.0,   407.0,  304.0, -0.25, 0.08,
                              0.0002, -0.0001, -0.012, 0.01,  0.002, 0.0001};
  return Lens(LensModel::opencv8, parameters);
}

std::vector<std::string> image_names() {
  std::vector<std::string> names;
  for (int i = 0; i < kViews; ++i) names.push_back(std::to_string(100 + i) + ".png");
  return names;
}

TEST(FindViewsInconsistentWithLens, ReturnsViewsOfOtherCamera) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  const SyntheticViews others{synthetic_board(false), other_lens()};
  Random random(3);
  for (const std::vector<std::size_t>& foreign :
       {std::vector<std::size_t>{5, 13, 27}, {1, 5, 9, 13, 17, 21, 25, 33}}) {
    IntrinsicsInput input = views.input(kViews, random, kNoise_px);
    const IntrinsicsInput other = others.input(kViews, random, kNoise_px);
    for (const std::size_t view : foreign) input.views[view] = other.views[view];
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    const InconsistentViews found = find_views_inconsistent_with_lens(solution);
    EXPECT_THAT(found.views, ElementsAreArray(foreign));
    EXPECT_EQ(found.num_other_views, kViews - foreign.size());
    EXPECT_GT(found.worst_px, 3 * found.typical_px);
    EXPECT_THAT(describe_inconsistent_views(found, image_names()),
                HasSubstr(std::to_string(foreign.size()) + " board images do not fit the other " +
                          std::to_string(kViews - foreign.size()) + ": 10"));
  }
}

TEST(FindViewsInconsistentWithLens, ReturnsNoneForOneCamera) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(4);
  for (int set = 0; set < 10; ++set) {
    for (const double noise_px : {0.02, 0.3}) {
      const auto solution = solve_intrinsics(views.input(12 + 2 * set, random, noise_px));
      ASSERT_TRUE(solution.has_succeeded()) << set;
      EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, IsEmpty())
          << set << ' ' << noise_px;
    }
  }
}

TEST(FindViewsInconsistentWithLens, ReturnsViewsDroppedBySolveOnlyIfSeveral) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  IntrinsicsInput input = views.input(12, random, 0.05);
  for (auto& corner : input.views[4]) corner.pixel.x() += 60 * std::sin(corner.pixel.y() / 15);
  const IntrinsicsSolution one = solve_intrinsics(input);
  ASSERT_TRUE(one.has_succeeded());
  ASSERT_EQ(one.dropped_views.size(), 1U);
  EXPECT_THAT(find_views_inconsistent_with_lens(one).views, testing::IsEmpty());
  for (auto& corner : input.views[7]) corner.pixel.x() += 60 * std::sin(corner.pixel.y() / 15);
  const IntrinsicsSolution two = solve_intrinsics(input);
  ASSERT_TRUE(two.has_succeeded());
  const InconsistentViews found = find_views_inconsistent_with_lens(two);
  ASSERT_THAT(found.views, testing::ElementsAre(4, 7));
  EXPECT_EQ(describe_inconsistent_views(found, image_names()),
            "2 board images do not fit the other 10: 104.png, 107.png; were they taken by another "
            "camera?");
}

/// Number of points of a view of make_solution(): two boards of 5 x 4 points.
constexpr std::size_t kPointsPerView = 40;

/// Returns a solution whose view i has residuals of residuals_px[i] at all points, and no outliers.
IntrinsicsSolution make_solution(const std::vector<double>& residuals_px) {
  IntrinsicsSolution solution{};
  BoardProblem& problem = solution.problem;
  problem.lens_model = LensModel::pinhole;
  problem.intrinsics = {500, 500, 400, 300};
  problem.imager_px = {800, 600};
  problem.cols = 5;
  problem.rows = 4;
  problem.spacing_m = 0.02;
  for (std::size_t view = 0; view < residuals_px.size(); ++view) {
    solution.views.push_back(10 + view);
    for (std::size_t board = 0; board < 2; ++board) {
      problem.poses.push_back({{0.1, 0.2, 0.3}, {0.01, -0.02, 0.5}});
    }
  }
  problem.points.assign(kPointsPerView * residuals_px.size(), {0, 0, 1});
  const auto projected = compute_reprojection_residuals(problem);
  for (std::size_t i = 0; i < projected.size(); ++i) {
    const double residual_px = residuals_px[i / kPointsPerView];
    problem.points[i].head<2>() = residual_px * Eigen::Vector2d(0.6, -0.8) - projected[i];
  }
  return solution;
}

void mark_outliers(IntrinsicsSolution& solution, std::size_t view, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    solution.problem.points[view * kPointsPerView + 7 * i % kPointsPerView].z() = -0.5;
}

TEST(FindViewsInconsistentWithLens, NeedsThreeTimesTypicalResidual) {
  IntrinsicsSolution solution = make_solution({0.1, 0.12, 0.38, 0.1, 0.34, 0.1, 0.09, 0.4});
  for (const std::size_t view : {1U, 2U, 4U, 7U}) mark_outliers(solution, view, 12);
  const InconsistentViews found = find_views_inconsistent_with_lens(solution);
  EXPECT_THAT(found.views, testing::ElementsAre(12, 17));
  EXPECT_EQ(found.num_other_views, 6U);
  EXPECT_NEAR(found.typical_px, 0.12, 1e-9);
  EXPECT_NEAR(found.worst_px, 0.4, 1e-9);
}

TEST(FindViewsInconsistentWithLens, WorstIsLargestMedianOfFoundViews) {
  IntrinsicsSolution solution = make_solution({0.5, 0.1, 0.4, 0.1, 0.1, 0.1});
  for (const std::size_t view : {0U, 2U}) mark_outliers(solution, view, 12);
  const InconsistentViews found = find_views_inconsistent_with_lens(solution);
  EXPECT_THAT(found.views, testing::ElementsAre(10, 12));
  EXPECT_NEAR(found.worst_px, 0.5, 1e-9);
}

TEST(FindViewsInconsistentWithLens, NeedsOutliersOfTenthOfCorners) {
  IntrinsicsSolution solution = make_solution({0.1, 0.5, 0.1, 0.5, 0.1});
  mark_outliers(solution, 1, 4);
  mark_outliers(solution, 3, 3);
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, testing::ElementsAre(11));
}

/// Half of the points are not seen or not projected: of the other 20, 2 are outliers.
TEST(FindViewsInconsistentWithLens, CountsOnlyPointsThatAreSeenAndProjected) {
  IntrinsicsSolution solution = make_solution({0.1, 0.5, 0.1, 0.1, 0.1});
  mark_outliers(solution, 1, 2);
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, IsEmpty());
  for (std::size_t i = 20; i < 30; ++i)
    solution.problem.points[kPointsPerView + i].z() = BoardProblem::kUnseen;
  for (std::size_t i = 30; i < 40; ++i)
    solution.problem.points[kPointsPerView + i].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, testing::ElementsAre(11));
  for (std::size_t i = 0; i < 40; ++i)
    solution.problem.points[kPointsPerView + i].z() = BoardProblem::kUnseen;
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, IsEmpty());
}

TEST(FindViewsInconsistentWithLens, ReturnsNoneIfHalfOfViewsAreFound) {
  IntrinsicsSolution solution = make_solution({0.1, 0.1, 0.1, 0.5, 0.5});
  for (const std::size_t view : {3U, 4U}) mark_outliers(solution, view, 12);
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, testing::ElementsAre(13, 14));
  solution.dropped_views = {{3, 1}};
  const InconsistentViews found = find_views_inconsistent_with_lens(solution);
  EXPECT_THAT(found.views, IsEmpty());
  EXPECT_EQ(found.num_other_views, 0U);
}

TEST(FindViewsInconsistentWithLens, ReturnsSingleDroppedViewOnlyWithAnotherView) {
  IntrinsicsSolution solution = make_solution({0.1, 0.1, 0.1, 0.5, 0.1});
  solution.dropped_views = {{3, 1}};
  EXPECT_THAT(find_views_inconsistent_with_lens(solution).views, IsEmpty());
  mark_outliers(solution, 3, 12);
  const InconsistentViews found = find_views_inconsistent_with_lens(solution);
  EXPECT_THAT(found.views, testing::ElementsAre(3, 13));
  EXPECT_EQ(found.num_other_views, 4U);
  EXPECT_EQ(found.worst_px, std::numeric_limits<double>::infinity());
}

TEST(DescribeInconsistentViews, StatesResidualsAndSingularForOneView) {
  EXPECT_EQ(describe_inconsistent_views({{2}, 7, 1.234, 0.1}, image_names()),
            "1 board image does not fit the other 7: 102.png (residuals up to 1.23 px, the others "
            "0.10); was it taken by another camera?");
}

TEST(DescribeInconsistentViews, NamesTwelveImagesAtMost) {
  InconsistentViews found{{}, 20, INFINITY, 0.1};
  for (std::size_t view = 0; view < 12; ++view) found.views.push_back(view);
  const std::string twelve =
      "100.png, 101.png, 102.png, 103.png, 104.png, 105.png, 106.png, 107.png, 108.png, 109.png, "
      "110.png, 111.png";
  EXPECT_EQ(describe_inconsistent_views(found, image_names()),
            "12 board images do not fit the other 20: " + twelve +
                "; were they taken by another camera?");
  found.views.insert(found.views.end(), {12, 13});
  EXPECT_EQ(describe_inconsistent_views(found, image_names()),
            "14 board images do not fit the other 20: " + twelve +
                " and 2 more; were they taken by another camera?");
}

}  // namespace
}  // namespace vlp
