// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/check_outliers.h"

#include <gmock/gmock.h>

#include <cmath>
#include <string>
#include <vector>

#include "positioning/positioner.h"
#include "session/locate_step.h"
#include "session/session_folder.h"
#include "support/example_rig.h"

namespace vlp {
namespace {

using testing::HasSubstr;

/// 36 captures with errors of 0.05 mm, those of `indices` with 52 mm.
std::vector<CaptureError> errors_with(const std::vector<std::size_t>& indices) {
  std::vector<CaptureError> errors;
  for (int i = 0; i < 36; ++i) {
    errors.push_back({{std::to_string(100 + i), static_cast<std::size_t>(i)}, 5e-5});
  }
  for (const std::size_t index : indices) errors[index].error_m = 0.052;
  return errors;
}

TEST(DescribeErrorOutliers, NamesConsecutiveCapturesAsRanges) {
  EXPECT_EQ(describe_error_outliers(errors_with({0, 1, 2, 3, 4})),
            "captures 100 to 104 have errors up to 52.0 mm, the others 0.05 mm: taken at other "
            "positions than those in their table, or by another camera");
  EXPECT_EQ(describe_error_outliers(errors_with({7})),
            "107 was not taken at the position in its table: its error is 52.0 mm, that of others "
            "0.05 mm");
  const std::string many = describe_error_outliers(errors_with({0, 2, 3, 5, 7, 9, 11, 12, 13}));
  EXPECT_EQ(many.substr(0, many.find(" have")),
            "captures 100, 102, 103, 105, 107, 109 and 1 more groups");
}

TEST(DescribeErrorOutliers, ReturnsEmptyTextWithoutGrossOutliers) {
  EXPECT_EQ(describe_error_outliers(errors_with({})), "");
  auto errors = errors_with({});
  errors[3].error_m = 0.004;
  EXPECT_EQ(describe_error_outliers(errors), "") << "a camera may have it";
  for (CaptureError& error : errors) error.error_m = 0.05;
  EXPECT_EQ(describe_error_outliers(errors), "") << "all of them";
  EXPECT_EQ(describe_error_outliers({{{"a"}, 1e-5}, {{"b"}, 1}, {{"c"}, 1e-5}}), "") << "too few";
}

TEST(DescribeResidualOutliers, NamesCapturesOnlyWhenAtLeastTwoAreOutliers) {
  std::vector<CaptureResidual> residuals;
  residuals.reserve(24);
  for (std::size_t i = 0; i < 24; ++i) residuals.push_back({{std::to_string(100 + i), i}, 0.02});
  EXPECT_EQ(describe_residual_outliers(residuals), "");
  residuals[3].residual_px = 0.5;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "a covered lamp";
  residuals[4].residual_px = 0.19;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "one camera may have it";
  residuals[4].residual_px = 0.3;
  EXPECT_EQ(
      describe_residual_outliers(residuals),
      "the lamps in captures 103, 104 do not fit lens and tilt of the others (residuals up to 0.50 "
      "px, typically 0.02 px): other camera, or covered lamps; repeat these captures");
  for (CaptureResidual& each : residuals) each.residual_px = 0.3;
  EXPECT_EQ(describe_residual_outliers(residuals), "") << "all of them";
}

/// Positions equal to the fixes, in the table of a check.
struct KnownPositionFaults : ExampleRig {
  KnownPositionFaults() {
    const Positioner positioner(map, calibration);
    for (const Frame& frame : frames) {
      const Fix fix = positioner.compute_position_fix(frame.detections);
      if (!fix.has_succeeded()) continue;
      Capture& place = places[frame.image];
      place.x_m = fix.state.pose.position_m.x() + 3e-4;
      place.y_m = fix.state.pose.position_m.y();
    }
  }
  EvaluationInput make_input(const CapturesTable& table) const {
    EvaluationInput input;
    input.fixes = {"check", locate_from_detections({frames, map, calibration}).rows};
    input.truth = {"check", list_truth_positions(table)};
    return input;
  }
  CapturesTable places;
};

TEST_F(KnownPositionFaults, DescribeWrongPositionsNamesSeveralWrongCaptures) {
  ASSERT_GT(frames.size(), 12U);
  CapturesTable wrong = places;
  for (std::size_t i = 0; i < 5; ++i) wrong.at(frames[i].image).y_m.value() += 0.052;
  wrong.at(frames[9].image).x_m.value() += 0.03;
  EXPECT_THAT(describe_wrong_positions(make_input(wrong)),
              testing::Eq("captures " + frames[0].image + " to " + frames[4].image + ", " +
                          frames[9].image +
                          " have errors up to 52.0 mm, the others 0.3 mm: taken at other positions "
                          "than those in their table, or by another camera"));
}

/// If half or more are wrong, the others are not reliable.
TEST_F(KnownPositionFaults, DescribeWrongPositionsIsEmptyWhenMostAreWrong) {
  CapturesTable wrong = places;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (i % 4 != 0) wrong.at(frames[i].image).y_m.value() += 0.02;
  }
  EXPECT_EQ(describe_wrong_positions(make_input(wrong)), "");
}

/// The zenith of another camera displaces all fixes by one offset in the frame of the camera.
TEST_F(KnownPositionFaults, FindCommonOffsetDistinguishesCameraFromRoomFrame) {
  EXPECT_FALSE(find_common_offset(make_input(places)));
  const Positioner positioner(map, calibration);
  CapturesTable rotating = places, constant = places, scattered = places;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const Fix fix = positioner.compute_position_fix(frames[i].detections);
    if (!fix.has_succeeded()) continue;
    const double yaw_rad = fix.state.pose.yaw_rad;
    rotating.at(frames[i].image).x_m.value() += 0.03 * std::cos(yaw_rad);
    rotating.at(frames[i].image).y_m.value() += 0.03 * std::sin(yaw_rad);
    constant.at(frames[i].image).x_m.value() += 0.03;
    scattered.at(frames[i].image).x_m.value() += i % 2 == 0 ? 0.03 : -0.03;
  }
  const auto camera_offset = find_common_offset(make_input(rotating));
  ASSERT_TRUE(camera_offset);
  EXPECT_TRUE(camera_offset->in_camera);
  EXPECT_THAT(describe_common_offset(*camera_offset),
              HasSubstr("are off by 30.0 mm in one direction of the camera (x -30.0 mm, y "));
  const auto world_offset = find_common_offset(make_input(constant));
  ASSERT_TRUE(world_offset);
  EXPECT_FALSE(world_offset->in_camera);
  EXPECT_THAT(describe_common_offset(*world_offset),
              HasSubstr("in one direction of the room (x -30.3 mm, y +0.0 mm): the known points"));
  EXPECT_FALSE(find_common_offset(make_input(scattered)));
}

}  // namespace
}  // namespace vlp
