// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Tags near the rim of a lens of 190 degrees, which curves their edges by several pixels.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "detection/boards/board_detector.h"
#include "simulation/exposure.h"
#include "simulation/scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

/// The room of datasets/wide without noise, through a wider lens that is nearer to the board.
Scene wider_scene() {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/wide/scene.yaml");
  scene.camera.lens_model = LensModel::fisheye;
  scene.camera.intrinsics = {290, 291, 501, 498, 0.03, -0.012, 0.004, -0.0006};
  scene.camera.readout = Readout::rows;
  scene.optics.vignetting_power = 0;
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  return scene;
}

double longest_px(const Corners& corners) {
  double longest = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    longest = std::max(longest, (corners[k] - corners[(k + 1) % 4]).norm());
  }
  return longest;
}

struct Errors {
  int tags = 0, far_off = 0;
  double squares = 0;

  double rms_px() const { return std::sqrt(squares / (8 * tags)); }
};

TEST(BoardDetector, LocatesCornersOfCurvedTagsWithinHundredthsOfPixel) {
  constexpr double long_px = 80, far_off_px = 0.3;
  Scene scene = wider_scene();
  CaptureSet views = *std::ranges::find(scene.sets, "boards", &CaptureSet::folder);
  views.board->distance_m = {0.1, 0.2};
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  Errors of_long, of_others;
  for (std::size_t index = 0; index < 6; ++index) {
    const BoardShot shot = make_board_shot(scene, views, index);
    std::map<int, Corners> truth;
    std::map<int, int> seen_corners;
    for (const auto& [tag, corner, pixel] : list_true_corners(scene, renderer, shot)) {
      truth[*tag][static_cast<std::size_t>(corner)] = pixel;
      ++seen_corners[*tag];
    }
    const cv::Mat image = simulate_sensor_image(scene.sensor, renderer.render_board(shot), 1);
    for (const TagDetection& tag : detector.detect_board(image).tags) {
      if (seen_corners[tag.id] < 4) continue;
      Errors& errors = longest_px(truth[tag.id]) > long_px ? of_long : of_others;
      ++errors.tags;
      for (std::size_t k = 0; k < 4; ++k) {
        const double off_px = (tag.corners_px[k] - truth[tag.id][k]).norm();
        errors.squares += off_px * off_px;
        errors.far_off += off_px > far_off_px ? 1 : 0;
      }
    }
  }
  ASSERT_GE(of_long.tags, 8);
  ASSERT_GT(of_others.tags, 60);
  EXPECT_LT(of_long.rms_px(), 0.02);
  EXPECT_LT(of_others.rms_px(), 0.03);
  EXPECT_EQ(of_long.far_off, 0);
  RecordProperty("of_long", std::to_string(of_long.rms_px()));
  RecordProperty("of_others", std::to_string(of_others.rms_px()));
}

}  // namespace
}  // namespace vlp
