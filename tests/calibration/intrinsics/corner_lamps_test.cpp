// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/corner_lamps.h"

#include <gtest/gtest.h>

#include "calibration/intrinsics/corner_outliers.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Points of a board of tags, as in mrcal's files, have the ids of the same corners of tags.
TEST(MakeCornerLamps, AssignsIdsOfTagCornersToSamePoints) {
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    const BoardLattice lattice(views.board);
    Random random(3);
    BoardDetection tags = views.random_view(random, 0);
    ASSERT_GE(tags.tags.size(), 3U);
    tags.tags[0].corner_sds_px = {0.01, 0.02, 0, 0.04};
    BoardDetection points;
    for (const auto& corner : lattice.list_corners(tags))
      points.points.push_back(
          {lattice.board_point_index(corner.part, corner.point), corner.pixel, 0, 0.5});
    const std::vector<BoardView> seen{{"tags", {800, 600}, tags}, {"points", {800, 600}, points}};
    const CornerLamps lamps = make_corner_lamps(seen, views.board, 0.1, 0.001);
    ASSERT_EQ(lamps.frames.size(), 2U);
    const auto& first = lamps.frames[0].detections;
    const auto& second = lamps.frames[1].detections;
    ASSERT_EQ(first.size(), 4 * tags.tags.size());
    ASSERT_EQ(second.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(first[i].lamp, 4 * tags.tags[i / 4].id + static_cast<int>(i % 4));
      EXPECT_EQ(second[i].lamp, first[i].lamp);
      EXPECT_EQ(second[i].pixel, first[i].pixel);
      EXPECT_EQ(second[i].sigma_px, 0.2);
      const Lamp* const lamp = find_lamp_by_id(lamps.map.lamps, first[i].lamp);
      ASSERT_TRUE(lamp);
      EXPECT_EQ(lamp->sd_m, 0.001);
    }
    EXPECT_EQ(first[1].sigma_px, 0.02);
    EXPECT_EQ(first[2].sigma_px, 0.1);
    EXPECT_EQ(lamps.corners_without_sd, 2 * first.size() - 3);
  }
}

/// Also with one corner in 50 far off.
TEST(EstimateCornerNoisePx, ReturnsNoiseOfViews) {
  constexpr double noise_px = 0.3;
  const SyntheticViews views{synthetic_board(true), synthetic_lens()};
  const BoardLattice lattice(views.board);
  Random random(4);
  std::vector<std::vector<BoardLattice::Corner>> seen;
  for (int i = 0; i < 20; ++i)
    seen.push_back(lattice.list_corners(views.random_view(random, noise_px)));
  EXPECT_NEAR(estimate_corner_noise_px(seen).value(), noise_px, 0.15 * noise_px);
  for (auto& corners : seen) {
    for (auto& corner : corners) corner.weight = 0.5;
    for (std::size_t i = 0; i < corners.size(); i += 50) corners[i].pixel.x() += 5;
  }
  EXPECT_NEAR(estimate_corner_noise_px(seen).value(), noise_px / 2, 0.4 * noise_px / 2);
  for (auto& corners : seen) corners.resize(15);
  EXPECT_FALSE(estimate_corner_noise_px(seen));
}

}  // namespace
}  // namespace vlp
