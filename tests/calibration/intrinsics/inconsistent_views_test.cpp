// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/inconsistent_views.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstddef>
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

TEST(TestViewConsistency, ReturnsViewsOfOtherCamera) {
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
    const InconsistentViews found = test_view_consistency(solution);
    EXPECT_THAT(found.views, ElementsAreArray(foreign));
    EXPECT_EQ(found.num_other_views, kViews - foreign.size());
    EXPECT_GT(found.worst_px, 3 * found.typical_px);
    EXPECT_THAT(describe_bad_views(found, image_names()),
                HasSubstr(std::to_string(foreign.size()) + " board images do not fit the other " +
                          std::to_string(kViews - foreign.size()) + ": 10"));
  }
}

TEST(TestViewConsistency, ReturnsNoViewsForImagesOfOneCamera) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(4);
  for (int set = 0; set < 10; ++set) {
    for (const double noise_px : {0.02, 0.3}) {
      const auto solution = solve_intrinsics(views.input(12 + 2 * set, random, noise_px));
      ASSERT_TRUE(solution.has_succeeded()) << set;
      EXPECT_THAT(test_view_consistency(solution).views, IsEmpty()) << set << ' ' << noise_px;
    }
  }
}

TEST(TestViewConsistency, ReturnsViewsDroppedBySolveOnlyIfSeveral) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  IntrinsicsInput input = views.input(12, random, 0.05);
  for (auto& corner : input.views[4]) corner.pixel.x() += 60 * std::sin(corner.pixel.y() / 15);
  const IntrinsicsSolution one = solve_intrinsics(input);
  ASSERT_TRUE(one.has_succeeded());
  ASSERT_EQ(one.dropped_views.size(), 1U);
  EXPECT_THAT(test_view_consistency(one).views, testing::IsEmpty());
  for (auto& corner : input.views[7]) corner.pixel.x() += 60 * std::sin(corner.pixel.y() / 15);
  const IntrinsicsSolution two = solve_intrinsics(input);
  ASSERT_TRUE(two.has_succeeded());
  const InconsistentViews found = test_view_consistency(two);
  ASSERT_THAT(found.views, testing::ElementsAre(4, 7));
  EXPECT_EQ(describe_bad_views(found, image_names()),
            "2 board images do not fit the other 10: 104.png, 107.png; were they taken by another "
            "camera?");
}

}  // namespace
}  // namespace vlp
