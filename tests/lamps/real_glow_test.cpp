// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Real glowing bulbs, in images of 33 Mpx of a phone on the floor.
#include <gtest/gtest.h>

#include <map>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/light_detector.h"
#include "positioning/positioner.h"
#include "support/real_data.h"

namespace vlp {
namespace {

constexpr double kFocal_px = 5620, kRowTime_s = 1 / 47540.0;

Camera make_camera(const cv::Mat& image, Readout readout) {
  Camera camera;
  camera.id = "phone";
  camera.imager_px = {image.cols, image.rows};
  camera.lens_model = LensModel::pinhole;
  camera.intrinsics = {kFocal_px, kFocal_px, (image.cols - 1) / 2.0, (image.rows - 1) / 2.0};
  camera.row_time_s = kRowTime_s;
  camera.readout = readout;
  return camera;
}

struct ImageDetections {
  LampMap map;
  Calibration calibration;
  std::map<int, Light> lamps;
};

ImageDetections detect_lamps_in(const std::filesystem::path& folder, const char* name,
                                Readout readout) {
  const cv::Mat image = read_image(folder / name);
  ImageDetections result;
  result.map = read_lamp_map(folder / "lamps.yaml");
  result.calibration.camera = make_camera(image, readout);
  const LightDetector detector(result.map, make_detector_camera(result.calibration));
  for (const Light& light : detector.detect_lights(to_image_view(image))) {
    if (light.kind != LightKind::lamp) continue;
    EXPECT_FALSE(result.lamps.contains(*light.lamp)) << "one lamp twice";
    result.lamps[*light.lamp] = light;
    const double frequency_hz = 1 / (light.stripes.period_lines * kRowTime_s);
    EXPECT_NEAR(frequency_hz / *light.lamp, 1, 0.05) << "the ids are nominal frequencies";
  }
  return result;
}

TEST(PositionerOnRealGlows, ComputesTrueDistanceWithinTwoCentimetersFromFiveLamps) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const ImageDetections result = detect_lamps_in(folder, "x_0_y_1.27.jpg", Readout::rows);
  std::vector<Detection> detections;
  for (const auto& [id, light] : result.lamps) {
    EXPECT_FALSE(has_outline(light));
    detections.push_back({id, light.pixel, light.sigma_px});
  }
  ASSERT_EQ(detections.size(), 5U);
  const Fix fix = Positioner(result.map, result.calibration).compute_position_fix(detections);
  ASSERT_TRUE(fix.has_succeeded()) << describe_fix_status(fix.status);
  EXPECT_EQ(fix.lamps, 5);
  const double distance_m = 2.46 - fix.state.pose.position_m.z();
  EXPECT_NEAR(distance_m, 2.45, 0.02);
  EXPECT_LT(fix.residual_px * distance_m / kFocal_px, 2e-3);
}

/// Returns detections with equal weights, as OpenCV uses them.
std::vector<Detection> make_equal_detections(const ImageDetections& result) {
  std::vector<Detection> detections;
  for (const auto& [id, light] : result.lamps) detections.push_back({id, light.pixel, {}});
  return detections;
}

/// Returns the camera positions of OpenCV's PnP for coplanar points, refined: the solutions below
/// the lamps.
std::vector<Eigen::Vector3d> opencv_places(const ImageDetections& result,
                                           const std::vector<Detection>& lamps, int method) {
  const auto& k = result.calibration.camera.intrinsics;
  const cv::Matx33d camera(k[0], 0, k[2], 0, k[1], k[3], 0, 0, 1);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const Detection& detection : lamps) {
    for (const Lamp& lamp : result.map.lamps) {
      if (lamp.id != detection.lamp) continue;
      points.emplace_back(lamp.position_m.x(), lamp.position_m.y(), lamp.position_m.z());
    }
    pixels.emplace_back(detection.pixel.x(), detection.pixel.y());
  }
  std::vector<cv::Mat> turns, shifts;
  if (method == cv::SOLVEPNP_P3P) {
    cv::solveP3P(points, pixels, camera, cv::noArray(), turns, shifts, method);
  } else {
    cv::Mat turn, shift;
    cv::solvePnP(points, pixels, camera, cv::noArray(), turn, shift, false, method);
    cv::solvePnPRefineLM(points, pixels, camera, cv::noArray(), turn, shift);
    turns.push_back(turn), shifts.push_back(shift);
  }
  std::vector<Eigen::Vector3d> places_m;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    cv::Matx33d camera_from_world;
    cv::Rodrigues(turns[i], camera_from_world);
    const cv::Vec3d place = -(camera_from_world.t() * cv::Vec3d(shifts[i]));
    if (place[2] < points.front().z) places_m.emplace_back(place[0], place[1], place[2]);
  }
  return places_m;
}

/// Estimates roll and pitch, as for a hand-held phone. The position agrees with that of OpenCV for
/// the same points within 1 % of the distance. Five lamps determine all six parameters.
TEST(PositionerOnRealGlows, PositionMatchesOpenCvForFiveLamps) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const ImageDetections result = detect_lamps_in(folder, "x_0_y_1.27.jpg", Readout::rows);
  const auto detections = make_equal_detections(result);
  ASSERT_EQ(detections.size(), 5U);
  Sensors sensors;
  sensors.inclination_sigma_rad = 1.6;
  const Fix fix =
      Positioner(result.map, result.calibration).compute_position_fix(detections, sensors);
  ASSERT_TRUE(fix.has_succeeded()) << describe_fix_status(fix.status);
  const auto places_m = opencv_places(result, detections, cv::SOLVEPNP_SQPNP);
  ASSERT_EQ(places_m.size(), 1U);
  const double off_m = (fix.state.pose.position_m - places_m[0]).norm();
  std::printf("lean %.2f %.2f degrees, %.2f mm from OpenCV's PnP\n",
              fix.state.motion.inclination.roll_rad * 180 / M_PI,
              fix.state.motion.inclination.pitch_rad * 180 / M_PI, 1e3 * off_m);
  EXPECT_LT(off_m, 0.01 * 2.45);
}

/// Three lamps allow several tilts; the height above the floor resolves the ambiguity.
TEST(PositionerOnRealGlows, PositionMatchesOpenCvForThreeLampsWithGivenHeight) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const ImageDetections result =
      detect_lamps_in(folder, "2014-02-27--18-15-03-62.jpg", Readout::columns);
  const auto detections = make_equal_detections(result);
  ASSERT_EQ(detections.size(), 3U);
  const auto places_m = opencv_places(result, detections, cv::SOLVEPNP_P3P);
  ASSERT_FALSE(places_m.empty());
  const Positioner positioner(result.map, result.calibration);
  Sensors sensors;
  sensors.inclination_sigma_rad = 1.6;
  const Fix free = positioner.compute_position_fix(detections, sensors);
  std::printf("%zu of OpenCV's, free: %s\n", places_m.size(), fix_status_name(free.status).data());
  EXPECT_EQ(free.status == FixStatus::ambiguous, places_m.size() > 1);
  int matched = 0;
  for (const Eigen::Vector3d& place_m : places_m) {
    sensors.height = KnownHeight{place_m.z(), 1e-3};
    const Fix fix = positioner.compute_position_fix(detections, sensors);
    std::printf("OpenCV's at %.4f %.4f %.4f m, ours %s\n", place_m.x(), place_m.y(), place_m.z(),
                fix_status_name(fix.status).data());
    if (!fix.has_succeeded()) continue;
    EXPECT_LT((fix.state.pose.position_m - place_m).norm(), 0.01 * 2.35);
    ++matched;
  }
  EXPECT_GT(matched, 0);
}

TEST(LightDetectorOnRealGlows, IdentifiesAllThreeLampsWithColumnReadout) {
  const auto folder = real_data("luxapose");
  if (folder.empty()) GTEST_SKIP() << "no real captures here";
  const ImageDetections result =
      detect_lamps_in(folder, "2014-02-27--18-15-03-62.jpg", Readout::columns);
  EXPECT_EQ(result.lamps.size(), 3U);
  for (const int id : {3000, 3500, 4000}) EXPECT_TRUE(result.lamps.contains(id)) << id;
}

}  // namespace
}  // namespace vlp
