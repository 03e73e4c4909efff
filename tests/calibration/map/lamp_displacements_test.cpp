// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/map/lamp_displacements.h"

#include <gmock/gmock.h>

#include <cmath>

#include "geometry/plane.h"
#include "support/random.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

std::vector<LampOffset> compute_offsets(const LampMap& map, const std::vector<CeilingView>& views) {
  const auto found = estimate_lamp_displacements(map, views);
  return found ? compute_lamp_offsets_relative_to_others(*found) : std::vector<LampOffset>();
}

/// Captures of eight lamps from twelve positions, with wrong fixes: position, yaw and height have
/// errors. Every third capture lacks two of the lamps.
class EstimateLampDisplacements : public testing::Test {
 protected:
  static constexpr int kCaptures = 12;

  std::vector<LampOffset> found(double noise_m = 0) {
    std::vector<CeilingView> views;
    Random random(seed_);
    for (int i = 0; i < kCaptures; ++i) {
      const Eigen::Vector2d camera_m(0.1 * (i % 4), 0.05 * (i % 3));
      const Eigen::Vector2d wrong_m(random.uniform(-1e-2, 1e-2), random.uniform(-1e-2, 1e-2));
      const Eigen::Vector2d turned(1 + random.uniform(-1e-2, 1e-2), random.uniform(-1e-2, 1e-2));
      CeilingView view{camera_m, {}, 0};
      for (const Lamp& lamp : lamps_.lamps) {
        if (i % 3 == 0 && (lamp.id == 1 + i % 8 || lamp.id == 1 + (i + 3) % 8)) continue;
        const Eigen::Vector2d from_camera_m =
            lamp.position_m.head<2>() + moved_m_[static_cast<std::size_t>(lamp.id)] - camera_m;
        const Eigen::Vector2d noise(noise_m * random.normal(), noise_m * random.normal());
        view.lamps.push_back(
            {lamp.id, camera_m + wrong_m + complex_product(turned, from_camera_m) + noise, 1.6});
      }
      views.push_back(view);
    }
    if (misidentified_) std::swap(views[5].lamps[2].lamp, views[5].lamps[6].lamp);
    return compute_offsets(lamps_, views);
  }

  LampMap lamps_ = synthetic_lamps();
  std::vector<Eigen::Vector2d> moved_m_ = std::vector<Eigen::Vector2d>(9, Eigen::Vector2d::Zero());
  bool misidentified_ = false;
  std::uint64_t seed_ = 1;
};

TEST_F(EstimateLampDisplacements, ReturnsOffsetOfMovedLampWhenAllFixesHavePoseErrors) {
  for (const double by_m : {1e-3, 5e-3, 0.1}) {
    moved_m_[3] = {0.6 * by_m, -0.8 * by_m};
    const auto offsets = found();
    ASSERT_EQ(offsets.size(), 8U);
    EXPECT_LT((offsets[2].offset_m - moved_m_[3]).norm(), 1e-9 + 0.1 * by_m * by_m) << by_m;
  }
}

/// Same formula as in scripts/reprocess/fleet.py, which subtracts the effect of a moved lamp on the
/// other lamps.
TEST_F(EstimateLampDisplacements, OffsetsOfUnmovedLampsMatchClosedFormula) {
  moved_m_[3] = {3e-3, -4e-3};
  Eigen::Vector2d middle_m(0, 0);
  for (const Lamp& lamp : lamps_.lamps) middle_m += lamp.position_m.head<2>() / 8;
  double squares = 0;
  for (const Lamp& lamp : lamps_.lamps) {
    squares += (lamp.position_m.head<2>() - middle_m).squaredNorm();
  }
  const auto q = [&](int id) -> Eigen::Vector2d {
    return lamps_.lamps[static_cast<std::size_t>(id - 1)].position_m.head<2>() - middle_m;
  };
  const auto offsets = found();
  ASSERT_EQ(offsets.size(), 8U);
  for (const LampOffset& one : offsets) {
    if (one.lamp == 3) continue;
    const double own = 1 - 1.0 / 8 - q(one.lamp).squaredNorm() / squares;
    const Eigen::Vector2d by = Eigen::Vector2d(-1.0 / 8, 0) -
                               complex_product(q(one.lamp), {q(3).x(), -q(3).y()}) / squares;
    EXPECT_LT((one.offset_m - complex_product(by, moved_m_[3]) / own).norm(), 3e-5) << one.lamp;
  }
}

TEST_F(EstimateLampDisplacements, OffsetSdsMatchScatterOfOffsets) {
  constexpr int trials = 300;
  Eigen::Array2d squares(0, 0);
  for (int trial = 0; trial < trials; ++trial) {
    seed_ = 10 + static_cast<std::uint64_t>(trial);
    const auto offsets = found(2e-4);
    ASSERT_EQ(offsets.size(), 8U);
    for (const LampOffset& one : offsets) {
      squares += (one.offset_m.array() / one.sd_m.array()).square() / (8 * trials);
    }
  }
  EXPECT_NEAR(std::sqrt(squares.mean()), 1, 0.05);  // of 4,800 correlated values
}

TEST_F(EstimateLampDisplacements, KeepsOffsetsWhenSomeLampsAreMisidentified) {
  moved_m_[3] = {1e-3, 0};
  const auto right = found(1e-4);
  misidentified_ = true;
  const auto offsets = found(1e-4);
  ASSERT_EQ(right.size(), 8U);
  ASSERT_EQ(offsets.size(), right.size());
  int captures = 0;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    EXPECT_LT((offsets[i].offset_m - right[i].offset_m).norm(), 2e-4) << offsets[i].lamp;
    captures += right[i].captures - offsets[i].captures;
  }
  EXPECT_GE(captures, 2);
  EXPECT_LE(captures, 4);
}

TEST_F(EstimateLampDisplacements, ReturnsNoOffsetsForSingleViewOrUnconnectedLampGroups) {
  CeilingView view{{0, 0}, {}};
  for (int id = 1; id <= 3; ++id) {
    const auto& lamp = lamps_.lamps[static_cast<std::size_t>(id - 1)];
    view.lamps.push_back({id, lamp.position_m.head<2>(), 1.6});
  }
  EXPECT_THAT(compute_offsets(lamps_, {}), testing::IsEmpty());
  EXPECT_THAT(compute_offsets(lamps_, {view}), testing::IsEmpty()) << "seen once";
  CeilingView other{{0, 0}, {}};
  for (int id = 4; id <= 7; ++id) {
    const auto& lamp = lamps_.lamps[static_cast<std::size_t>(id - 1)];
    other.lamps.push_back({id, lamp.position_m.head<2>(), 1.6});
  }
  EXPECT_THAT(compute_offsets(lamps_, {view, view, view, view, other, other, other, other}),
              testing::IsEmpty())
      << "two rooms in one";
  EXPECT_THAT(compute_offsets(lamps_, {other, other}), testing::SizeIs(4));
}

}  // namespace
}  // namespace vlp
