// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Cameras in the formats of other tools, compared with mrcal and with OpenCV,
/// which has the models of ROS and Kalibr.
#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iomanip>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <sstream>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/sample_cameras.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/valid_region.h"
#include "camera/lens.h"
#include "camera/spline_grid.h"
#include "support/matchers.h"
#include "support/program.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

constexpr std::size_t kPoints = 1000;
/// Tolerance of pixels up to 1000, for their rounding.
constexpr double kExact_px = 1e-9;

Lens make_lens(const Camera& camera) { return {camera.lens_model, camera.intrinsics}; }

/// Returns points in the field of view, one to five meters away, up to `off_axis_deg` off the axis.
std::vector<Eigen::Vector3d> points_before(const Camera& camera, double off_axis_deg = 180) {
  const double min_cosine = std::cos(off_axis_deg * std::numbers::pi / 180);
  const Lens lens = make_lens(camera);
  Random random(3);
  std::vector<Eigen::Vector3d> points;
  while (points.size() < kPoints) {
    const double v = random.uniform(-0.5, camera.imager_px[1] - 0.5),
                 u = random.uniform(-0.5, camera.imager_px[0] - 0.5);
    const auto ray = lens.unproject_pixel({u, v});
    if (!ray) continue;
    const Eigen::Vector3d direction = ray->direction.normalized();
    if (direction.z() >= min_cosine) points.push_back(random.uniform(1, 5) * direction);
  }
  return points;
}

using Project = std::function<Eigen::Vector2d(const Eigen::Vector3d& point)>;

/// Returns the largest distance between the projections of the points by the lens and by `project`.
double worst_px(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                const Project& project) {
  const Lens lens = make_lens(camera);
  double worst = 0;
  for (const Eigen::Vector3d& point : points) {
    const double off = (project(point) - lens.project_point(point).value()).norm();
    if (!(off <= worst)) worst = off;
  }
  return worst;
}

// OpenCV

struct CvCamera {
  cv::Mat matrix, distortions;
};

CvCamera read_by_opencv(const std::string& text) {
  const cv::FileStorage file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  CvCamera camera;
  file["camera_matrix"] >> camera.matrix;
  file["distortion_coefficients"] >> camera.distortions;
  return camera;
}

/// Writes a camera as OpenCV's calibration example does.
std::string written_by_opencv(const CvCamera& camera, bool fisheye = false) {
  cv::FileStorage file("camera.yaml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "calibration_time"
       << "Wed 25 Nov 2026"
       << "nr_of_frames" << 25;
  file << "image_width" << 800 << "image_height" << 600 << "board_width" << 9;
  file.writeComment("flags: +fix_aspectRatio");
  file << "flags" << 2 << "fisheye_model" << (fisheye ? 1 : 0);
  file << "camera_matrix" << camera.matrix << "distortion_coefficients" << camera.distortions;
  file << "avg_reprojection_error" << 0.25;
  return file.releaseAndGetString();
}

std::vector<Eigen::Vector2d> projected_by_opencv(const CvCamera& camera, bool fisheye,
                                                 const std::vector<Eigen::Vector3d>& points) {
  std::vector<cv::Point3d> from;
  for (const auto& point : points) from.emplace_back(point.x(), point.y(), point.z());
  const cv::Vec3d none(0, 0, 0);
  std::vector<cv::Point2d> to;
  if (fisheye) {
    cv::fisheye::projectPoints(from, to, none, none, camera.matrix, camera.distortions);
  } else {
    cv::projectPoints(from, none, none, camera.matrix, camera.distortions, to);
  }
  std::vector<Eigen::Vector2d> pixels;
  for (const auto& pixel : to) pixels.emplace_back(pixel.x, pixel.y);
  return pixels;
}

void expect_same_pixels(const Camera& camera, const std::vector<Eigen::Vector3d>& points,
                        const std::vector<Eigen::Vector2d>& pixels) {
  ASSERT_EQ(pixels.size(), points.size());
  std::size_t i = 0;
  EXPECT_LT(worst_px(camera, points, [&](const auto&) { return pixels[i++]; }), kExact_px)
      << lens_model_name(camera.lens_model);
}

constexpr LensModel kOfOpencv[] = {LensModel::pinhole, LensModel::opencv4,  LensModel::opencv5,
                                   LensModel::opencv8, LensModel::opencv12, LensModel::fisheye};
/// cv::fisheye divides by the depth.
constexpr double kOpencvsWidest_deg = 89.9;

TEST(FormatOpencv, ExportedCameraProjectsToSamePixelsInOpencv) {
  for (const LensModel model : kOfOpencv) {
    const Camera camera = make_camera(model);
    const auto points = points_before(camera, kOpencvsWidest_deg);
    const CvCamera read = read_by_opencv(format_opencv(camera));
    expect_same_pixels(camera, points,
                       projected_by_opencv(read, model == LensModel::fisheye, points));
  }
}

class ReadCameraFormats : public testing::Test {
 protected:
  ImportedCamera read(const std::string& text) const {
    return read_any_camera(folder_.file("camera.txt", text));
  }
  std::string refusal(const std::string& text) const {
    return rejection_message([&] { read(text); });
  }

  const TemporaryFolder folder_;
};

TEST_F(ReadCameraFormats, CameraReadFromOpencvFileProjectsAsInOpencv) {
  for (const LensModel model : kOfOpencv) {
    const bool fisheye = model == LensModel::fisheye;
    const Camera camera = make_camera(model);
    CvCamera cv{cv::Mat(cv::Mat_<double>(3, 3)), {}};
    const auto& p = camera.intrinsics;
    cv.matrix = (cv::Mat_<double>(3, 3) << p[0], 0, p[2], 0, p[1], p[3], 0, 0, 1);
    // A column, as cv::calibrateCamera gives them.
    std::vector<double> coefficients(p.begin() + 4, p.end());
    if (coefficients.empty()) coefficients.resize(5, 0);
    for (const std::size_t size : {coefficients.size(), std::size_t{14}}) {
      if (size == 14 && model != LensModel::opencv12) continue;
      coefficients.resize(size, 0);  // 14: with a sensor that is not tilted
      cv.distortions = cv::Mat(coefficients, true);
      const ImportedCamera found = read(written_by_opencv(cv, fisheye));
      EXPECT_EQ(found.camera.lens_model, model);
      EXPECT_EQ(found.camera.imager_px, camera.imager_px);
      const auto points = points_before(camera, kOpencvsWidest_deg);
      expect_same_pixels(found.camera, points, projected_by_opencv(cv, fisheye, points));
    }
  }
}

TEST_F(ReadCameraFormats, RejectsOpencvFileWithTiltedSensor) {
  CvCamera cv{cv::Mat(cv::Mat_<double>::eye(3, 3) * 500), cv::Mat(cv::Mat_<double>::zeros(14, 1))};
  cv.distortions.at<double>(12) = 0.01;
  EXPECT_THAT(refusal(written_by_opencv(cv)), testing::HasSubstr("the sensor not tilted"));
}

// ROS and Kalibr

/// The models of ROS and Kalibr are those of OpenCV: image_geometry of ROS hands a camera_info to
/// it. Kalibr's radtan is that of cv::projectPoints() with four coefficients.
void expect_same_pixels(const Camera& camera, const YAML::Node& text) {
  const bool is_ros = text["camera_matrix"].IsDefined();
  const auto k =
      (is_ros ? text["camera_matrix"]["data"] : text["intrinsics"]).as<std::vector<double>>();
  const auto model = text["distortion_model"].as<std::string>();
  auto d = (is_ros ? text["distortion_coefficients"]["data"] : text["distortion_coeffs"])
               .as<std::vector<double>>(std::vector<double>());
  if (d.empty()) d.resize(4);
  CvCamera cv;
  cv.matrix = is_ros ? cv::Mat(k, true).reshape(1, 3)
                     : cv::Mat((cv::Mat_<double>(3, 3) << k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1));
  cv.distortions = cv::Mat(d, true);
  const auto points = points_before(camera, kOpencvsWidest_deg);
  expect_same_pixels(camera, points, projected_by_opencv(cv, model == "equidistant", points));
}

TEST_F(ReadCameraFormats, CameraExportedToRosFileMatchesProjectionOfOpencv) {
  for (const LensModel model : {LensModel::pinhole, LensModel::opencv4, LensModel::opencv5,
                                LensModel::opencv8, LensModel::fisheye}) {
    const Camera camera = make_camera(model);
    const std::string text = format_ros(camera);
    expect_same_pixels(camera, YAML::Load(text));
    expect_same_pixels(read(text).camera, YAML::Load(text));
  }
}

/// Files as written by camera_calibration of ROS.
TEST_F(ReadCameraFormats, CameraReadFromRosFileMatchesProjectionOfOpencv) {
  constexpr const char* head =
      "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [438.78376, 0.     , 305.58978,\n           0.     , 437.34566, 243.73813,\n"
      "           0.     ,   0.     ,   1.     ]\n";
  constexpr const char* tail =
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1., 0., 0.,\n         0., 1., 0.,\n"
      "         0., 0., 1.]\nprojection_matrix:\n  rows: 3\n  cols: 4\n"
      "  data: [393.65326,   0.     , 322.79794,   0.     ,\n           0.     , 417.18045, "
      "241.52728,   0.     ,\n           0.     ,   0.     ,   1.     ,   0.     ]\n";
  const std::pair<LensModel, const char*> models[] = {
      {LensModel::opencv5,
       "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n"
       "  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]\n"},
      {LensModel::opencv8,
       "distortion_model: rational_polynomial\ndistortion_coefficients:\n  rows: 1\n  cols: 8\n"
       "  data: [0.2, -0.1, 0.001, 0.0005, 0.01, 0.55, -0.12, 0.02]\n"},
      {LensModel::fisheye,
       "distortion_model: equidistant\ndistortion_coefficients:\n  rows: 1\n  cols: 4\n"
       "  data: [-0.012, 0.031, -0.028, 0.0082]\n"}};
  for (const auto& [model, distortion] : models) {
    const std::string text = std::string(head) + distortion + tail;
    const Camera camera = read(text).camera;
    EXPECT_EQ(camera.lens_model, model);
    EXPECT_EQ(camera.id, "narrow_stereo");
    expect_same_pixels(camera, YAML::Load(text));
  }
}

TEST_F(ReadCameraFormats, CameraExportedToKalibrFileMatchesProjectionOfOpencv) {
  for (const LensModel model : {LensModel::pinhole, LensModel::opencv4, LensModel::fisheye}) {
    const Camera camera = make_camera(model);
    const std::string text = format_camchain(camera);
    expect_same_pixels(camera, YAML::Load(text)["cam0"]);
    expect_same_pixels(read(text).camera, YAML::Load(text)["cam0"]);
  }
}

/// Files as written by kalibr_calibrate_cameras and kalibr_calibrate_imu_camera; the first camera
/// of several.
TEST_F(ReadCameraFormats, CameraReadFromKalibrFileMatchesProjectionOfOpencv) {
  const std::pair<LensModel, const char*> models[] = {
      {LensModel::opencv4,
       "  distortion_coeffs: [-0.2847798, 0.0755440, -1.0444e-05, 2.3727e-05]\n"
       "  distortion_model: radtan\n"},
      {LensModel::fisheye,
       "  distortion_coeffs: [-0.0016, 0.0124, -0.0108, 0.0027]\n"
       "  distortion_model: equidistant\n"},
      {LensModel::pinhole, "  distortion_coeffs: []\n  distortion_model: none\n"}};
  for (const auto& [model, distortion] : models) {
    const std::string text =
        std::string(
            "cam0:\n  T_cam_imu:\n  - [0.01, -0.99, 0.02, 0.07]\n  - [0.99, 0.01, -0.01, -0.02]\n"
            "  - [0.01, 0.02, 0.99, 0.001]\n  - [0.0, 0.0, 0.0, 1.0]\n  cam_overlaps: [1]\n"
            "  camera_model: pinhole\n") +
        distortion +
        "  intrinsics: [461.629, 460.152, 362.680, 246.049]\n  resolution: [752, 480]\n"
        "  rostopic: /cam0/image_raw\n  timeshift_cam_imu: 0.0001\n"
        "cam1:\n  camera_model: omni\n";
    const Camera camera = read(text).camera;
    EXPECT_EQ(camera.lens_model, model);
    expect_same_pixels(camera, YAML::Load(text)["cam0"]);
  }
}

// mrcal

/// Runs mrcal for Python with files of a folder.
class MrcalCameramodel : public ReadCameraFormats {
 protected:
  void SetUp() override {
    if (run_program("/usr/bin/python3 -c 'import mrcal'").exit_code != 0) {
      GTEST_SKIP() << "mrcal for Python is not installed";
    }
  }
  /// Returns the output of a script that has the model of the file as m and the names of the folder
  /// by at().
  std::string printed(const std::filesystem::path& file, const std::string& script) const {
    const auto program =
        folder_.file("script.py",
                     "import sys, os, mrcal, numpy as np\n"
                     "m = mrcal.cameramodel(sys.argv[1])\n"
                     "at = lambda name: os.path.join(os.path.dirname(sys.argv[1]), name)\n" +
                         script);
    const auto result =
        run_program("/usr/bin/python3 '" + program.string() + "' '" + file.string() + "'");
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    return result.output;
  }
  std::vector<Eigen::Vector2d> projected_by_mrcal(
      const std::string& text, const std::vector<Eigen::Vector3d>& points) const {
    std::ofstream list(folder_ / "points");
    list << std::setprecision(17);
    for (const auto& point : points) list << point.transpose() << "\n";
    list.close();
    std::istringstream numbers(
        printed(folder_.file("ours.cameramodel", text),
                "for q in mrcal.project(np.loadtxt(at('points')), *m.intrinsics()):\n"
                "    print(repr(float(q[0])), repr(float(q[1])))\n"));
    std::vector<Eigen::Vector2d> pixels;
    for (double u = 0, v = 0; numbers >> u >> v;) pixels.emplace_back(u, v);
    return pixels;
  }
  ImportedCamera written_by_mrcal(const std::string& text) const {
    printed(folder_.file("ours.cameramodel", text),
            "m.write(at('theirs.cameramodel'), note = \"of 'lensmodel': 'LENSMODEL_CAHVOR'\")\n");
    return read_any_camera(folder_ / "theirs.cameramodel");
  }
};

TEST_F(MrcalCameramodel, KeepsProjectionAndIntrinsicsAfterRoundTripThroughMrcal) {
  std::vector<Camera> cameras{splined_camera(), splined_camera({2, 20, 16, 170})};
  for (const LensModel model : {LensModel::pinhole, LensModel::stereographic, LensModel::opencv4,
                                LensModel::opencv5, LensModel::opencv8, LensModel::opencv12}) {
    cameras.push_back(make_camera(model));
  }
  for (const Camera& camera : cameras) {
    SCOPED_TRACE(lens_model_name(camera.lens_model));
    const std::string text = format_cameramodel(camera);
    const auto points = points_before(camera);
    expect_same_pixels(camera, points, projected_by_mrcal(text, points));
    const auto [back, region] = written_by_mrcal(text);
    EXPECT_EQ(back.lens_model, camera.lens_model);
    EXPECT_EQ(back.imager_px, camera.imager_px);
    EXPECT_EQ(region, ImageRegion());
    ASSERT_EQ(back.intrinsics.size(), camera.intrinsics.size());
    for (std::size_t i = 0; i < back.intrinsics.size(); ++i) {
      const double expected = camera.intrinsics[i];
      EXPECT_NEAR(back.intrinsics[i], expected, 1e-9 * std::abs(expected));  // it writes 10 digits
    }
  }
}

TEST_F(MrcalCameramodel, WritesValidRegionOfSolutionReadableByMrcal) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  IntrinsicsInput input = views.input(12, random, 0.05);
  for (auto& view : input.views) {  // the right of the image, where the board never is
    std::erase_if(view, [](const auto& corner) { return corner.pixel.x() > 450; });
  }
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  const auto file = folder_ / "camera.cameramodel";
  const ImageRegion expected = make_valid_region(list_inlier_pixels(solution.problem),
                                                 input.imager_px, solution.fitted_lens());
  write_cameramodel(file, solution, expected);
  ASSERT_GT(expected.size(), 4U);
  EXPECT_LT(compute_area_fraction(expected, input.imager_px), 0.8);

  ImageRegion mrcals;
  std::istringstream numbers(printed(
      file, "for q in m.valid_intrinsics_region(): print(repr(float(q[0])), repr(float(q[1])))\n"));
  for (double u = 0, v = 0; numbers >> u >> v;) mrcals.emplace_back(u, v);
  ASSERT_FALSE(mrcals.empty());
  EXPECT_EQ(mrcals.front(), mrcals.back());
  mrcals.pop_back();
  EXPECT_EQ(mrcals, expected);

  const ImportedCamera ours = read_any_camera(file);
  EXPECT_EQ(ours.region, expected);
  const ImportedCamera theirs = written_by_mrcal(format_cameramodel(ours.camera, ours.region));
  ASSERT_EQ(theirs.region.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_THAT(theirs.region[i], IsNear(expected[i], 1e-6));  // it writes 10 digits
  }
}

TEST_F(ReadCameraFormats, ReturnsValidRegionOfCameramodelAndRejectsMalformedRegions) {
  const Camera camera = make_camera(LensModel::opencv8);
  const ImageRegion bent{{10, 20}, {700, 15.5}, {420, 300}, {700, 590}, {12, 580}};
  const std::string text = format_cameramodel(camera, bent);
  EXPECT_EQ(read(text).region, bent);
  const std::string key = "'valid_intrinsics_region': ";
  const std::size_t from = text.find(key) + key.size(), to = text.find("]],") + 2;
  const auto with = [&](const std::string& region) {
    return std::string(text).replace(from, to - from, region);
  };
  EXPECT_THAT(refusal(with("[]")), testing::HasSubstr("so the lens has no valid region"));
  EXPECT_THAT(refusal(with("[[1, 2], [3, 4], [1, 2]]")), testing::HasSubstr("three pixels"));
  EXPECT_THAT(refusal(with("[[1, 2], [3, x]]")), testing::HasSubstr("should be numbers"));
  EXPECT_EQ(read(with("((1, 2), (300, 4), (30, 400))")).region.size(), 3U);
}

// Fits

TEST(ConvertLensModel, ReportsLargestPixelDifferenceBetweenBothLenses) {
  struct Fit {
    Camera from;
    LensModel to;
  };
  const Fit fits[] = {{make_camera(LensModel::opencv8), LensModel::fisheye},
                      {make_camera(LensModel::opencv12), LensModel::opencv4},
                      {make_camera(LensModel::opencv5), LensModel::pinhole},
                      {make_camera(LensModel::fisheye), splined_lens_model({3, 20, 16, 190})},
                      {make_camera(LensModel::fisheye), splined_lens_model({2, 12, 10, 170})},
                      {splined_camera(), LensModel::fisheye}};
  for (const auto& [from, to] : fits) {
    SCOPED_TRACE(testing::Message()
                 << lens_model_name(from.lens_model) << " " << lens_model_name(to));
    const FittedCamera fitted = convert_lens_model(from, to);
    const Lens lens = make_lens(fitted.camera), was = make_lens(from);
    Random random(6);
    double worst = 0;
    std::size_t both = 0;
    for (std::size_t i = 0; i < kPoints; ++i) {
      // Clamped: some are on the edges of the image and in its corners.
      const double v = std::clamp(random.uniform(-30, 629), 0.0, 599.0),
                   u = std::clamp(random.uniform(-40, 839), 0.0, 799.0);
      const auto ray = was.unproject_pixel({u, v});
      const auto pixel = ray ? lens.project_point(ray->direction) : std::nullopt;
      if (!pixel) continue;
      ++both;
      worst = std::max(worst, (*pixel - Eigen::Vector2d(u, v)).norm());
    }
    ASSERT_GT(both, 0U);
    EXPECT_LE(worst, fitted.worst_px);
    EXPECT_GE(worst, 0.8 * fitted.worst_px);
    EXPECT_EQ(both < kPoints, fitted.common_fraction < 1);
  }
}

}  // namespace
}  // namespace vlp
