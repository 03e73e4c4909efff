// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Row times that explain the stripe periods equally well, distinguished by the light positions.
#include "session/position_cost.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "support/body_rig.h"

namespace vlp {
namespace {

using testing::Each;
using testing::HasSubstr;

constexpr double kRowTime_s = 3e-5;
/// Frequencies with this ratio: without the first or the last lamp, a row time that is larger or
/// smaller by the ratio explains the periods of the others exactly.
constexpr double kRatio = 1.2;

LampMap with_even_ratios(const std::vector<Eigen::Vector3d>& positions_m) {
  LampMap map = make_lamp_map(positions_m);
  for (Lamp& lamp : map.lamps) lamp.frequency_hz = 2400 * std::pow(kRatio, lamp.id - 1);
  return map;
}

/// Two rows of three lamps. Of five that are seen the other assignment moves four along their row.
LampMap two_rows() {
  return with_even_ratios({{-0.6, -0.3, 1.6},
                           {0, -0.32, 1.6},
                           {0.6, -0.3, 1.6},
                           {-0.6, 0.3, 1.6},
                           {0, 0.28, 1.6},
                           {0.6, 0.3, 1.6}});
}

/// The same places in an order in which no four lamps go together.
LampMap mixed_rows() {
  return with_even_ratios({{-0.6, -0.3, 1.6},
                           {0.6, 0.3, 1.6},
                           {0, -0.32, 1.6},
                           {-0.6, 0.3, 1.6},
                           {0.6, -0.3, 1.6},
                           {0, 0.28, 1.6}});
}

/// Images of lamps, of which some are not read, and the periods of their lights.
struct Images {
  LampMap map;
  Calibration calibration = rolling_calibration();
  std::vector<MeasuredPeriod> periods;
  /// Image of each period.
  std::vector<std::size_t> image;
  std::vector<GroupedLight> lights;
  std::size_t count = 0;

  explicit Images(LampMap lamps) : map(std::move(lamps)) {}

  /// Adds an image of the lamps `ids` at their positions in `seen`.
  void add(const std::vector<int>& ids, double yaw_rad, const Inclination& lean,
           const LampMap& seen) {
    const BodyRig rig{seen, calibration, {{{0.1, -0.05, 0}, yaw_rad}, {{0, 0}, 0, lean}}, {}};
    for (const Detection& detection : seen_from(rig, 0.1)) {
      if (std::find(ids.begin(), ids.end(), detection.lamp) == ids.end()) continue;
      const double frequency_hz = 2400 * std::pow(kRatio, detection.lamp - 1);
      periods.push_back({1 / (frequency_hz * kRowTime_s), {}});
      image.push_back(count);
      lights.push_back({0, detection.pixel, *detection.sigma_px});
    }
    ++count;
  }
  void add(const std::vector<int>& ids, double yaw_rad, const Inclination& lean = {0.02, -0.03}) {
    add(ids, yaw_rad, lean, map);
  }

  RowTimeCandidates candidates() const { return list_row_time_candidates(periods, map); }

  std::vector<double> costs(bool with_lens = true) const {
    const RowTimeCandidates found = candidates();
    const auto& imager_px = calibration.camera.imager_px;
    std::vector<GroupedLights> grouped(count, {imager_px, {}});
    for (std::size_t group = 0; group < found.groups.size(); ++group) {
      for (const std::size_t light : found.groups[group].lights) {
        grouped[image[light]].lights.push_back(
            {group, lights[light].pixel, lights[light].sigma_px});
      }
    }
    std::optional<Lens> lens;
    if (with_lens) lens.emplace(calibration.camera.lens_model, calibration.camera.intrinsics);
    return compute_position_costs(found, grouped, map, lens);
  }
  RowTimeResult chosen(bool with_lens = true) const {
    return select_row_time(candidates(), costs(with_lens));
  }
  void expect_true_row_time(bool with_lens = true) const {
    ASSERT_EQ(candidates().candidates.size(), 2U);
    const RowTimeResult result = chosen(with_lens);
    ASSERT_TRUE(result.row_time) << result.problem;
    EXPECT_NEAR(result.row_time->row_time_s, kRowTime_s, 1e-9 * kRowTime_s);
  }
  void expect_undecided(bool with_lens = true) const {
    ASSERT_GE(candidates().candidates.size(), 2U);
    const RowTimeResult result = chosen(with_lens);
    EXPECT_FALSE(result.row_time);
    EXPECT_THAT(result.problem, HasSubstr("fit a row time of"));
    EXPECT_THAT(result.problem, HasSubstr("neither duties nor positions of the lamps decide"));
  }
};

TEST(ComputePositionCosts, IsNearZeroOnlyForTrueRowTime) {
  for (const std::vector<int>& seen : {std::vector{2, 3, 4, 5, 6}, {1, 2, 3, 4, 5}}) {
    Images images(mixed_rows());
    for (int k = 0; k < 5; ++k) images.add(seen, k);
    images.expect_true_row_time(true);
    images.expect_true_row_time(false);
    const auto costs = images.costs();
    EXPECT_NEAR(std::min(costs[0], costs[1]), 0, 0.1);
    EXPECT_GT(std::max(costs[0], costs[1]), 20);
  }
}

TEST(ComputePositionCosts, SelectsTrueRowTimeWhenOtherMisplacesOnlyOneLamp) {
  Images images(two_rows());
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5, 6}, k);
  images.expect_true_row_time(true);
  images.expect_true_row_time(false);
}

TEST(ComputePositionCosts, IsZeroForImagesOfTwoLamps) {
  Images images(mixed_rows());
  for (int k = 0; k < 5; ++k) {
    images.add({2, 3}, k);
    images.add({4, 5}, k);
  }
  EXPECT_THAT(images.costs(), Each(0));
  images.expect_undecided();
}

TEST(ComputePositionCosts, SelectsTrueRowTimeWhenLampMoved) {
  Images images(mixed_rows());
  LampMap moved = images.map;
  moved.lamps[3].position_m += Eigen::Vector3d(0.25, -0.1, 0);
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5, 6}, k, {0.02, 0}, moved);
  images.expect_true_row_time(true);
  images.expect_true_row_time(false);
}

/// Around a circle each assignment is a turn of the other.
TEST(ComputePositionCosts, NoCandidateIsClearlyBestForSymmetricMap) {
  std::vector<Eigen::Vector3d> circle_m;
  for (int i = 0; i < 6; ++i) {
    const double angle_rad = i * std::numbers::pi / 3;
    circle_m.emplace_back(0.5 * std::cos(angle_rad), 0.5 * std::sin(angle_rad), 1.6);
  }
  Images images(with_even_ratios(circle_m));
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5, 6}, k);
  EXPECT_NEAR(images.costs()[0], 0, 0.1);
  EXPECT_NEAR(images.costs()[1], 0, 0.1);
  images.expect_undecided(true);
  images.expect_undecided(false);
}

/// In a zigzag each assignment is the other's mirror image, moved along: lamps 2 to 5 have the
/// distances of lamps 1 to 4.
TEST(ComputePositionCosts, SelectsTrueRowTimeWhenOtherAssignmentIsMirrored) {
  const LampMap zigzag = with_even_ratios(
      {{-0.8, -0.2, 1.6}, {-0.4, 0.2, 1.6}, {0, -0.2, 1.6}, {0.4, 0.2, 1.6}, {0.8, -0.2, 1.6}});
  Images images(zigzag);
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5}, k);
  images.expect_true_row_time(true);
  images.expect_true_row_time(false);
}

TEST(ComputePositionCosts, NoCandidateIsClearlyBestForMirroredMap) {
  Images images(mixed_rows());
  LampMap room = images.map;
  for (Lamp& lamp : room.lamps) lamp.position_m.y() *= -1;
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5, 6}, k, {0.02, 0}, room);
  EXPECT_THAT(images.costs(), Each(testing::Gt(20)));
  images.expect_undecided();
}

/// A group that may be either of two lamps takes no part.
TEST(ComputePositionCosts, SelectsTrueRowTimeWhenTwoLampsShareFrequency) {
  LampMap map = mixed_rows();
  map.lamps.push_back({7, {0.3, 0.5, 1.6}, {}, map.lamps[0].frequency_hz, {}});
  Images images(map);
  for (int k = 0; k < 5; ++k) images.add({2, 3, 4, 5, 6}, k);
  images.expect_true_row_time();
}

}  // namespace
}  // namespace vlp
