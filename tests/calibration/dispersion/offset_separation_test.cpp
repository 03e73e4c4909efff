// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Derivatives of fixes and of the offsets with respect to the lamp map.
#include "calibration/dispersion/offset_separation.h"

#include <gtest/gtest.h>

#include "calibration/dispersion/reference_point_fixes.h"
#include "calibration/dispersion/station.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Captures at a reference point. All lamps but one have an uncertain position.
struct UncertainMap {
  UncertainMap() : captures(station.captures(9, true, {0.004, -0.003})), map(station.rig.map) {
    for (Lamp& lamp : map.lamps) lamp.sd_m = 0.002;
    map.lamps[1].sd_m.reset();
    for (std::size_t i = 0; i < map.lamps.size(); ++i) {
      if (map.lamps[i].sd_m) uncertain.push_back(i);
    }
  }

  /// Returns the map with the lamp coordinate of a column of the Jacobian displaced by step_m.
  LampMap displace_lamp(Eigen::Index column, double step_m) const {
    LampMap result = map;
    result.lamps[uncertain[static_cast<std::size_t>(column / 3)]].position_m[column % 3] += step_m;
    return result;
  }
  Eigen::Index num_columns() const { return 3 * std::ssize(uncertain); }

  Station station{0.005};
  std::vector<ReferencePointCapture> captures;
  LampMap map;
  /// Indices of the lamps with sd_m.
  std::vector<std::size_t> uncertain;
};

constexpr double kStep_m = 1e-5;

TEST(ReferencePointFixes, JacobianWrtLampsMatchesFixesWithMovedLamps) {
  const UncertainMap setup;
  const Eigen::Vector2d offset_px(3, -2);
  const ReferencePointFixes fixes(setup.captures, setup.map, setup.station.believed);
  const auto derivatives = fixes.compute_fix_jacobian_wrt_lamps(offset_px);
  ASSERT_EQ(derivatives.lamps.size(), setup.map.lamps.size() - 1);
  EXPECT_EQ(derivatives.lamps[1].id, setup.map.lamps[2].id);
  ASSERT_EQ(derivatives.jacobian_wrt_positions.cols(), setup.num_columns());
  ASSERT_EQ(derivatives.jacobian_wrt_positions.rows(), 2 * std::ssize(setup.captures));
  for (Eigen::Index column = 0; column < setup.num_columns(); ++column) {
    const LampMap map_minus = setup.displace_lamp(column, -kStep_m),
                  map_plus = setup.displace_lamp(column, kStep_m);
    const auto minus = ReferencePointFixes(setup.captures, map_minus, setup.station.believed)
                           .compute_capture_fixes_with_dispersion_offset(offset_px);
    const auto plus = ReferencePointFixes(setup.captures, map_plus, setup.station.believed)
                          .compute_capture_fixes_with_dispersion_offset(offset_px);
    for (std::size_t i = 0; i < setup.captures.size(); ++i) {
      ASSERT_TRUE(minus[i] && plus[i]);
      const Eigen::Vector2d expected = (plus[i]->error_m - minus[i]->error_m) / (2 * kStep_m);
      EXPECT_THAT(Eigen::Vector2d(derivatives.jacobian_wrt_positions.block<2, 1>(
                      2 * static_cast<Eigen::Index>(i), column)),
                  IsNear(expected, 2e-4));
    }
  }
}

TEST(SeparateCameraAndWorldOffsets, LampDerivativesMatchOffsetsWithMovedLamps) {
  const UncertainMap setup;
  const auto separate = [&](const LampMap& map) {
    return separate_camera_and_world_offsets(
        ReferencePointFixes(setup.captures, map, setup.station.believed));
  };
  const auto found = separate(setup.map);
  ASSERT_TRUE(found);
  const Eigen::MatrixXd& derivatives = found->lamp_derivatives.jacobian_wrt_positions;
  ASSERT_EQ(derivatives.cols(), setup.num_columns());
  ASSERT_EQ(derivatives.rows(), 4);
  for (Eigen::Index column = 0; column < setup.num_columns(); ++column) {
    const auto minus = separate(setup.displace_lamp(column, -kStep_m)),
               plus = separate(setup.displace_lamp(column, kStep_m));
    ASSERT_TRUE(minus && plus);
    const Eigen::Vector2d offset_px = (plus->offset_px - minus->offset_px) / (2 * kStep_m);
    const Eigen::Vector2d world_m = (plus->world_m - minus->world_m) / (2 * kStep_m);
    EXPECT_THAT(Eigen::Vector2d(derivatives.col(column).head<2>()), IsNear(offset_px, 0.5))
        << "of " << derivatives.topRows<2>().cwiseAbs().maxCoeff();
    EXPECT_THAT(Eigen::Vector2d(derivatives.col(column).tail<2>()), IsNear(world_m, 2e-3));
  }
}

TEST(ReferencePointFixes, AreSmoothFunctionsOfOffsetWithLampsNearLimitOfRejection) {
  Station station{0};
  Random random(1);
  constexpr double noise_px = 0.1, step_px = 0.05, max_jump_m = 1e-6;
  int num_fixes = 0;
  for (int draw = 0; draw < 100; ++draw) {
    auto captures = station.captures(6, false, {0, 0}, noise_px);
    for (ReferencePointCapture& capture : captures)
      capture.detections[1].pixel.x() += noise_px * random.uniform(4, 20);
    const ReferencePointFixes fixes(captures, station.rig.map, station.believed);
    std::vector<OptionalFixes> along_u;
    for (int i = -40; i <= 40; ++i) {
      along_u.push_back(fixes.compute_capture_fixes_with_dispersion_offset({i * step_px, 0}));
    }
    for (std::size_t i = 1; i + 1 < along_u.size(); ++i) {
      for (std::size_t k = 0; k < captures.size(); ++k) {
        const auto &before = along_u[i - 1][k], &here = along_u[i][k], &after = along_u[i + 1][k];
        ASSERT_TRUE(before && here && after);
        ASSERT_LT((before->error_m - 2 * here->error_m + after->error_m).norm(), max_jump_m)
            << "draw " << draw << ", capture " << k;
        ++num_fixes;
      }
    }
  }
  EXPECT_GT(num_fixes, 0);
}

}  // namespace
}  // namespace vlp
