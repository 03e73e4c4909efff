// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/camera_exports.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <opencv2/core/persistence.hpp>
#include <stdexcept>

namespace vlp {
namespace {

Camera camera_with(LensModel model, std::vector<double> intrinsics) {
  return {"007", {800, 600}, model, std::move(intrinsics), {}, {}, {}};
}

const Camera kFour = camera_with(LensModel::opencv4, {500, 501, 400, 300, 0.1, -0.2, 1e-7, 0.004});
const Camera kEight = camera_with(
    LensModel::opencv8, {500, 501, 400, 300, 0.1, -0.2, 0.003, 0.004, 0.05, 0.06, 0.07, 0.08});

TEST(FormatOpencvCamera, WritesMatrixAndDistortionReadableByOpencv) {
  const cv::FileStorage file(format_opencv_camera(kEight),
                             cv::FileStorage::READ | cv::FileStorage::MEMORY);
  cv::Mat matrix, distortions;
  file["camera_matrix"] >> matrix;
  file["distortion_coefficients"] >> distortions;
  ASSERT_EQ(matrix.size(), cv::Size(3, 3));
  EXPECT_EQ(matrix.at<double>(1, 1), 501);
  EXPECT_EQ(matrix.at<double>(1, 2), 300);
  ASSERT_EQ(distortions.size(), cv::Size(8, 1));
  EXPECT_EQ(distortions.at<double>(0, 7), 0.08);
}

TEST(FormatRosCameraInfo, WritesDistortionModelAndCoefficients) {
  const YAML::Node eight = YAML::Load(format_ros_camera_info(kEight));
  EXPECT_EQ(eight["distortion_model"].as<std::string>(), "rational_polynomial");
  EXPECT_EQ(eight["distortion_coefficients"]["data"].size(), 8U);
  EXPECT_EQ(eight["projection_matrix"]["data"][6].as<double>(), 300);
  EXPECT_EQ(eight["camera_name"].as<std::string>(), "007");
  const YAML::Node four = YAML::Load(format_ros_camera_info(kFour));
  EXPECT_EQ(four["distortion_model"].as<std::string>(), "plumb_bob");
  EXPECT_EQ(four["distortion_coefficients"]["data"][2].as<double>(), 1e-7);
  EXPECT_EQ(four["distortion_coefficients"]["data"].size(), 5U);
}

TEST(FormatKalibrCamchain, WritesIntrinsicsAndResolution) {
  const YAML::Node camera = YAML::Load(format_kalibr_camchain(kFour))["cam0"];
  EXPECT_EQ(camera["distortion_coeffs"].size(), 4U);
  EXPECT_EQ(camera["intrinsics"][3].as<double>(), 300);
  EXPECT_EQ(camera["resolution"][1].as<int>(), 600);
}

TEST(CameraExports, FormatFunctionsThrowForUnsupportedLensModel) {
  EXPECT_THROW(format_kalibr_camchain(kEight), std::invalid_argument);
  const Camera round = camera_with(LensModel::stereographic, {500, 501, 400, 300});
  EXPECT_THROW(format_ros_camera_info(round), std::invalid_argument);
  EXPECT_THROW(format_opencv_camera(round), std::invalid_argument);
}

}  // namespace
}  // namespace vlp
