// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/floor_limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "positioning/positioner.h"
#include "support/matchers.h"
#include "support/random.h"
#include "support/scatter.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

Camera pinhole_camera() {
  Camera camera;
  camera.imager_px = {800, 600};
  camera.lens_model = LensModel::pinhole;
  camera.intrinsics = {500, 500, 399.5, 299.5};
  return camera;
}

const ErrorSources kNoise{0.1, 0, 0, 0};

TEST(ListVisiblePositions, ExcludesLampsOutsideImageOrBelowCamera) {
  // At 1 m above the camera the image is 1.6 m wide: its edges are at +-0.8 m, -+0.6 m.
  const LampMap map = make_lamp_map({{0.7999, 0, 1},
                                     {0.8001, 0, 1},
                                     {-0.7999, 0, 1},
                                     {-0.8001, 0, 1},
                                     {0, 0.5999, 1},
                                     {0, 0.6001, 1},
                                     {0, -0.5999, 1},
                                     {0, -0.6001, 1},
                                     {0, 0, -1}});
  EXPECT_EQ(list_visible_positions(map, pinhole_camera(), {{0, 0, 0}, 0}).size(), 4);
}

TEST(ListVisiblePositions, ExcludesTruncatedLampsWhenDiameterIsKnown) {
  LampMap map = make_lamp_map({{0.75, 0, 1}, {0, 0, 1}});
  EXPECT_EQ(list_visible_positions(map, pinhole_camera(), {{0, 0, 0}, 0}).size(), 2);
  map.lamps[0].shape = map.lamps[1].shape = make_disc_lamp_shape(0.2);
  const auto visible = list_visible_positions(map, pinhole_camera(), {{0, 0, 0}, 0});
  ASSERT_EQ(visible.size(), 1);
  EXPECT_THAT(visible[0], IsNear(Eigen::Vector3d(0, 0, 1), 0));
}

TEST(ListVisiblePositions, ExcludesLampThatYawMovesOutOfImage) {
  const LampMap map = make_lamp_map({{0.7, 0, 1}});
  EXPECT_EQ(list_visible_positions(map, pinhole_camera(), {{0, 0, 0}, 0}).size(), 1);
  EXPECT_EQ(list_visible_positions(map, pinhole_camera(), {{0, 0, 0}, M_PI / 2}).size(), 0);
}

TEST(ComputeFloorLimits, ReturnsPositionsOfGridRowByRow) {
  const LampMap map = synthetic_lamps();
  const auto limits =
      compute_floor_limits(map, pinhole_camera(), {0, 0.3, -0.1, 0.1, 0.1}, 0.2, 0, kNoise);
  ASSERT_EQ(limits.positions.size(), 4 * 3);
  ASSERT_FALSE(limits.sources.empty());
  EXPECT_THAT(limits.positions[5].camera.position_m, IsNear(Eigen::Vector3d(0.1, 0, 0.2), 1e-15));
  for (const auto& place : limits.positions) {
    EXPECT_EQ(place.covariances.size(), place.lamps >= 2 ? limits.sources.size() : 0);
  }
}

TEST(ComputeFloorLimits, TotalVarianceIncreasesWhenMotionAndTiltAreEstimated) {
  Camera camera = pinhole_camera();
  camera.row_time_s = 3e-5;
  camera.readout = Readout::rows;
  BodyPrior prior;
  prior.set_state_sd(kBodyVelocity, 1);
  prior.set_state_sd(kBodyRoll, 2);
  const FloorGrid grid{-1.5, 1.5, -0.3, 0.3, 0.3};
  const auto standing = compute_floor_limits(synthetic_lamps(), camera, grid, 0.2, 0, kNoise);
  const auto limits = compute_floor_limits(synthetic_lamps(), camera, grid, 0.2, 0, kNoise, prior);
  ASSERT_EQ(limits.sources.size(), 6);
  EXPECT_EQ(limits.sources[1].key, "motion");
  EXPECT_EQ(limits.sources[2].key, "roll_pitch");
  ASSERT_EQ(standing.positions.size(), limits.positions.size());
  int with_fix = 0, without = 0;
  for (std::size_t i = 0; i < limits.positions.size(); ++i) {
    const auto& place = limits.positions[i];
    EXPECT_EQ(place.lamps, standing.positions[i].lamps);
    if (place.covariances.empty()) {
      EXPECT_LT(place.lamps, 4);
      ++without;
      continue;
    }
    ++with_fix;
    ASSERT_EQ(place.covariances.size(), 6);
    ASSERT_FALSE(standing.positions[i].covariances.empty());
    // Additional estimated states increase the covariance.
    EXPECT_THAT(place.covariances[0], IsNear(standing.positions[i].covariances[0], 1e-12));
    EXPECT_GT(place.total_pose_covariance()(0, 0),
              standing.positions[i].total_pose_covariance()(0, 0));
  }
  EXPECT_GT(with_fix, 0);
  EXPECT_GT(without, 0) << "some see too few lamps for roll and pitch";
}

TEST(ComputeFloorLimits, NoiseCovarianceMatchesScatterOfFixesWithFisheye) {
  constexpr int draws = 4000;
  const FloorGrid grid{-1.2, 1.2, 0.2, 0.2, 0.8};
  SyntheticRig rig{synthetic_lamps(), {fisheye_camera(), {}, {}, {}, {}}, {}, {}};
  const auto limits = compute_floor_limits(rig.map, rig.calibration.camera, grid, 0.2, 0.5, kNoise);
  ASSERT_EQ(limits.positions.size(), 4);
  const Positioner positioner(rig.map, rig.calibration);
  Random random{23};
  for (const auto& place : limits.positions) {
    EXPECT_EQ(place.lamps, 8);
    ASSERT_FALSE(place.covariances.empty());
    rig.camera = place.camera;
    const auto exact = seen_from(rig, kNoise.noise_px);
    Scatter scatter(place.camera, place.covariances[0]);
    for (int i = 0; i < draws; ++i) {
      scatter.add(positioner.compute_position_fix(with_noise(exact, random)).state.pose);
    }
    // Four standard deviations of a standard deviation from `draws` draws.
    EXPECT_LT(scatter.excess().cwiseAbs().maxCoeff(), 4 / std::sqrt(2.0 * draws));
  }
}

TEST(ComputeFloorLimits, ReturnsNoCovariancesForPositionWithoutVisibleLamps) {
  const auto limits =
      compute_floor_limits(synthetic_lamps(), pinhole_camera(), {50, 50, 0, 0, 1}, 0, 0, kNoise);
  ASSERT_EQ(limits.positions.size(), 1);
  EXPECT_EQ(limits.positions[0].lamps, 0);
  EXPECT_TRUE(limits.positions[0].covariances.empty());
}

TEST(ComputeFloorLimits, ThrowsOnInvalidGrid) {
  const auto on = [](const FloorGrid& grid) {
    return compute_floor_limits(synthetic_lamps(), pinhole_camera(), grid, 0, 0, kNoise);
  };
  EXPECT_THROW(on({0, 1, 0, 1, 0}), std::invalid_argument);
  EXPECT_THROW(on({0, 1, 0, 1, -1}), std::invalid_argument);
  EXPECT_THROW(on({1, 0, 0, 1, 0.1}), std::invalid_argument);
  EXPECT_THROW(on({0, 1, 0, 1, 1e-9}), std::invalid_argument);
  EXPECT_THROW(on({0, 1, 0, 1, 1e-4}), std::invalid_argument);
  EXPECT_THROW(on({0, NAN, 0, 1, 0.1}), std::invalid_argument);
  EXPECT_THROW(on({0, 1e300, 0, 0, 1}), std::invalid_argument);
  EXPECT_THROW(on({0, 4000, 0, 2500, 1}), std::invalid_argument) << "10,006,501 places";
}

TEST(MakeFloorGrid, GridSpansBoundingBoxOfLamps) {
  const FloorGrid grid = make_floor_grid(synthetic_lamps(), 0.05);
  EXPECT_EQ(grid.x_min_m, -0.8);
  EXPECT_EQ(grid.x_max_m, 0.8);
  EXPECT_EQ(grid.y_min_m, -0.5);
  EXPECT_EQ(grid.y_max_m, 0.5);
}

}  // namespace
}  // namespace vlp
