// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Export and import of cameras in the formats of other tools.
#include "calibration/intrinsics/camera_imports.h"

#include <gmock/gmock.h>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/sample_cameras.h"
#include "camera/spline_grid.h"
#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

class ReadCameraOfAnyFormat : public testing::Test {
 protected:
  const TemporaryFolder folder_;

  void comes_back(const Camera& camera, const std::string& text, LensModel as) const {
    const Camera back = read_camera_of_any_format(folder_.file("camera.txt", text)).camera;
    EXPECT_EQ(back.lens_model, as);
    EXPECT_EQ(back.imager_px, camera.imager_px);
    std::vector<double> expected = camera.intrinsics;
    expected.resize(num_lens_parameters(as), 0);
    EXPECT_EQ(back.intrinsics, expected);
  }
  std::string refusal(const std::string& text) const {
    try {
      read_camera_of_any_format(folder_.file("camera.txt", text));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(ReadCameraOfAnyFormat, ReturnsExportedCameraExactlyFromEachFormat) {
  for (const LensModel model : {LensModel::pinhole, LensModel::opencv4, LensModel::opencv5,
                                LensModel::opencv8, LensModel::opencv12, LensModel::fisheye}) {
    const Camera camera = make_camera(model);
    comes_back(camera, format_opencv_camera(camera), model);
    if (model != LensModel::fisheye) comes_back(camera, format_mrcal_cameramodel(camera), model);
    if (model == LensModel::opencv12) continue;
    const bool five = model == LensModel::opencv4;  // ROS writes k3, too
    comes_back(camera, format_ros_camera_info(camera), five ? LensModel::opencv5 : model);
    if (model == LensModel::opencv5 || model == LensModel::opencv8) continue;
    comes_back(camera, format_kalibr_camchain(camera), model);
  }
}

TEST_F(ReadCameraOfAnyFormat, ReturnsSplinedLensExactlyFromCameramodelTheOnlyFormatForIt) {
  const Camera camera = splined_camera();
  comes_back(camera, format_mrcal_cameramodel(camera), camera.lens_model);
  for (const auto& format_camera :
       {format_ros_camera_info, format_kalibr_camchain, format_opencv_camera}) {
    EXPECT_THROW(format_camera(camera), std::invalid_argument);
  }
  std::string short_one = format_mrcal_cameramodel(camera);
  short_one.replace(short_one.find("Nx=13"), 5, "Nx=14");
  EXPECT_THAT(refusal(short_one), testing::HasSubstr("takes 312 parameters, not 290"));
}

TEST(ConvertCameraToLensModel, ConvertsFisheyeToSplinedLensAndBackWithinFiveMillipixels) {
  const auto wide = convert_camera_to_lens_model(make_camera(LensModel::fisheye),
                                                 lens_model_for_spline_grid({3, 20, 16, 190}));
  EXPECT_LT(wide.worst_px, 0.002);
  EXPECT_EQ(wide.common_fraction, 1);
  // The rays outside the grid do not count.
  const auto part = convert_camera_to_lens_model(make_camera(LensModel::fisheye),
                                                 lens_model_for_spline_grid({3, 14, 12, 100}));
  EXPECT_LT(part.worst_px, 0.01);
  EXPECT_LT(part.common_fraction, 0.8);
  const auto back = convert_camera_to_lens_model(wide.camera, LensModel::fisheye);
  EXPECT_LT(back.worst_px, 0.005);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(back.camera.intrinsics[i], make_camera(LensModel::fisheye).intrinsics[i], 0.01);
  }
  const auto near = convert_camera_to_lens_model(make_camera(LensModel::opencv8),
                                                 lens_model_for_spline_grid({2, 20, 16, 100}));
  EXPECT_LT(near.worst_px, 0.2);  // quadratic pieces
}

/// Lenses of 10 degrees, with no, one or a few rays of a piece in the image, and of a strip with
/// one row of pieces. The recommended model has to fit.
TEST(ConvertCameraToLensModel, ThrowsRecommendingFittingGridWhenGridIsTooCoarse) {
  const auto expect_other = [](const Camera& camera, const SplineGrid& grid) {
    const std::string words = "the control points of " + splined_lens_model_name(grid) +
                              " do not cover the field of view, ";
    std::string said;
    try {
      convert_camera_to_lens_model(camera, lens_model_for_spline_grid(grid));
    } catch (const std::invalid_argument& error) {
      said = error.what();
    }
    ASSERT_THAT(said, testing::StartsWith(words)) << camera.intrinsics[2];
    const auto model = lens_model_from_name(said.substr(said.find("LENSMODEL", words.size())));
    ASSERT_TRUE(model) << said;
    const FittedCamera fitted = convert_camera_to_lens_model(camera, *model);
    EXPECT_LT(fitted.worst_px, 0.01) << said;
    EXPECT_EQ(fitted.common_fraction, 1) << said;
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

TEST_F(ReadCameraOfAnyFormat, RejectsUnknownFormatsAndModels) {
  EXPECT_THAT(refusal("a: 1\n"), testing::HasSubstr("camera.txt: "));
  EXPECT_THAT(refusal("[1, 2]\n"), testing::HasSubstr("contains no camera"));
  EXPECT_THAT(refusal("{ 'lensmodel': 'LENSMODEL_CAHVOR', 'imagersize': [1, 2] }"),
              testing::HasSubstr("has lens model LENSMODEL_CAHVOR; the models are"));
  EXPECT_THAT(refusal("{ 'lensmodel': 'LENSMODEL_PINHOLE', 'imagersize': [10, 20], "
                      "'intrinsics': [ 1, 2, 3 ] }"),
              testing::HasSubstr("takes 4 parameters, not 3"));
  EXPECT_THAT(refusal("cam0: {camera_model: omni}\n"), testing::HasSubstr("omni is not supported"));
  std::string skewed = format_opencv_camera(make_camera(LensModel::opencv5));
  skewed.replace(skewed.find("[520.25, 0,"), 11, "[520.25, 3,");
  EXPECT_THAT(refusal(skewed), testing::HasSubstr("camera_matrix is skewed"));
}

/// Comments as in Python: from a # outside strings to the end of the line.
TEST_F(ReadCameraOfAnyFormat, IgnoresCommentsInCameramodel) {
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

TEST(ConvertCameraToLensModel, IsExactOnlyIfTargetModelIncludesSourceModel) {
  // A model that includes the other fits exactly, another one approximately.
  const auto exact =
      convert_camera_to_lens_model(make_camera(LensModel::opencv4), LensModel::opencv8);
  EXPECT_LT(exact.worst_px, 1e-6);
  EXPECT_EQ(exact.common_fraction, 1);
  const auto near =
      convert_camera_to_lens_model(make_camera(LensModel::opencv8), LensModel::fisheye);
  EXPECT_LT(near.worst_px, 1);
  EXPECT_GT(near.worst_px, 1e-6);
  const auto same =
      convert_camera_to_lens_model(make_camera(LensModel::opencv8), LensModel::opencv8);
  EXPECT_EQ(same.camera.intrinsics, make_camera(LensModel::opencv8).intrinsics);
  // Perspective models have no rays beyond 90 degrees.
  const auto half =
      convert_camera_to_lens_model(make_camera(LensModel::fisheye), LensModel::opencv4);
  EXPECT_LT(half.common_fraction, 1);
}

}  // namespace
}  // namespace vlp
