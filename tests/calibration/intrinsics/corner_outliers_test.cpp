// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_outliers.h"

#include <gmock/gmock.h>

#include "calibration/intrinsics/synthetic_views.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// In strongly distorted views exactly the displaced corner is found.
TEST(FindCornerOutliers, ReturnsOnlyTheOneDisplacedCorner) {
  constexpr double noise_px = 0.05, apart_px = 20;
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    const BoardLattice lattice(views.board);
    Random random(11);
    int compared = 0;
    for (int view = 0; view < 40; ++view) {
      const auto seen =
          lattice.list_corners_with_board_positions(views.random_view(random, noise_px));
      ASSERT_THAT(find_corner_outliers(seen), IsEmpty());
      auto spoilt = seen;
      const std::size_t wrong = random.index(seen.size());
      const double v = random.uniform(0, 600), u = random.uniform(0, 800);
      if ((Eigen::Vector2d(u, v) - seen[wrong].pixel).norm() < apart_px) continue;
      spoilt[wrong].pixel = {u, v};
      EXPECT_THAT(find_corner_outliers(spoilt), ElementsAre(wrong)) << view;
      ++compared;
    }
    EXPECT_GT(compared, 0);
  }
}

/// A view that is wrong as a whole has no outliers.
TEST(FindCornerOutliers, ReturnsNoneWhenAllCornersAreRandom) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(12);
  auto corners =
      BoardLattice(views.board).list_corners_with_board_positions(views.random_view(random, 0));
  for (auto& corner : corners) corner.pixel = {random.uniform(0, 800), random.uniform(0, 600)};
  EXPECT_THAT(find_corner_outliers(corners), IsEmpty());
  EXPECT_THAT(find_corner_outliers({}), IsEmpty());
}

}  // namespace
}  // namespace vlp
