// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/camera_exports.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <opencv2/core/persistence.hpp>
#include <stdexcept>
#include <string>

namespace vlp {
namespace {

Camera camera_with(LensModel model, std::vector<double> intrinsics) {
  return {"007", {800, 600}, model, std::move(intrinsics), {}, {}, {}};
}

const Camera kFour = camera_with(LensModel::opencv4, {500, 501, 400, 300, 0.1, -0.2, 1e-7, 0.004});
const Camera kEight = camera_with(
    LensModel::opencv8, {500, 501, 400, 300, 0.1, -0.2, 0.003, 0.004, 0.05, 0.06, 0.07, 0.08});

TEST(CameraExports, FormatFunctionsThrowForUnsupportedLensModel) {
  EXPECT_THROW(format_camchain(kEight), std::invalid_argument);
  const Camera round = camera_with(LensModel::stereographic, {500, 501, 400, 300});
  EXPECT_THROW(format_ros(round), std::invalid_argument);
  EXPECT_THROW(format_opencv(round), std::invalid_argument);
}

const Camera kExportedPinhole = camera_with(LensModel::pinhole, {510.5, 501, 400, 300.25});
const Camera kFisheye = camera_with(LensModel::fisheye, {500, 501, 400, 300, 0.1, -0.2, 0.3, 0.04});

/// Returns the message of an exception for a camera; "" without one.
template <typename Format>
std::string message_for(const Format& format, const Camera& camera) {
  try {
    format(camera);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(FormatRos, WritesAllFieldsForPinhole) {
  EXPECT_EQ(format_ros(kExportedPinhole),
            "image_width: 800\n"
            "image_height: 600\n"
            "camera_name: '007'\n"
            "camera_matrix:\n"
            "  rows: 3\n"
            "  cols: 3\n"
            "  data: [510.5, 0, 400, 0, 501, 300.25, 0, 0, 1]\n"
            "distortion_model: plumb_bob\n"
            "distortion_coefficients:\n"
            "  rows: 1\n"
            "  cols: 5\n"
            "  data: [0, 0, 0, 0, 0]\n"
            "rectification_matrix:\n"
            "  rows: 3\n"
            "  cols: 3\n"
            "  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
            "projection_matrix:\n"
            "  rows: 3\n"
            "  cols: 4\n"
            "  data: [510.5, 0, 400, 0, 0, 501, 300.25, 0, 0, 0, 1, 0]\n");
}

TEST(FormatRos, WritesAsManyCoefficientsAsEachModelHas) {
  struct Expected {
    Camera camera;
    std::string distortion;
    std::size_t count;
  };
  const Camera five =
      camera_with(LensModel::opencv5, {500, 501, 400, 300, 0.1, -0.2, 0.003, 0.004, 0.05});
  for (const auto& [camera, distortion, count] :
       {Expected{kFour, "plumb_bob", 5}, Expected{five, "plumb_bob", 5},
        Expected{kEight, "rational_polynomial", 8}, Expected{kFisheye, "equidistant", 4}}) {
    const YAML::Node info = YAML::Load(format_ros(camera));
    EXPECT_EQ(info["distortion_model"].as<std::string>(), distortion);
    const YAML::Node coefficients = info["distortion_coefficients"];
    EXPECT_EQ(coefficients["cols"].as<std::size_t>(), count);
    const auto data = coefficients["data"].as<std::vector<double>>();
    ASSERT_EQ(data.size(), count);
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_given = i + 4 < camera.intrinsics.size();
      EXPECT_EQ(data[i], is_given ? camera.intrinsics[i + 4] : 0) << i;
    }
  }
}

TEST(FormatRos, QuotesNameAndThrowsForControlCharactersAndInvalidUtf8) {
  const auto info_with_name = [](const std::string& name) {
    Camera camera = kExportedPinhole;
    camera.id = name;
    return format_ros(camera);
  };
  EXPECT_NE(info_with_name("it's").find("\ncamera_name: 'it''s'\n"), std::string::npos);
  EXPECT_NE(info_with_name(" ~").find("\ncamera_name: ' ~'\n"), std::string::npos);
  EXPECT_NE(info_with_name("\xc3\xa4").find("\ncamera_name: '\xc3\xa4'\n"), std::string::npos);
  for (const char* const name : {"a\nb", "\x1f", "a\x7f", "\xc3", "ab\xff"}) {
    EXPECT_THROW(info_with_name(name), std::invalid_argument);
  }
  Camera line_feed = kExportedPinhole;
  line_feed.id = "\n";
  EXPECT_EQ(message_for(format_ros, line_feed),
            "the camera id contains control characters or is not UTF-8; give another one with "
            "--camera-id");
}

TEST(FormatCamchain, WritesAllFields) {
  EXPECT_EQ(format_camchain(kFisheye),
            "cam0:\n"
            "  camera_model: pinhole\n"
            "  intrinsics: [500, 501, 400, 300]\n"
            "  distortion_model: equidistant\n"
            "  distortion_coeffs: [0.1, -0.2, 0.3, 0.04]\n"
            "  resolution: [800, 600]\n"
            "  rostopic: /cam0/image_raw\n");
  const YAML::Node plain = YAML::Load(format_camchain(kExportedPinhole))["cam0"];
  EXPECT_EQ(plain["distortion_model"].as<std::string>(), "radtan");
  EXPECT_EQ(plain["distortion_coeffs"].as<std::vector<double>>(), std::vector<double>(4, 0));
  const YAML::Node four = YAML::Load(format_camchain(kFour))["cam0"];
  EXPECT_EQ(four["distortion_model"].as<std::string>(), "radtan");
  EXPECT_EQ(four["distortion_coeffs"].as<std::vector<double>>(),
            (std::vector<double>{0.1, -0.2, 1e-7, 0.004}));
}

TEST(FormatOpencv, WritesAllFieldsForFisheye) {
  EXPECT_EQ(format_opencv(kFisheye),
            "%YAML:1.0\n"
            "---\n"
            "image_width: 800\n"
            "image_height: 600\n"
            "distortion_model: fisheye\n"
            "camera_matrix: !!opencv-matrix\n"
            "   rows: 3\n"
            "   cols: 3\n"
            "   dt: d\n"
            "   data: [500, 0, 400, 0, 501, 300, 0, 0, 1]\n"
            "distortion_coefficients: !!opencv-matrix\n"
            "   rows: 1\n"
            "   cols: 4\n"
            "   dt: d\n"
            "   data: [0.1, -0.2, 0.3, 0.04]\n");
}

TEST(FormatOpencv, WritesFourZerosForPinholeAndTwelveCoefficientsOfOpencv12) {
  const std::string plain = format_opencv(kExportedPinhole);
  EXPECT_EQ(plain.find("distortion_model"), std::string::npos);
  EXPECT_NE(plain.find("cols: 4\n   dt: d\n   data: [0, 0, 0, 0]\n"), std::string::npos);
  const std::string twelve = format_opencv(camera_with(
      LensModel::opencv12, {500, 501, 400, 300, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
  EXPECT_NE(twelve.find("cols: 12\n   dt: d\n   data: [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]\n"),
            std::string::npos);
}

TEST(FormatCameramodel, WritesAllFieldsAndClosedRegion) {
  const ImageRegion region{{1, 2}, {700.5, 3}, {400, 500}};
  EXPECT_EQ(format_cameramodel(kExportedPinhole, region),
            "{\n"
            "    'lensmodel':  'LENSMODEL_PINHOLE',\n"
            "    'intrinsics': [510.5, 501, 400, 300.25],\n"
            "    'valid_intrinsics_region': [[1, 2], [700.5, 3], [400, 500], [1, 2]],\n"
            "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n"
            "    'imagersize': [ 800, 600 ]\n"
            "}\n");
  EXPECT_EQ(format_mrcal_region({}), "");
  EXPECT_EQ(format_cameramodel(kExportedPinhole),
            "{\n"
            "    'lensmodel':  'LENSMODEL_PINHOLE',\n"
            "    'intrinsics': [510.5, 501, 400, 300.25],\n"
            "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],\n"
            "    'imagersize': [ 800, 600 ]\n"
            "}\n");
}

}  // namespace
}  // namespace vlp
