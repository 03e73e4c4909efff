// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration.h"
#include "camera/spline_grid.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "rig/calibration_error.h"
#include "rig/samples.h"
#include "rig/yaml_documents.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

/// Writes, reads and writes again: values and bytes do not change.
void expect_kept(const Calibration& calibration) {
  const TemporaryFolder folder;
  write_calibration(folder / "first.yaml", calibration);
  const Calibration found = read_calibration(folder / "first.yaml");
  expect_same(found, calibration);
  write_calibration(folder / "second.yaml", found);
  EXPECT_EQ(folder.read_content(folder / "second.yaml"),
            folder.read_content(folder / "first.yaml"));
}

TEST(ReadCalibration, ReadsEveryKey) {
  const TemporaryFolder folder;
  const auto file = folder.file("calibration.yaml", kCalibrationYaml);
  // The history lacks the rotation center: it may have fewer parts than the file.
  expect_same(read_calibration(file), sample_calibration());
}

TEST(WriteCalibration, WritesExpectedYamlByteForByte) {
  const TemporaryFolder folder;
  write_calibration(folder / "calibration.yaml", sample_calibration());
  EXPECT_EQ(folder.read_content(folder / "calibration.yaml"), kCalibrationYaml);
  EXPECT_EQ(format_calibration(sample_calibration()), kCalibrationYaml);
}

TEST(ReadCalibration, AcceptsPartsInAnyOrder) {
  const TemporaryFolder folder;
  const std::size_t camera = kCalibrationYaml.find("camera:\n  id:");
  const std::string reordered = "format: vlp-calibration/1\n" + kCalibrationYaml.substr(camera) +
                                kCalibrationYaml.substr(26, camera - 26);
  expect_same(read_calibration(folder.file("calibration.yaml", reordered)), sample_calibration());
}

/// Returns the sample with a joint covariance of all kinds of parameters.
Calibration calibration_with_joint_covariance() {
  Calibration calibration = sample_calibration();
  calibration.history.clear();
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(8, 8);
  calibration.intrinsics_report->covariance =
      0.01 * root * root.transpose() + 0.1 * Eigen::MatrixXd::Identity(8, 8);
  JointCovariance joint = make_lens_covariance(calibration);
  calibration.intrinsics_report->covariance = joint.matrix;
  const auto append = [&](std::span<const std::string> names) {
    const auto size = std::ssize(names);
    append_parameters(joint, names, Eigen::MatrixXd::Random(size, joint.matrix.rows()),
                      0.01 * Eigen::MatrixXd::Identity(size, size));
  };
  append(list_pair_names(kZenithParameter));
  append(list_pair_names(kLeverArmParameter));
  joint.lamps = {{3, {1, 2, 3}}, {7, {-1, 0, 3}}};
  for (const auto& lamp : joint.lamps) append(list_lamp_parameters(lamp.id));
  append(list_pair_names(kOffsetParameter));
  calibration.covariance = joint;
  calibration.adjustment = Adjustment{{"rotation", "survey"}, 12, 70, 0.05};
  return calibration;
}

TEST(WriteCalibration, RoundTripsJointCovarianceAndAdjustment) {
  expect_kept(calibration_with_joint_covariance());
}

TEST(ReadCalibration, RejectsJointCovarianceWithMissingOrUnknownRowOrInvalidCorrelation) {
  const TemporaryFolder folder;
  write_calibration(folder / "good.yaml", calibration_with_joint_covariance());
  const std::string joint = folder.read_content(folder / "good.yaml");
  const auto refusal_of = [&](const std::string& good, const std::string& from,
                              const std::string& to) {
    return refusal(read_calibration, folder.file("bad.yaml", changed(good, from, to)));
  };
  EXPECT_THAT(refusal_of(joint, "zenith_x, ", ""), testing::HasSubstr("lamp_3_x_m is missing"));
  EXPECT_THAT(refusal_of(joint, "zenith_y, ", ""), testing::HasSubstr("zenith_y is missing"));
  EXPECT_THAT(refusal_of(joint, "lamp_7_z_m, ", ""), testing::HasSubstr("lamp_7_z_m is missing"));
  EXPECT_THAT(refusal_of(joint, "offset_y", "offset_y, offset_z"),
              testing::HasSubstr("joint_covariance.parameters[20]: is not in its place"));
  EXPECT_THAT(refusal_of(joint, "id: 7", "id: 8"), testing::HasSubstr("lamp_8_x_m is missing"));
  EXPECT_THAT(refusal_of(joint, "parameters: [fx", "parameters: [fz"),
              testing::HasSubstr("lamp_3_x_m is missing"));
  EXPECT_THAT(refusal_of(kCalibrationYaml, "    - [0.04]\n", ""),
              testing::HasSubstr("should be 5 rows of 1, 2 ... numbers, the lower triangle"));
  EXPECT_THAT(refusal_of(kCalibrationYaml, "[0.01, 0.09]", "[0.1, 0.09]"),
              testing::HasSubstr("joint_covariance.rows[1]: is not a covariance's"));
  EXPECT_THAT(refusal_of(kCalibrationYaml, "[0.04]", "[-0.04]"),
              testing::HasSubstr("joint_covariance.rows[0]: is not a covariance's"));
  EXPECT_THAT(refusal_of(kCalibrationYaml, "0, 0.25]", "0, 2.5e12]"),
              testing::HasSubstr("a standard deviation beyond 1,000,000"));
  EXPECT_THAT(
      refusal_of(kCalibrationYaml, "[zenith_x", "[fx, fy, cx, cy, k1, k2, p1, p2, zenith_x"),
      testing::HasSubstr("intrinsics_report has no covariance"));
}

TEST(ReadCalibration, RejectsPartWithOwnCovarianceAndNamesProgramThatReplacesIt) {
  const TemporaryFolder folder;
  const auto refusal_with = [&](const std::string& line) {
    return refusal(read_calibration,
                   folder.file("old.yaml", changed(kCalibrationYaml, line,
                                                   line + "  covariance: [[1, 0], [0, 1]]\n")));
  };
  EXPECT_THAT(refusal_with("  center_px: [801.25, 597.5]\n"),
              testing::HasSubstr("rotation_center: key 'covariance' is now in joint_covariance: "
                                 "run vlp-rotation again on the calibration from before it"));
  EXPECT_THAT(refusal_with("  radius_m: 0.0031\n"), testing::HasSubstr("run vlp-dispersion again"));
}

TEST(WriteCalibration, OmitsInfiniteExpectedMaxError) {
  Calibration calibration = sample_calibration();
  calibration.intrinsics_report->expected_max_error_px = std::numeric_limits<double>::infinity();
  const TemporaryFolder folder;
  write_calibration(folder / "calibration.yaml", calibration);
  calibration.intrinsics_report->expected_max_error_px.reset();
  expect_same(read_calibration(folder / "calibration.yaml"), calibration);
}

TEST(WriteCalibration, RoundTripsCalibrationWithoutEachOptionalPart) {
  const std::function<void(Calibration&)> removals[] = {
      [](Calibration& c) { c.camera.pixel_pitch_m.reset(); },
      [](Calibration& c) { c.camera.row_time_s.reset(); },
      [](Calibration& c) { c.camera.readout.reset(); },
      [](Calibration& c) { c.intrinsics_report->board_warp_m.reset(); },
      [](Calibration& c) { c.intrinsics_report->expected_max_error_px.reset(); },
      [](Calibration& c) { c.covariance.reset(); },
      [](Calibration& c) { c.rotation_center->lever_arm_m.reset(); },
      [](Calibration& c) { c.intrinsics_report.reset(); },
      [](Calibration& c) { c.rotation_center.reset(), c.covariance.reset(); },
      [](Calibration& c) { c.history.clear(); },
      [](Calibration& c) { c.dispersion.reset(), c.covariance.reset(); }};
  Calibration with_less_and_less = sample_calibration();
  for (const auto& remove : removals) {
    Calibration calibration = sample_calibration();
    calibration.history.pop_back();  // the entry of the dispersion
    remove(calibration);
    expect_kept(calibration);
    remove(with_less_and_less);
    expect_kept(with_less_and_less);
  }
}

TEST(ReadCalibration, RejectsCovarianceOfMissingRotationCenter) {
  Calibration calibration = sample_calibration();
  calibration.rotation_center.reset();
  const TemporaryFolder folder;
  write_calibration(folder / "a.yaml", calibration);
  EXPECT_THAT(rejection_message([&] { read_calibration(folder / "a.yaml"); }),
              testing::HasSubstr("has zenith_x, which the calibration does not have"));
}

TEST(WriteCalibration, RoundTripsEachRotationModelAndReadout) {
  for (const RotationModel model : {RotationModel::shift, RotationModel::tilt}) {
    for (const Readout readout : {Readout::rows, Readout::columns}) {
      Calibration calibration = sample_calibration();
      calibration.rotation_center->model = model;
      calibration.camera.readout = readout;
      expect_kept(calibration);
    }
  }
}

TEST(WriteCalibration, RoundTripsParametersOfEachLensModel) {
  for (const auto& [model, parameters] : {std::pair{LensModel::pinhole, 4},
                                          {LensModel::stereographic, 4},
                                          {LensModel::opencv4, 8},
                                          {LensModel::opencv5, 9},
                                          {LensModel::opencv8, 12},
                                          {LensModel::opencv12, 16},
                                          {LensModel::fisheye, 8},
                                          {splined_lens_model({3, 4, 5, 90}), 44}}) {
    Calibration calibration = bare_calibration();
    calibration.camera.lens_model = model;
    for (int i = 4; i < parameters; ++i) calibration.camera.intrinsics.push_back(i * -1e-3);
    expect_kept(calibration);
  }
}

TEST(WriteCalibration, RoundTripsCovarianceOfSplinedLensCore) {
  Calibration calibration = sample_calibration();
  calibration.camera.lens_model = splined_lens_model({2, 3, 3, 120});
  calibration.camera.intrinsics.resize(num_lens_parameters(calibration.camera.lens_model), 0.25);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(4, 4);
  const Eigen::MatrixXd covariance = 0.01 * root * root.transpose();
  calibration.intrinsics_report->covariance = 0.5 * (covariance + covariance.transpose()).eval();
  JointCovariance joint = make_lens_covariance(calibration);
  append_parameters(joint, list_pair_names(kZenithParameter), root.topRows(2),
                    Eigen::MatrixXd::Identity(2, 2));
  calibration.covariance = joint;
  expect_kept(calibration);
}

TEST(WriteCalibration, RoundTripsAnyText) {
  std::string all_ascii;
  for (char c = 0; c >= 0 && c < 127; ++c) all_ascii += c;
  for (const std::string& text :
       {std::string("007"), std::string("true"), std::string("~"), std::string("null"),
        std::string("1e3"), std::string(""), std::string(" two  spaces "),
        std::string("'single' and \"double\" quotes"), std::string("a: b, [c] {d} # e"),
        std::string("- \\ % @ ` & * ! | >"), std::string("first\nsecond\r\nthird\ttab"),
        std::string("Grüße, 校准, \U0001F4A1, e\u0301, \u00a0, \u2028"), std::string("\x7f"),
        all_ascii, std::string(3000, 'x')}) {
    SCOPED_TRACE(text);
    Calibration calibration = sample_calibration();
    calibration.camera.id = text;
    calibration.history[0] = {text, text, text, text, {{text, text}}};
    expect_kept(calibration);
  }
}

TEST(WriteCalibration, RoundTripsRandomNumbersExactly) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0, 1000);
  const auto random_number = [&] { return normal(random) * std::exp(normal(random) / 100); };
  for (int i = 0; i < 30; ++i) {
    Calibration calibration = sample_calibration();
    for (std::size_t k = 2; k < 8; ++k) calibration.camera.intrinsics[k] = random_number();
    calibration.intrinsics_report->rms_px = std::abs(random_number());
    calibration.intrinsics_report->board_warp_m = {random_number(), random_number()};
    calibration.rotation_center->center_px = {random_number(), random_number()};
    calibration.dispersion = {{random_number(), random_number()},
                              std::abs(random_number()),
                              {random_number(), random_number()},
                              1};
    expect_kept(calibration);
  }
}

TEST(WriteCalibration, RoundTripsUnitVectorsAndFullyCorrelatedCovariances) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 30; ++i) {
    Calibration calibration = sample_calibration();
    Eigen::Vector3d up(normal(random), normal(random), std::abs(normal(random)));
    calibration.rotation_center->zenith_in_camera = up.normalized();
    const Eigen::Vector2d sd(normal(random), normal(random));
    calibration.covariance = {{}, {"zenith_x", "zenith_y"}, sd * sd.transpose()};
    expect_kept(calibration);
  }
}

}  // namespace
}  // namespace vlp
