// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration_builder.h"

#include <gmock/gmock.h>

#include "rig/calibration_error.h"
#include "rig/samples.h"

namespace vlp {
namespace {

HistoryEntry entry_of(const std::string& program) { return {"", program, "1.2.3", "", {}}; }

/// Returns sample_calibration() with the rotation center in the history, too.
Calibration whole_calibration() {
  Calibration calibration = sample_calibration();
  calibration.history.insert(calibration.history.begin() + 1,
                             {"rotation_center", "vlp-rotation", "0.1.0", "", {}});
  return calibration;
}

TEST(MakeCalibration, ContainsOnlyCameraIntrinsicsReportAndHistoryEntry) {
  const Calibration sample = sample_calibration();
  Calibration expected = sample;
  expected.rotation_center.reset();
  expected.dispersion.reset();
  expected.covariance.reset();
  expected.history = {{"camera", "vlp-intrinsics", "1.2.3", "", {}}};
  expect_same(make_calibration(sample.camera, sample.intrinsics_report, entry_of("vlp-intrinsics")),
              expected);
}

TEST(AddRotationCenter, AddsRotationCenterAndHistoryEntryToCameraAlone) {
  Calibration before = whole_calibration();
  const RotationCenter center = *before.rotation_center;
  before.rotation_center.reset();
  before.dispersion.reset();
  before.history.resize(1);
  Calibration expected = before;
  expected.rotation_center = center;
  expected.history.push_back({"rotation_center", "vlp-rotation", "1.2.3", "", {}});
  expect_same(add_rotation_center(before, center, before.covariance, entry_of("vlp-rotation")),
              expected);
}

TEST(AddRotationCenter, ReplacesRotationCenterAndRemovesDispersion) {
  RotationCenter center = *sample_calibration().rotation_center;
  center.center_px = {1, 2};
  Calibration expected = whole_calibration();
  expected.rotation_center = center;
  expected.dispersion.reset();
  expected.covariance.reset();
  expected.history.resize(1);
  expected.history.push_back({"rotation_center", "vlp-rotation", "1.2.3", "", {}});
  expect_same(
      add_rotation_center(whole_calibration(), center, std::nullopt, entry_of("vlp-rotation")),
      expected);
}

TEST(AddDispersion, ReplacesDispersionAndKeepsOtherParts) {
  const Dispersion dispersion{{3, 4}, 0.5, {6, 7}, 8};
  Calibration expected = whole_calibration();
  expected.dispersion = dispersion;
  expected.covariance = {{}, {"zenith_x", "zenith_y"}, Matrix2::Identity()};
  expected.history[2] = {"dispersion", "vlp-dispersion", "1.2.3", "", {}};
  expect_same(add_dispersion(whole_calibration(), dispersion, expected.covariance,
                             entry_of("vlp-dispersion")),
              expected);
}

/// Lamp 7 is correlated with the zenith, as in an adjustment; lamp 8 with the offset only.
TEST(RemoveDispersion, RemovesRowsOfOffsetAndOfItsLampsButKeepsAdjustedLamps) {
  Calibration calibration = whole_calibration();
  calibration.adjustment = Adjustment{{"rotation"}, 12, 70, 0.05};
  JointCovariance& joint = *calibration.covariance;
  joint.matrix.topRightCorner<2, 3>().setConstant(1e-7);
  joint.matrix.bottomLeftCorner<3, 2>().setConstant(1e-7);
  Calibration expected = calibration;
  expected.dispersion.reset();
  expected.history.pop_back();
  joint.lamps.push_back({8, {0.5, 0, 2.1}});
  append_parameters(joint, list_lamp_parameters(8), Eigen::MatrixXd::Zero(3, 5),
                    1e-6 * Eigen::MatrixXd::Identity(3, 3));
  append_parameters(joint, list_pair_names(kOffsetParameter), Eigen::MatrixXd::Ones(2, 8),
                    Eigen::MatrixXd::Identity(2, 2));
  expect_same(remove_dispersion(calibration), expected);
}

TEST(AddRotationCenter, ResultIsUnchangedByWritingAndReading) {
  const TemporaryFolder folder;
  const Calibration given =
      add_rotation_center(whole_calibration(), *sample_calibration().rotation_center,
                          sample_calibration().covariance, entry_of("vlp-rotation"));
  write_calibration(folder / "calibration.yaml", given);
  expect_same(read_calibration(folder / "calibration.yaml"), given);
}

}  // namespace
}  // namespace vlp
