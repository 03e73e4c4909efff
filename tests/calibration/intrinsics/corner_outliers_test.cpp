// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_outliers.h"

#include <gmock/gmock.h>

#include <cstddef>
#include <vector>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// In strongly distorted views exactly the displaced corner is found.
TEST(ListCornerOutliers, ReturnsOnlyTheOneDisplacedCorner) {
  constexpr double noise_px = 0.05, apart_px = 20;
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    const BoardLattice lattice(views.board);
    Random random(11);
    int compared = 0;
    for (int view = 0; view < 40; ++view) {
      const auto seen = lattice.list_corners(views.random_view(random, noise_px));
      ASSERT_THAT(list_corner_outliers(seen), IsEmpty());
      auto spoilt = seen;
      const std::size_t wrong = random.index(seen.size());
      const double v = random.uniform(0, 600), u = random.uniform(0, 800);
      if ((Eigen::Vector2d(u, v) - seen[wrong].pixel).norm() < apart_px) continue;
      spoilt[wrong].pixel = {u, v};
      EXPECT_THAT(list_corner_outliers(spoilt), ElementsAre(wrong)) << view;
      ++compared;
    }
    EXPECT_GT(compared, 0);
  }
}

/// A view that is wrong as a whole has no outliers.
TEST(ListCornerOutliers, ReturnsNoneWhenAllCornersAreRandom) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(12);
  auto corners = BoardLattice(views.board).list_corners(views.random_view(random, 0));
  for (auto& corner : corners) corner.pixel = {random.uniform(0, 800), random.uniform(0, 600)};
  EXPECT_THAT(list_corner_outliers(corners), IsEmpty());
  EXPECT_THAT(list_corner_outliers({}), IsEmpty());
}

/// Returns the corners of a board of cols x rows points, row by row, at a distance of step_px in
/// the image.
std::vector<BoardLattice::Corner> make_corner_grid(int cols, int rows,
                                                   const Eigen::Vector2d& step_px) {
  std::vector<BoardLattice::Corner> corners;
  for (int row = 0; row < rows; ++row) {
    for (int col = 0; col < cols; ++col) {
      const Eigen::Vector2d node(col, row);
      const Eigen::Vector2d pixel = Eigen::Vector2d(50, 70) + step_px.cwiseProduct(node);
      corners.push_back({{0.03 * col, 0.03 * row, 0}, pixel, 0, corners.size()});
    }
  }
  return corners;
}

TEST(ListCornerOutliers, LimitIsQuarterOfDistanceToNearestNeighbor) {
  constexpr std::size_t middle = 3 * 7 + 3;
  for (const Eigen::Vector2d& step_px : {Eigen::Vector2d(40, 60), Eigen::Vector2d(70, 40)}) {
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-0.6, 0.8)}) {
      auto corners = make_corner_grid(7, 6, step_px);
      corners[middle].pixel += 9.9 * direction;
      EXPECT_THAT(list_corner_outliers(corners), IsEmpty()) << step_px.transpose();
      corners[middle].pixel += 0.2 * direction;
      EXPECT_THAT(list_corner_outliers(corners), ElementsAre(middle)) << step_px.transpose();
    }
  }
}

TEST(ListCornerOutliers, NeedsEightNeighborsAndTenCorners) {
  auto corners = make_corner_grid(5, 2, {40, 50});
  corners[0].pixel.y() -= 80;
  EXPECT_THAT(list_corner_outliers(corners), ElementsAre(0));
  corners.pop_back();
  EXPECT_THAT(list_corner_outliers(corners), IsEmpty());
}

/// Predictions of corners at the rim extrapolate: an outlier beside them displaces these
/// predictions by more than its own displacement.
TEST(ListCornerOutliers, KeepsRimCornerWhosePredictionAnOutlierDisplaces) {
  for (const std::size_t outlier : {8U, 12U, 29U, 33U}) {
    for (const Eigen::Vector2d& shift_px :
         {Eigen::Vector2d(16, 0), Eigen::Vector2d(-12, 11), Eigen::Vector2d(5, -25)}) {
      auto corners = make_corner_grid(7, 6, {40, 45});
      corners[outlier].pixel += shift_px;
      EXPECT_THAT(list_corner_outliers(corners), ElementsAre(outlier)) << shift_px.transpose();
    }
  }
}

}  // namespace
}  // namespace vlp
