// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Export and import of cameras in the formats of other tools.
#include "calibration/intrinsics/camera_imports.h"

#include <gmock/gmock.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/sample_cameras.h"
#include "camera/lens.h"
#include "camera/spline_grid.h"
#include "rig/calibration.h"
#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

class ReadAnyCamera : public testing::Test {
 protected:
  const TemporaryFolder folder_;

  void comes_back(const Camera& camera, const std::string& text, LensModel as) const {
    const Camera back = read_any_camera(folder_.file("camera.txt", text)).camera;
    EXPECT_EQ(back.lens_model, as);
    EXPECT_EQ(back.imager_px, camera.imager_px);
    std::vector<double> expected = camera.intrinsics;
    expected.resize(num_lens_parameters(as), 0);
    EXPECT_EQ(back.intrinsics, expected);
  }
  std::string refusal(const std::string& text) const {
    try {
      read_any_camera(folder_.file("camera.txt", text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(ReadAnyCamera, ReturnsExportedCameraExactlyFromEachFormat) {
  for (const LensModel model : {LensModel::pinhole, LensModel::opencv4, LensModel::opencv5,
                                LensModel::opencv8, LensModel::opencv12, LensModel::fisheye}) {
    const Camera camera = make_camera(model);
    comes_back(camera, format_opencv(camera), model);
    if (model != LensModel::fisheye) comes_back(camera, format_cameramodel(camera), model);
    if (model == LensModel::opencv12) continue;
    const bool five = model == LensModel::opencv4;  // ROS writes k3, too
    comes_back(camera, format_ros(camera), five ? LensModel::opencv5 : model);
    if (model == LensModel::opencv5 || model == LensModel::opencv8) continue;
    comes_back(camera, format_camchain(camera), model);
  }
}

TEST_F(ReadAnyCamera, ReturnsSplinedLensExactlyFromCameramodel) {
  const Camera camera = splined_camera();
  comes_back(camera, format_cameramodel(camera), camera.lens_model);
  for (const auto& format_camera : {format_ros, format_camchain, format_opencv}) {
    EXPECT_THROW(format_camera(camera), std::invalid_argument);
  }
  std::string short_one = format_cameramodel(camera);
  short_one.replace(short_one.find("Nx=13"), 5, "Nx=14");
  EXPECT_THAT(refusal(short_one), testing::HasSubstr("takes 312 parameters, not 290"));
}

TEST(ConvertLensModel, ConvertsFisheyeToSplinedLensAndBackWithinFiveMillipixels) {
  const auto wide =
      convert_lens_model(make_camera(LensModel::fisheye), splined_lens_model({3, 20, 16, 190}));
  EXPECT_LT(wide.worst_px, 0.002);
  EXPECT_EQ(wide.common_fraction, 1);
  // The rays outside the grid do not count.
  const auto part =
      convert_lens_model(make_camera(LensModel::fisheye), splined_lens_model({3, 14, 12, 100}));
  EXPECT_LT(part.worst_px, 0.01);
  EXPECT_LT(part.common_fraction, 0.8);
  const auto back = convert_lens_model(wide.camera, LensModel::fisheye);
  EXPECT_LT(back.worst_px, 0.005);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(back.camera.intrinsics[i], make_camera(LensModel::fisheye).intrinsics[i], 0.01);
  }
  const auto near =
      convert_lens_model(make_camera(LensModel::opencv8), splined_lens_model({2, 20, 16, 100}));
  EXPECT_LT(near.worst_px, 0.2);  // quadratic pieces
}

/// Lenses of 10 degrees, with no, one or a few rays of a piece in the image, and of a strip with
/// one row of pieces. The recommended model has to fit.
TEST(ConvertLensModel, ThrowsRecommendingFittingGridWhenGridIsTooCoarse) {
  const auto expect_other = [](const Camera& camera, const SplineGrid& grid) {
    const std::string words =
        "the control points of " + splined_lens_name(grid) + " do not cover the field of view, ";
    std::string message;
    try {
      convert_lens_model(camera, splined_lens_model(grid));
    } catch (const std::invalid_argument& error) {
      message = error.what();
    }
    ASSERT_THAT(message, testing::StartsWith(words)) << camera.intrinsics[2];
    const auto model =
        lens_model_from_name(message.substr(message.find("LENSMODEL", words.size())));
    ASSERT_TRUE(model) << message;
    const FittedCamera fitted = convert_lens_model(camera, *model);
    EXPECT_LT(fitted.worst_px, 0.01) << message;
    EXPECT_EQ(fitted.common_fraction, 1) << message;
  };
  for (const double center_px : {399.5, 380.0, 250.0}) {
    const Camera narrow{
        "camera", {800, 600}, LensModel::pinhole, {4600, 4600, center_px, 299.5}, {}, {}, {}};
    for (const SplineGrid grid : {SplineGrid{3, 10, 10, 350}, {3, 11, 11, 350}, {2, 30, 30, 359}}) {
      expect_other(narrow, grid);
    }
  }
  const Camera strip{"camera", {2000, 100}, LensModel::pinhole, {4600, 4600, 999.5, 49.5}, {},
                     {},       {}};
  expect_other(strip, {3, 4, 4, 30});
}

/// Comments as in Python: from a # outside strings to the end of the line.
TEST_F(ReadAnyCamera, IgnoresCommentsInCameramodel) {
  const std::string text =
      "# 'lensmodel': 'LENSMODEL_OPENCV4'\n"
      "{ 'made_by': 'camera #3, \\'left\\'', 'lensmodel': 'LENSMODEL_PINHOLE', # isn't \"wide\"\n"
      "  'intrinsics': [ 520.25, 521.5, # focal lengths, [px]\n"
      "                  402, 297 ], # 'intrinsics': [ 1, 2, 3, 4 ]\n"
      "  \"imagersize\": (800, 600), # 'imagersize': [ 8, 6 ]\n"
      "} # end";
  comes_back({"camera", {800, 600}, LensModel::pinhole, {520.25, 521.5, 402, 297}, {}, {}, {}},
             text, LensModel::pinhole);
}

TEST(ConvertLensModel, IsExactOnlyIfTargetModelIncludesSourceModel) {
  // A model that includes the other fits exactly, another one approximately.
  const auto exact = convert_lens_model(make_camera(LensModel::opencv4), LensModel::opencv8);
  EXPECT_LT(exact.worst_px, 1e-6);
  EXPECT_EQ(exact.common_fraction, 1);
  const auto near = convert_lens_model(make_camera(LensModel::opencv8), LensModel::fisheye);
  EXPECT_LT(near.worst_px, 1);
  EXPECT_GT(near.worst_px, 1e-6);
  const auto same = convert_lens_model(make_camera(LensModel::opencv8), LensModel::opencv8);
  EXPECT_EQ(same.camera.intrinsics, make_camera(LensModel::opencv8).intrinsics);
  // Perspective models have no rays beyond 90 degrees.
  const auto half = convert_lens_model(make_camera(LensModel::fisheye), LensModel::opencv4);
  EXPECT_LT(half.common_fraction, 1);
}

/// A .cameramodel of a pinhole with other texts for its entries.
std::string cameramodel_with(const std::string& imagersize, const std::string& intrinsics,
                             const std::string& others = "") {
  return "{ 'lensmodel': 'LENSMODEL_PINHOLE', 'imagersize': " + imagersize +
         ", 'intrinsics': " + intrinsics + others + " }";
}

const Camera kPinhole{"camera", {800, 600}, LensModel::pinhole, {520, 521, 402, 297}, {}, {}, {}};

TEST_F(ReadAnyCamera, ReadsCameramodelWithAnyBracketsQuotesAndBlanks) {
  comes_back(kPinhole, cameramodel_with("(800,600)", "\t\r\n((520), [521, 402], 297)"),
             LensModel::pinhole);
  comes_back(kPinhole,
             "{\"lensmodel\" \t: \"LENSMODEL_PINHOLE\",'imagersize'\n:\n[ 800, 600 ],"
             "\"intrinsics\":[520,521,402,297]}",
             LensModel::pinhole);
  const ImportedCamera read =
      read_any_camera(folder_.file("a", cameramodel_with("[800, 600]", "[520, 521, 402, 297]")));
  EXPECT_EQ(read.camera.id, "camera");
  EXPECT_TRUE(read.region.empty());
}

TEST_F(ReadAnyCamera, ReadsOpenOrClosedPolygonOfValidRegion) {
  const auto with_region = [](const std::string& region) {
    return cameramodel_with("[800, 600]", "[520, 521, 402, 297]",
                            ", 'valid_intrinsics_region': " + region);
  };
  const ImageRegion three{{1, 2}, {300, 4}, {30, 400}};
  for (const char* const region :
       {"[[1, 2], [300, 4], [30, 400]]", "[[1, 2], [300, 4], [30, 400], [1, 2]]"}) {
    EXPECT_EQ(read_any_camera(folder_.file("a", with_region(region))).region, three);
  }
  for (const char* const region : {"[[1, 2], [300, 4]]", "[[1, 2], [300, 4], [1, 2]]",
                                   "[[1, 2], [300, 4], [30, 400], [1]]", "[1]"}) {
    EXPECT_THAT(refusal(with_region(region)),
                testing::EndsWith("'valid_intrinsics_region' should be three pixels or more"))
        << region;
  }
  EXPECT_THAT(refusal(with_region("[ ]")),
              testing::EndsWith("'valid_intrinsics_region' is empty, so the lens has no valid "
                                "region; leave the key out if it is valid in the whole image"));
}

/// OpenCV's text of a camera with these distortions, and further lines.
std::string opencv_text(const std::string& distortions, const std::string& others = "") {
  return "image_width: 800\nimage_height: 600\n"
         "camera_matrix: {rows: 3, cols: 3, data: [520, 0, 402, 0, 521, 297, 0, 0, 1]}\n"
         "distortion_coefficients: {data: " +
         distortions + "}\n" + others;
}

TEST_F(ReadAnyCamera, NumberOfYamlDistortionsDeterminesLensModel) {
  struct Expected {
    std::string distortions;
    LensModel model;
    std::size_t count;
  };
  for (const auto& [distortions, model, count] :
       {Expected{"[]", LensModel::pinhole, 0}, Expected{"[0, 0, 0, 0, 0]", LensModel::pinhole, 0},
        Expected{"[0, 0, 3, 4]", LensModel::opencv4, 4},
        Expected{"[1, 2, 3, 4, 0]", LensModel::opencv5, 5},
        Expected{"[1, 2, 3, 4, 5, 6, 7, 8]", LensModel::opencv8, 8},
        Expected{"[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]", LensModel::opencv12, 12},
        Expected{"[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 0]", LensModel::opencv12, 12}}) {
    const Camera camera = read_any_camera(folder_.file("a.yaml", opencv_text(distortions))).camera;
    EXPECT_EQ(camera.lens_model, model) << distortions;
    ASSERT_EQ(camera.intrinsics.size(), 4 + count);
    EXPECT_EQ(std::vector<double>(camera.intrinsics.begin(), camera.intrinsics.begin() + 4),
              (std::vector<double>{520, 521, 402, 297}));
    if (count > 0) EXPECT_EQ(camera.intrinsics[6], 3);
    EXPECT_EQ(camera.imager_px, (std::array{800, 600}));
    EXPECT_EQ(camera.id, "camera");
  }
  for (const char* const distortions : {"[1, 2, 3]", "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0]",
                                        "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 1, 0]",
                                        "[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 0, 1]"}) {
    EXPECT_THAT(
        refusal(opencv_text(distortions)),
        testing::EndsWith("distortions should be 0, 4, 5, 8 or 12 numbers, the sensor not tilted"))
        << distortions;
  }
}

TEST_F(ReadAnyCamera, ReadsYamlDistortionModelAndName) {
  const auto read = [&](const std::string& others) {
    return read_any_camera(folder_.file("a.yaml", opencv_text("[1, 2, 3, 4]", others))).camera;
  };
  EXPECT_EQ(read("").lens_model, LensModel::opencv4);
  for (const char* const name : {"plumb_bob", "rational_polynomial", "radtan", "none"}) {
    EXPECT_EQ(read(std::string("distortion_model: ") + name).lens_model, LensModel::opencv4);
  }
  for (const char* const fisheye :
       {"distortion_model: fisheye", "distortion_model: equidistant", "fisheye_model: 1"}) {
    const Camera camera = read(fisheye);
    EXPECT_EQ(camera.lens_model, LensModel::fisheye);
    EXPECT_EQ(camera.intrinsics, (std::vector<double>{520, 521, 402, 297, 1, 2, 3, 4}));
  }
  EXPECT_EQ(read("fisheye_model: 0").lens_model, LensModel::opencv4);
  EXPECT_EQ(read("fisheye_model: 1\ndistortion_model: plumb_bob").lens_model, LensModel::opencv4);
  EXPECT_EQ(read("camera_name: left").id, "left");
  EXPECT_THAT(refusal(opencv_text("[1, 2, 3]", "distortion_model: equidistant")),
              testing::EndsWith("equidistant has four coefficients"));
  EXPECT_THAT(refusal(opencv_text("[1, 2, 3, 4]", "distortion_model: thin_prism")),
              testing::EndsWith("there is no distortion model like thin_prism here"));
}

TEST_F(ReadAnyCamera, ReadsKalibrCameraWithAndWithoutDistortions) {
  const std::string head =
      "cam0:\n  camera_model: pinhole\n  intrinsics: [520, 521, 402, 297]\n"
      "  resolution: [800, 600]\n";
  comes_back(kPinhole, head, LensModel::pinhole);
  comes_back(kPinhole, head + "  distortion_model: none\n  distortion_coeffs: [1, 2, 3]\n",
             LensModel::pinhole);
  EXPECT_THAT(refusal(head + "  distortion_model: radtan\n"),
              testing::EndsWith("a list of numbers is missing"));
  EXPECT_THAT(refusal(head + "  distortion_model: radtan\n  distortion_coeffs: 5\n"),
              testing::EndsWith("a list of numbers is missing"));
  EXPECT_THAT(refusal("cam0:\n  camera_model: omni\n"),
              testing::EndsWith("camera_model omni is not supported; use pinhole"));
}

TEST_F(ReadAnyCamera, ReadsCameraAndRegionOfCalibration) {
  Calibration calibration;
  calibration.camera = make_camera(LensModel::opencv8);
  calibration.camera.id = "left";
  for (const bool has_report : {false, true}) {
    if (has_report) {
      calibration.intrinsics_report = IntrinsicsReport{};
      calibration.intrinsics_report->region_px = {{1, 2}, {700, 4}, {300, 500}};
    }
    const auto file = folder_ / "calibration.yaml";
    write_calibration(file, calibration);
    const ImportedCamera read = read_any_camera(file);
    EXPECT_EQ(read.camera.id, "left");
    EXPECT_EQ(read.camera.intrinsics, calibration.camera.intrinsics);
    EXPECT_EQ(read.region, has_report ? calibration.intrinsics_report->region_px : ImageRegion());
  }
}

TEST(ConvertLensModel, ThrowsIfNoRayIsInFrontOfPinhole) {
  // All pixels are more than 90 degrees from the axis.
  const Camera behind{
      "camera", {300, 200}, LensModel::fisheye, {100, 100, -170, 100, 0, 0, 0, 0}, {}, {}, {}};
  ASSERT_TRUE(Lens(behind.lens_model, behind.intrinsics).unproject_pixel({0, 100}));
  std::string message;
  try {
    convert_lens_model(behind, LensModel::pinhole);
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  EXPECT_EQ(message, "LENSMODEL_PINHOLE has no lens near OPENCV_FISHEYE");
}

TEST_F(ReadAnyCamera, RejectsOtherTextsNamingTheEntry) {
  const std::string core = "[520, 521, 402, 297]", yaml = opencv_text("[1, 2, 3, 4]");
  const auto replaced = [&](const std::string& from, const std::string& to) {
    return std::string(yaml).replace(yaml.find(from), from.size(), to);
  };
  std::string skewed = format_opencv(make_camera(LensModel::opencv5));
  skewed.replace(skewed.find("[520.25, 0,"), 11, "[520.25, 3,");
  constexpr std::size_t limit = 1 << 20;
  std::vector<std::pair<std::string, std::string>> refusals{
      {"a", "contains no camera"},
      {"[1, 2]\n", "contains no camera"},
      {"<?xml version=\"1.0\"?>\n", "is XML"},
      {"cam0: {camera_model: omni}\n", "omni"},
      {"{ 'lensmodel': 'LENSMODEL_CAHVOR', 'imagersize': [1, 2] }", "LENSMODEL_CAHVOR"},
      {"{ 'lensmodel'", "lacks 'lensmodel'"},
      {"{ 'lensmodel': 'LENSMODEL", "lacks 'lensmodel'"},
      {"{ 'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': " + core + "}", "lacks 'imagersize'"},
      {cameramodel_with("[800, 600]", "5"), "lacks 'intrinsics'"},
      {cameramodel_with("[800, 600]", "[520, 521"), "lacks 'intrinsics'"},
      {cameramodel_with("[800, 600]", "[1, 2, 3]"), "4 parameters, not 3"},
      {"{ 'lensmodel': 'LENSMODEL_PINHOLE', 'imagersize': [800, 600], 'optimization_inputs': "
       "b'0', 'intrinsics': " +
           core + "}",
       "lacks 'intrinsics'"},
      {cameramodel_with("[800, x]", core), "'imagersize'"},
      {skewed, "camera_matrix"},
      {replaced(", 0, 0, 1]", ", 0, 0]"), "camera_matrix"},
      {replaced("data: [520", "dates: [520"), "a list of numbers is missing"},
      {replaced("[1, 2, 3, 4]", "5"), "a list of numbers is missing"},
      {replaced("[1, 2, 3, 4]", "[1, x]"), "contains no supported camera"},
      {replaced("[520", "[-520"), "focal length"},
      {yaml + "#" + std::string(limit - yaml.size(), 'a'), "1 MiB"}};
  for (const char* const size : {"[800]", "[800, 600, 3]", "[0, 600]", "[800, -1]", "[800, 0.5]",
                                 "[1048577, 600]", "[800, 1048577]"}) {
    refusals.emplace_back(cameramodel_with(size, core), "'imagersize'");
  }
  for (const char* const width : {"0", "-3", "1048577"}) {
    refusals.emplace_back(replaced("width: 800", std::string("width: ") + width),
                          std::string("not ") + width);
  }
  for (const auto& [text, entry] : refusals) {
    EXPECT_THAT(refusal(text), testing::HasSubstr("camera.txt")) << text.substr(0, 200);
    EXPECT_THAT(refusal(text), testing::HasSubstr(entry)) << text.substr(0, 200);
  }
  for (const std::string& text :
       {cameramodel_with("[1, 1048576]", core), replaced("width: 800", "width: 1048576"),
        replaced("height: 600", "height: 1"), "%YAML:1.0\n" + yaml,
        yaml + "#" + std::string(limit - yaml.size() - 1, 'a')}) {
    EXPECT_EQ(refusal(text), "");
  }
}

}  // namespace
}  // namespace vlp
