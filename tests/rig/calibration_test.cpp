// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/calibration.h"
#include "camera/spline_grid.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "rig/calibration_text.h"
#include "rig/samples.h"

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
  EXPECT_EQ(format_calibration_yaml(sample_calibration()), kCalibrationYaml);
}

TEST(ReadCalibration, AcceptsPartsInAnyOrder) {
  const TemporaryFolder folder;
  const std::size_t camera = kCalibrationYaml.find("camera:\n  id:");
  const std::string reordered = "format: vlp-calibration/1\n" + kCalibrationYaml.substr(camera) +
                                kCalibrationYaml.substr(26, camera - 26);
  expect_same(read_calibration(folder.file("calibration.yaml", reordered)), sample_calibration());
}

TEST(WriteCalibration, RoundTripsCovariancesDerivativesAndAdjustment) {
  Calibration calibration = sample_calibration();
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(12 + 6, 12 + 6);
  Eigen::MatrixXd covariance = 0.01 * root * root.transpose();
  covariance = 0.5 * (covariance + covariance.transpose()).eval();  // to the last bit
  calibration.intrinsics_report->covariance = covariance.topLeftCorner(8, 8);
  calibration.rotation_center->jacobian_wrt_intrinsics = root.topLeftCorner(2, 8);
  calibration.dispersion->jacobian_wrt_zenith = Matrix2{{-1, 0.1}, {0, -1}};
  calibration.dispersion->uncertain_lamps = {{3, {1, 2, 3}, 0.002, root.topLeftCorner(2, 3)},
                                             {7, {-1, 0, 3}, 0.001, root.topRightCorner(2, 3)}};
  calibration.adjustment = Adjustment{
      {{3, {1, 2, 3}}, {7, {-1, 0, 3}}}, covariance, {"rotation", "survey"}, 12, 70, 0.05};
  expect_kept(calibration);
}

TEST(ReadCalibration, RejectsAdjustmentWithMissingStateRowOrInvalidCorrelation) {
  const TemporaryFolder folder;
  Calibration calibration = sample_calibration();
  calibration.adjustment =
      Adjustment{{{3, {1, 2, 3}}}, Eigen::MatrixXd::Identity(15, 15), {"rotation"}, 12, 70, 0.05};
  write_calibration(folder / "good.yaml", calibration);
  const std::string good = folder.read_content(folder / "good.yaml");
  const auto refusal = [&](const std::string& from, const std::string& to) {
    const auto file = folder.file("bad.yaml", changed(good, from, to));
    try {
      read_calibration(file);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal("zenith_x", "zenith_y"), testing::HasSubstr("zenith_x is missing"));
  EXPECT_THAT(refusal("    - [0, 1]", "    - [2, 1]"), testing::HasSubstr("correlation"));
  EXPECT_THAT(refusal("    - [1]\n", ""), testing::HasSubstr("15 rows of 1, 2, 3"));
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
      [](Calibration& c) { c.rotation_center->covariance.reset(); },
      [](Calibration& c) { c.rotation_center->lever_arm_covariance.reset(); },
      [](Calibration& c) {
        c.rotation_center->lever_arm_covariance.reset();
        c.rotation_center->lever_arm_m.reset();
      },
      [](Calibration& c) { c.dispersion->covariance.reset(); },
      [](Calibration& c) { c.intrinsics_report.reset(); },
      [](Calibration& c) { c.rotation_center.reset(); },
      [](Calibration& c) { c.history.clear(); },
      [](Calibration& c) { c.dispersion.reset(); }};
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
                                          {lens_model_for_spline_grid({3, 4, 5, 90}), 44}}) {
    Calibration calibration = bare_calibration();
    calibration.camera.lens_model = model;
    for (int i = 4; i < parameters; ++i) calibration.camera.intrinsics.push_back(i * -1e-3);
    expect_kept(calibration);
  }
}

TEST(WriteCalibration, RoundTripsCovarianceAndJacobiansOfSplinedLensCore) {
  Calibration calibration = sample_calibration();
  calibration.camera.lens_model = lens_model_for_spline_grid({2, 3, 3, 120});
  calibration.camera.intrinsics.resize(num_lens_parameters(calibration.camera.lens_model), 0.25);
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(4, 4);
  const Eigen::MatrixXd covariance = 0.01 * root * root.transpose();
  calibration.intrinsics_report->covariance = 0.5 * (covariance + covariance.transpose()).eval();
  calibration.rotation_center->jacobian_wrt_intrinsics = root.topRows(2);
  calibration.dispersion->jacobian_wrt_intrinsics = root.bottomRows(2);
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
                              1,
                              {}};
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
    calibration.rotation_center->covariance = sd * sd.transpose();
    expect_kept(calibration);
  }
}

}  // namespace
}  // namespace vlp
