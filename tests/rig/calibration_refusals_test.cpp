// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "rig/samples.h"

namespace vlp {
namespace {

using testing::HasSubstr;

std::string calibration_refusal(const std::string& yaml) {
  const TemporaryFolder folder;
  return refusal(read_calibration, folder.file("calibration.yaml", yaml));
}

/// Returns "calibration.yaml:LINE: " for the line of the sample with `text`.
std::string line_prefix(const std::string& text) {
  const auto begin = kCalibrationYaml.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(kCalibrationYaml.find(text));
  return "calibration.yaml:" + std::to_string(std::count(begin, end, '\n') + 1) + ": ";
}

struct Case {
  std::string from;
  std::string to;
  std::string problem;  // begins with the key
  std::string at = {};  // text of the reported line, if it is not that of `from`
};

void expect_refused(const std::vector<Case>& cases) {
  for (const Case& c : cases) {
    SCOPED_TRACE(c.from + " -> " + c.to);
    EXPECT_THAT(calibration_refusal(changed(kCalibrationYaml, c.from, c.to)),
                testing::StartsWith(line_prefix(c.at.empty() ? c.from : c.at) + c.problem));
  }
}

TEST(ReadCalibration, ReportsLineAndKeyOfInvalidCamera) {
  const std::string unit = ": is it in the right unit?";
  expect_refused(
      {{"id: \"007\"", "id:", "camera.id: should be text, not nothing"},
       {"[100000, 1200]", "[1600, 0]", "camera.imager_px[1]: should be a whole number within 1"},
       {"[100000, 1200]", "[1600]", "camera.imager_px: should be [width, height]"},
       {"[100000, 1200]", "1600x1200", "camera.imager_px: should be a list, not '1600x1200'"},
       {"LENSMODEL_OPENCV4", "OPENCV4",
        "camera.lens_model: 'OPENCV4' is unknown; the models are: LENSMODEL_PINHOLE, LENSMODEL_"},
       {"LENSMODEL_OPENCV4\n", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3\n",
        "camera.lens_model: 'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3' is unknown"},
       {", -0.002]", "]", "camera.intrinsics: should be 8 numbers, not 7"},
       {"-0.002]", "-0.002, 0]", "camera.intrinsics: should be 8 numbers, not 9"},
       {"-0.002]", ".nan]", "camera.intrinsics[7]: should be a finite number, not '.nan'"},
       {"[1200.5, 1201,", "[-1200, 1201,",
        "camera.intrinsics: the focal lengths, the first two, should be positive"},
       {"3.45e-06", "3.45",
        "camera.pixel_pitch_m: 3.45 m is not within 1.0e-07 and 0.0001 m" + unit},
       {"3.45e-06", "0.0008", "camera.pixel_pitch_m: 0.0008 m is not within"},  // 0.8 um in mm
       {"0.00001", "10", "camera.row_time_s: 10 s is not within 1.0e-08 and 0.001 s" + unit},
       {"0.00001", "0.01", "camera.row_time_s: 0.01 s is not within"},  // 10 us in ms
       {"0.00001", "1.0e-5 s", "camera.row_time_s: should be a finite number, not '1.0e-5 s'"},
       {"columns", "cols", "camera.readout: 'cols' is unknown; the readout is along rows or"},
       {"readout:", "read_out:", "camera: key 'read_out' is unknown; the keys are: id, "}});
}

TEST(ReadCalibration, ReportsLineAndKeyOfInvalidIntrinsicsReport) {
  expect_refused(
      {{"views: 40", "views: -1", "intrinsics_report.views: should be a whole number within 0 and"},
       {"corners: 6400", "corners: many", "intrinsics_report.corners: should be a whole number"},
       {"outliers: 12", "outliers: 1.5", "intrinsics_report.outliers: should be a whole number"},
       {"rms_px: 0.21", "rms_px: -0.21", "intrinsics_report.rms_px: -0.21 px is not within 0 and"},
       {"rms_px: 0.21", "rms_px: nan", "intrinsics_report.rms_px: should be a finite number"},
       {"[0.0001, -2.5e-05]", "[0.0001]", "intrinsics_report.board_warp_m: should be 2 numbers"},
       {"expected_max_error_px: 0.08", "expected_max_error_px: -1",
        "intrinsics_report.expected_max_error_px: -1 px is"},
       {"expected_max_error_px", "uncertainty_mm",
        "intrinsics_report: key 'uncertainty_mm' is unknown"}});
}

TEST(ReadCalibration, ReportsLineAndKeyOfInvalidRotationCenter) {
  expect_refused(
      {{"model: tilt", "model: turn",
        "rotation_center.model: 'turn' is unknown; the models are: shift, tilt"},
       {"[801.25, 597.5]", "[801.25]", "rotation_center.center_px: should be 2 numbers, not 1"},
       {"[0.6, 0, 0.8]", "[0.6, 0, 0.81]",
        "rotation_center.zenith_in_camera: should be a unit vector with z > 0"},
       {"[0.6, 0, 0.8]", "[0.6, 0, -0.8]", "rotation_center.zenith_in_camera: should be a unit"},
       {"[0.6, 0, 0.8]", "[1, 0, 0]", "rotation_center.zenith_in_camera: should be a unit vector"},
       {"[0.6, 0, 0.8]", "[0, 0, 0]", "rotation_center.zenith_in_camera: should be a unit vector"},
       {"[0.012, -0.009]", "[0.012]", "rotation_center.lever_arm_m: should be 2 numbers, not 1"},
       {"center_px:", "middle_px:",
        "rotation_center: key 'center_px' is missing; the keys are: model, middle_px, "
        "zenith_in_camera",
        "model: tilt"}});
}

TEST(ReadCalibration, ReportsLineAndKeyOfInvalidDispersion) {
  expect_refused(
      {{"[1.5, -0.75]", "1.5", "dispersion.offset_px: should be a list, not '1.5'"},
       {"radius_m: 0.0031", "radius_m: -0.0031", "dispersion.radius_m: -0.0031 m is not within 0"},
       {"radius_m: 0.0031", "radius_m: 3.1 mm", "dispersion.radius_m: should be a finite number"},
       {"[0.002, -0.001]", "[0.002, .inf]", "dispersion.center_m[1]: should be a finite number"},
       {"captures: 12", "captures: 0", "dispersion.captures: should be a whole number within 1"},
       {"captures: 12", "note: x\n  captures: 12", "dispersion: key 'note' is unknown; "}});
}

TEST(ReadCalibration, ReportsLineAndKeyOfInvalidHistory) {
  expect_refused(
      {{"history:", "x: 1\nhistory:", "key 'x' is unknown"},
       {"program: vlp-intrinsics", "program: [a]",
        "history[0].program: should be text, not a list"},
       {"version: \"0.1.0\"", "versions: 1",
        "history[0]: key 'version' is missing; the keys are: part, program, versions",
        "part: camera"},
       {", sha256: \"2d3c\"", "",
        "history[0].inputs[1]: key 'sha256' is missing; the keys are: file"},
       {"sha256: \"0f1e\"", "sha256: a, size: 3", "history[0].inputs[0]: key 'size' is unknown"},
       {"[]\n", "none\n", "history[1].inputs: should be a list, not 'none'"}});
}

TEST(ReadCalibration, ReportsMissingKeyOfEachPart) {
  for (const std::string key : {"views", "corners", "outliers", "rms_px", "model", "center_px",
                                "zenith_in_camera", "offset_px", "radius_m", "center_m", "captures",
                                "id", "imager_px", "lens_model", "intrinsics"}) {
    const std::size_t begin = kCalibrationYaml.find("\n  " + key + ":") + 1;
    const std::size_t end = kCalibrationYaml.find('\n', begin) + 1;
    EXPECT_THAT(calibration_refusal(
                    changed(kCalibrationYaml, kCalibrationYaml.substr(begin, end - begin), "")),
                HasSubstr(": key '" + key + "' is missing"));
  }
}

TEST(ReadCalibration, RejectsHistoryEntryWhosePartIsMissing) {
  const std::size_t begin = kCalibrationYaml.find("dispersion:\n");
  const std::size_t end = kCalibrationYaml.find("camera:\n");
  EXPECT_EQ(calibration_refusal(
                changed(kCalibrationYaml, kCalibrationYaml.substr(begin, end - begin), "")),
            "calibration.yaml:10: history[1]: lists a part 'dispersion': is the file cut short?");
}

}  // namespace
}  // namespace vlp
