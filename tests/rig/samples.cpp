// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rig/samples.h"

namespace vlp {

const std::string kLampsYaml = R"(format: vlp-lamps/1
lamps:
  - {id: 1, position_m: [0.5, -0.3, 2.1], diameter_m: 0.18, frequency_hz: 2000, duty: 0.5}
  - {id: 7, position_m: [-0.25, 0, 2.1]}
)";

const std::string kBoardYaml = R"(format: vlp-board/1
family: tag36h11
cols: 8
rows: 5
tag_size_m: 0.016
tag_spacing: 0.3
border_bits: 2
corner_squares: true
first_id: 1
id_order: column-major-from-top-left
)";

const std::string kCalibrationYaml = R"(format: vlp-calibration/1
history:
  - part: camera
    program: vlp-intrinsics
    version: "0.1.0"
    options: "--board board.yaml --row-time-s 55e-6"
    inputs:
      - {file: "boards/1.png", sha256: "0f1e"}
      - {file: "board.yaml", sha256: "2d3c"}
  - part: dispersion
    program: vlp-dispersion
    version: "0.1.0"
    options: ""
    inputs:
      []
intrinsics_report:
  views: 40
  corners: 6400
  outliers: 12
  rms_px: 0.21
  board_warp_m: [0.0001, -2.5e-05]
  expected_max_error_px: 0.08
  valid_region_px: [[10, 20], [1500, 20.5], [700, 1100]]
rotation_center:
  model: tilt
  center_px: [801.25, 597.5]
  zenith_in_camera: [0.6, 0, 0.8]
  lever_arm_m: [0.012, -0.009]
dispersion:
  offset_px: [1.5, -0.75]
  radius_m: 0.0031
  center_m: [0.002, -0.001]
  captures: 12
joint_covariance:
  lamps:
    - {id: 7, position_m: [-0.25, 0, 2.1]}
  parameters: [zenith_x, zenith_y, lamp_7_x_m, lamp_7_y_m, lamp_7_z_m]
  rows:
    - [0.04]
    - [0.01, 0.09]
    - [0, 0, 0.0004]
    - [0, 0.01, 0, 0.0025]
    - [0, 0, 0, 0, 0.25]
camera:
  id: "007"
  pixel_pitch_m: 3.45e-06
  row_time_s: 0.00001
  readout: columns
  imager_px: [100000, 1200]
  lens_model: LENSMODEL_OPENCV4
  intrinsics: [1200.5, 1201, 800, 600, -0.1, 0.01, 0.001, -0.002]
)";

LampMap sample_lamps() {
  return {{{1, {0.5, -0.3, 2.1}, make_disc_lamp_shape(0.18), 2000.0, 0.5},
           {7, {-0.25, 0, 2.1}, {}, {}, {}}}};
}

Board sample_board() {
  return {"tag36h11", 8, 5, 0.016, 0.3, 2, true, 1, {true, BoardCorner::top_left}};
}

Calibration bare_calibration() {
  return {
      {"", {1600, 1200}, LensModel::pinhole, {1200, 1200, 800, 600}, {}, {}, {}}, {}, {}, {}, {}};
}

Calibration sample_calibration() {
  Calibration calibration;
  calibration.camera = {"007",
                        {100000, 1200},
                        LensModel::opencv4,
                        {1200.5, 1201, 800, 600, -0.1, 0.01, 0.001, -0.002},
                        3.45e-6,
                        1e-5,
                        Readout::columns};
  calibration.intrinsics_report = {40,
                                   6400,
                                   12,
                                   0.21,
                                   std::array{1e-4, -2.5e-5},
                                   0.08,
                                   {},
                                   {{10, 20}, {1500, 20.5}, {700, 1100}}};
  calibration.rotation_center = {
      RotationModel::tilt, {801.25, 597.5}, {0.6, 0, 0.8}, {{0.012, -0.009}}};
  calibration.dispersion = {{1.5, -0.75}, 0.0031, {0.002, -0.001}, 12};
  Eigen::MatrixXd matrix =
      Eigen::Vector<double, 5>(0.04, 0.09, 4e-4, 25e-4, 0.25).asDiagonal().toDenseMatrix();
  matrix(0, 1) = matrix(1, 0) = matrix(1, 3) = matrix(3, 1) = 0.01;
  calibration.covariance = {{{7, {-0.25, 0, 2.1}}},
                            {"zenith_x", "zenith_y", "lamp_7_x_m", "lamp_7_y_m", "lamp_7_z_m"},
                            matrix};
  calibration.history = {{"camera",
                          "vlp-intrinsics",
                          "0.1.0",
                          "--board board.yaml --row-time-s 55e-6",
                          {{"boards/1.png", "0f1e"}, {"board.yaml", "2d3c"}}},
                         {"dispersion", "vlp-dispersion", "0.1.0", "", {}}};
  return calibration;
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "no '" << from << "' to change";
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

}  // namespace vlp
