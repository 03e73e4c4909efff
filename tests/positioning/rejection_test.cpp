// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Wrong identities: rejected by a majority; without a majority there is no fix.
#include <gtest/gtest.h>

#include <algorithm>

#include "positioning/positioner.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

class PositionerOutlierRejection : public testing::Test {
 protected:
  SyntheticRig rig{
      synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, -0.05, 0}, 0.4}, {}};
  Random random{31};

  std::vector<Detection> seen(std::size_t lamps) {
    auto detections = with_noise(seen_from(rig, 0.2), random);
    detections.resize(lamps);
    return detections;
  }
  Fix locate(const std::vector<Detection>& detections) {
    return Positioner(rig.map, rig.calibration).compute_position_fix(detections);
  }
  void expect_truth(const Fix& fix) {
    ASSERT_TRUE(fix.has_succeeded()) << fix_status_name(fix.status);
    EXPECT_THAT(fix.state.pose.position_m, IsNear(rig.camera.position_m, 0.005));
  }
};

TEST_F(PositionerOutlierRejection, RejectsOneMisidentifiedLampOfFour) {
  // The map has eight lamps; one of the four detected ones gets the id of an undetected one.
  for (std::size_t wrong = 0; wrong < 4; ++wrong) {
    for (int id = 5; id <= 8; ++id) {
      auto detections = seen(4);
      const int right_id = detections[wrong].lamp;
      detections[wrong].lamp = id;
      const Fix fix = locate(detections);
      SCOPED_TRACE(testing::Message() << "lamp " << right_id << " taken for " << id);
      expect_truth(fix);
      EXPECT_EQ(fix.lamps, 3);
      EXPECT_EQ(fix.rejected_lamps, 1);
      EXPECT_EQ(fix.rejected_ids[0], id);
    }
  }
}

TEST_F(PositionerOutlierRejection, RejectsTwoSwappedLampsOfFiveOrMore) {
  for (const std::size_t count : {5u, 6u, 8u}) {
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        auto detections = seen(count);
        std::swap(detections[a].lamp, detections[b].lamp);
        SCOPED_TRACE(testing::Message() << a << " and " << b << " of " << count);
        const Fix fix = locate(detections);
        expect_truth(fix);
        EXPECT_EQ(fix.rejected_lamps, 2);
      }
    }
  }
}

/// The fix lists 32 ids of rejected lamps.
TEST_F(PositionerOutlierRejection, ListsFirst32IdsButCountsAllRejectedLamps) {
  std::vector<Eigen::Vector3d> positions_m;
  for (int i = 0; i < 100; ++i) {
    positions_m.emplace_back(0.15 * (i % 10) - 0.7, 0.1 * (i / 10) - 0.5, 1.6);
  }
  rig.map = make_lamp_map(positions_m);
  for (const int wrong : {1, 40}) {
    auto detections = seen(100);
    for (int i = 0; i < wrong; ++i) {
      detections[static_cast<std::size_t>(2 * i)].pixel += Eigen::Vector2d(60 + 3 * i, 40 - 2 * i);
    }
    const Fix fix = locate(detections);
    expect_truth(fix);
    EXPECT_EQ(fix.lamps, 100 - wrong);
    EXPECT_EQ(fix.rejected_lamps, wrong);
    for (int i = 0; i < std::ssize(fix.rejected_ids); ++i) {
      EXPECT_EQ(fix.rejected_ids[static_cast<std::size_t>(i)], i < wrong ? 2 * i + 1 : 0);
    }
  }
}

TEST_F(PositionerOutlierRejection, RejectsOutlierForLampsAtManyHeightsAndTiltedCamera) {
  for (std::size_t i = 0; i < rig.map.lamps.size(); ++i) {
    rig.map.lamps[i].position_m.z() += i % 2 ? 0.3 : -0.1;
  }
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.04, 2);
  for (std::size_t wrong = 0; wrong < 8; ++wrong) {
    auto detections = seen(8);
    detections[wrong].pixel += Eigen::Vector2d(120, -90);  // a reflection, say
    const Fix fix = locate(detections);
    SCOPED_TRACE(wrong);
    expect_truth(fix);
    EXPECT_EQ(fix.rejected_ids[0], static_cast<int>(wrong) + 1);
  }
}

/// A lamp of the map near one of three detected lamps lowers the limit of their residuals, whether
/// it comes before or after that lamp in the map.
TEST_F(PositionerOutlierRejection, LimitsResidualsByDistanceToNearestLampOfMap) {
  auto detections = seen(3);
  ASSERT_EQ(detections[1].lamp, 2);
  detections[1].pixel += Eigen::Vector2d(10, -8);
  for (Detection& detection : detections) detection.sigma_px.reset();
  EXPECT_EQ(locate(detections).status, FixStatus::ok);
  const LampMap map = rig.map;
  for (const int id : {0, 20}) {
    for (const auto& [distance_m, status] :
         {std::pair(2.0, FixStatus::ok), {0.01, FixStatus::inconsistent}}) {
      rig.map = map;
      const Eigen::Vector3d near_m =
          map.lamps[1].position_m + Eigen::Vector3d(0.6 * distance_m, 0.8 * distance_m, 3);
      rig.map.lamps.push_back({id, near_m, {}, {}, {}});
      EXPECT_EQ(locate(detections).status, status) << id << ", " << distance_m;
    }
  }
}

TEST_F(PositionerOutlierRejection, KeepsAllLampsUnderUncorrectedTilt) {
  const LampMap map = rig.map;
  SyntheticRig tilted = rig;
  tilted.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.09, 2);  // 5 degrees
  const Fix fix = locate(seen_from(tilted));
  ASSERT_TRUE(fix.has_succeeded());
  EXPECT_EQ(fix.lamps, 8);
  EXPECT_EQ(fix.rejected_lamps, 0);
}

/// A reflection near the lamp is consistent by position, but not by the reported noise.
TEST_F(PositionerOutlierRejection, RejectsSmallDisplacementOnlyWhenSigmaIsReported) {
  for (const std::size_t count : {4u, 5u, 8u}) {
    for (std::size_t wrong = 0; wrong < count; ++wrong) {
      auto detections = seen(count);
      detections[wrong].pixel += Eigen::Vector2d(13, -9);
      SCOPED_TRACE(testing::Message() << wrong << " of " << count);
      const Fix fix = locate(detections);
      expect_truth(fix);
      EXPECT_EQ(fix.rejected_lamps, 1);
      EXPECT_EQ(fix.rejected_ids[0], static_cast<int>(wrong) + 1);
      for (Detection& detection : detections) detection.sigma_px.reset();
      EXPECT_EQ(locate(detections).rejected_lamps, 0);
    }
  }
}

/// In a grid of lamps scale and rotation can hide a wrong identity.
TEST_F(PositionerOutlierRejection, FixesHaveErrorsBelow20MmDespiteMisidentifiedGridLamp) {
  std::vector<Eigen::Vector3d> positions_m;
  for (int i = 0; i < 49; ++i)
    positions_m.emplace_back(0.5 * (i % 7) - 1.5, 0.5 * (i / 7) - 1.5, 1.8);
  rig.map = make_lamp_map(positions_m);
  int fixes = 0;
  for (int i = 0; i < 2000; ++i) {
    rig.camera = {{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0}, random.uniform(-3, 3)};
    const auto& [width, height] = rig.calibration.camera.imager_px;
    auto detections = with_noise(seen_from(rig, 0.2), random);
    std::erase_if(detections, [width = width, height = height](const Detection& detection) {
      const Eigen::Array2d pixel = detection.pixel;
      return (pixel < 0).any() || (pixel > Eigen::Array2d(width, height) - 1).any();
    });
    const std::size_t count = 4 + random.index(3);
    while (detections.size() > count) {
      detections.erase(detections.begin() + std::ptrdiff_t(random.index(detections.size())));
    }
    Detection& wrong = detections[random.index(count)];
    const int right_id = wrong.lamp;
    while (std::any_of(detections.begin(), detections.end(),
                       [&](const Detection& detection) {
                         return &detection != &wrong && detection.lamp == wrong.lamp;
                       }) ||
           wrong.lamp == right_id) {
      wrong.lamp = 1 + static_cast<int>(random.index(49));
    }
    const Fix fix = locate(detections);
    if (!fix.has_succeeded()) continue;
    ++fixes;
    EXPECT_LT((fix.state.pose.position_m - rig.camera.position_m).norm(), 0.02) << i;
  }
  EXPECT_GT(fixes, 1500);
}

TEST_F(PositionerOutlierRejection, ReturnsInconsistentWhenHalfOfLampsAreDisplaced) {
  auto detections = seen(6);
  for (std::size_t i = 0; i < 3; ++i) detections[i].pixel += Eigen::Vector2d(60, 40);
  EXPECT_EQ(locate(detections).status, FixStatus::inconsistent);
}

TEST_F(PositionerOutlierRejection, ReturnsInconsistentWhenOneOfThreeLampsIsMisidentified) {
  auto detections = seen(3);
  detections[1].lamp = 8;
  EXPECT_EQ(locate(detections).status, FixStatus::inconsistent);
}

TEST_F(PositionerOutlierRejection, ReturnsInconsistentForMapOfAnotherRoom) {
  rig.map = make_lamp_map({{0.1, 0.2, 1.6},
                           {-0.7, 0.4, 1.6},
                           {0.5, -0.4, 1.6},
                           {0.2, 0.3, 1.6},
                           {-0.1, -0.4, 1.6},
                           {0.8, 0.1, 1.6},
                           {-0.6, -0.3, 1.6},
                           {0.4, 0.4, 1.6}});
  const auto detections = seen(8);
  rig.map = synthetic_lamps();
  EXPECT_EQ(locate(detections).status, FixStatus::inconsistent);
}

TEST_F(PositionerOutlierRejection, ReturnsMirroredMapForMirroredLampsAtEqualOrDifferentHeights) {
  for (const bool equal_heights : {true, false}) {
    rig.map = synthetic_lamps();
    for (std::size_t i = 0; i < 8 && !equal_heights; ++i) {
      rig.map.lamps[i].position_m.z() += i % 2 ? 0.3 : 0;
    }
    for (const std::size_t count : {3u, 4u, 8u}) {
      const auto detections = seen(count);
      SyntheticRig mirrored_rig = rig;
      for (Lamp& lamp : mirrored_rig.map.lamps) lamp.position_m.x() *= -1;
      const Fix fix =
          Positioner(mirrored_rig.map, rig.calibration).compute_position_fix(detections);
      EXPECT_EQ(fix.status, FixStatus::mirrored_map) << count << fix_status_name(fix.status);
    }
  }
}

}  // namespace
}  // namespace vlp
