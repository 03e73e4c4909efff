// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "rig/samples.h"

// Numbers are compared for equality: what is written reads back as the same double.
namespace vlp {

void expect_same(const LampMap& found, const LampMap& expected) {
  EXPECT_EQ(found.lamps_below_camera, expected.lamps_below_camera);
  ASSERT_EQ(found.lamps.size(), expected.lamps.size());
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ(found.lamps[i].id, expected.lamps[i].id);
    EXPECT_EQ(found.lamps[i].position_m, expected.lamps[i].position_m);
    EXPECT_EQ(found.lamps[i].shape.kind, expected.lamps[i].shape.kind);
    EXPECT_EQ(found.lamps[i].shape.size_m, expected.lamps[i].shape.size_m);
    EXPECT_EQ(found.lamps[i].shape.yaw_rad, expected.lamps[i].shape.yaw_rad);
    EXPECT_EQ(found.lamps[i].frequency_hz, expected.lamps[i].frequency_hz);
    EXPECT_EQ(found.lamps[i].duty, expected.lamps[i].duty);
    EXPECT_EQ(found.lamps[i].sd_m, expected.lamps[i].sd_m);
  }
}

void expect_same(const Board& found, const Board& expected) {
  EXPECT_EQ(found.family, expected.family);
  EXPECT_EQ(found.cols, expected.cols);
  EXPECT_EQ(found.rows, expected.rows);
  EXPECT_EQ(found.tag_size_m, expected.tag_size_m);
  EXPECT_EQ(found.tag_spacing, expected.tag_spacing);
  EXPECT_EQ(found.border_bits, expected.border_bits);
  EXPECT_EQ(found.corner_squares, expected.corner_squares);
  EXPECT_EQ(found.first_id, expected.first_id);
  EXPECT_EQ(found.id_order.column_major, expected.id_order.column_major);
  EXPECT_EQ(found.id_order.from, expected.id_order.from);
  EXPECT_EQ(found.kind, expected.kind);
  EXPECT_EQ(found.square_size_m, expected.square_size_m);
  EXPECT_EQ(found.top_left_white, expected.top_left_white);
}

namespace {

void expect_same(const Camera& found, const Camera& expected) {
  EXPECT_EQ(found.id, expected.id);
  EXPECT_EQ(found.imager_px, expected.imager_px);
  EXPECT_EQ(found.lens_model, expected.lens_model);
  EXPECT_EQ(found.intrinsics, expected.intrinsics);
  EXPECT_EQ(found.pixel_pitch_m, expected.pixel_pitch_m);
  EXPECT_EQ(found.row_time_s, expected.row_time_s);
  EXPECT_EQ(found.readout, expected.readout);
}

void expect_same(const IntrinsicsReport& found, const IntrinsicsReport& expected) {
  EXPECT_EQ(found.views, expected.views);
  EXPECT_EQ(found.corners, expected.corners);
  EXPECT_EQ(found.outliers, expected.outliers);
  EXPECT_EQ(found.rms_px, expected.rms_px);
  EXPECT_EQ(found.board_warp_m, expected.board_warp_m);
  EXPECT_EQ(found.expected_max_error_px, expected.expected_max_error_px);
  EXPECT_EQ(found.covariance, expected.covariance);
  EXPECT_EQ(found.region_px, expected.region_px);
}

void expect_same(const RotationCenter& found, const RotationCenter& expected) {
  EXPECT_EQ(found.model, expected.model);
  EXPECT_EQ(found.center_px, expected.center_px);
  EXPECT_EQ(found.zenith_in_camera, expected.zenith_in_camera);
  EXPECT_EQ(found.lever_arm_m, expected.lever_arm_m);
}

void expect_same(const Dispersion& found, const Dispersion& expected) {
  EXPECT_EQ(found.offset_px, expected.offset_px);
  EXPECT_EQ(found.radius_m, expected.radius_m);
  EXPECT_EQ(found.center_m, expected.center_m);
  EXPECT_EQ(found.captures, expected.captures);
}

void expect_same(const JointCovariance& found, const JointCovariance& expected) {
  ASSERT_EQ(found.lamps.size(), expected.lamps.size());
  for (std::size_t i = 0; i < found.lamps.size(); ++i) {
    EXPECT_EQ(found.lamps[i].id, expected.lamps[i].id);
    EXPECT_EQ(found.lamps[i].position_m, expected.lamps[i].position_m);
  }
  EXPECT_EQ(found.parameters, expected.parameters);
  EXPECT_EQ(found.matrix, expected.matrix);
}

void expect_same(const Adjustment& found, const Adjustment& expected) {
  EXPECT_EQ(found.sets, expected.sets);
  EXPECT_EQ(found.captures, expected.captures);
  EXPECT_EQ(found.detections, expected.detections);
  EXPECT_EQ(found.residual_px, expected.residual_px);
}

void expect_same(const HistoryEntry& found, const HistoryEntry& expected) {
  EXPECT_EQ(found.part, expected.part);
  EXPECT_EQ(found.program, expected.program);
  EXPECT_EQ(found.version, expected.version);
  EXPECT_EQ(found.options, expected.options);
  ASSERT_EQ(found.inputs.size(), expected.inputs.size());
  for (std::size_t i = 0; i < found.inputs.size(); ++i) {
    EXPECT_EQ(found.inputs[i].file, expected.inputs[i].file);
    EXPECT_EQ(found.inputs[i].sha256, expected.inputs[i].sha256);
  }
}

template <typename Part>
void expect_same(const std::optional<Part>& found, const std::optional<Part>& expected) {
  ASSERT_EQ(found.has_value(), expected.has_value());
  if (found) expect_same(*found, *expected);
}

}  // namespace

void expect_same(const Calibration& found, const Calibration& expected) {
  expect_same(found.camera, expected.camera);
  expect_same(found.intrinsics_report, expected.intrinsics_report);
  expect_same(found.rotation_center, expected.rotation_center);
  expect_same(found.dispersion, expected.dispersion);
  expect_same(found.adjustment, expected.adjustment);
  expect_same(found.covariance, expected.covariance);
  ASSERT_EQ(found.history.size(), expected.history.size());
  for (std::size_t i = 0; i < found.history.size(); ++i) {
    SCOPED_TRACE(i);
    expect_same(found.history[i], expected.history[i]);
  }
}

}  // namespace vlp
