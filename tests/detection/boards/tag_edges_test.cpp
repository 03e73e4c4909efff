// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Corners of rendered tags, compared with their projections.
#include "detection/boards/tag_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "camera/lens.h"
#include "detection/boards/tone_curve.h"
#include "simulation/exposure.h"
#include "simulation/scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

struct CornerErrors {
  int corners = 0;
  double outwards = 0, squares = 0;

  void add(const TagDetection::Corners& seen, const TagDetection::Corners& truth) {
    const Eigen::Vector2d middle = (truth[0] + truth[1] + truth[2] + truth[3]) / 4;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d error = seen[k] - truth[k];
      outwards += error.dot((truth[k] - middle).normalized());
      squares += error.squaredNorm();
      ++corners;
    }
  }
  double outwards_px() const { return outwards / corners; }
  double rms_px() const { return std::sqrt(squares / (2 * corners)); }
};

double narrowest_px(const TagDetection::Corners& corners) {
  double min_width_px = INFINITY;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d side = corners[(k + 1) % 4] - corners[k];
    const Eigen::Vector2d across = Eigen::Vector2d(-side.y(), side.x()).normalized();
    for (const std::size_t other : {k + 2, k + 3}) {
      min_width_px = std::min(min_width_px, std::abs(across.dot(corners[other % 4] - corners[k])));
    }
  }
  return min_width_px;
}

/// Measures the corner errors of boards in front of the camera of datasets/paper-rig.
template <typename Wanted>
CornerErrors measure_errors(const Scene& scene, const CaptureSet& views, std::size_t images,
                            Wanted wanted) {
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  CornerErrors errors;
  for (std::size_t index = 0; index < images; ++index) {
    const BoardShot shot = make_board_capture_parameters(scene, views, index);
    std::map<int, TagDetection::Corners> truth;
    for (const auto& [tag, corner, pixel] :
         project_scene_corners_into_image(scene, renderer, shot)) {
      truth[*tag][static_cast<std::size_t>(corner)] = pixel;
    }
    const cv::Mat image = simulate_sensor_image(
        scene.sensor, renderer.render_board_in_electrons(shot), index, scene.processing);
    for (const TagDetection& tag : detector.detect_board(image).tags) {
      if (wanted(truth[tag.id])) errors.add(tag.corners_px, truth[tag.id]);
    }
  }
  return errors;
}

Scene paper_rig() { return read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml"); }

CaptureSet find_board_set(const Scene& scene) {
  return *std::ranges::find(scene.sets, "boards", &CaptureSet::folder);
}

/// Returns the distances of the image of a straight line from the chord between its ends, at
/// w = -0.5, 0 and 0.5 along the chord, in the direction of `outwards`.
Eigen::Vector3d compute_offsets_from_chord_px(const Lens& lens, const Eigen::Vector2d& from,
                                              const Eigen::Vector2d& to,
                                              const Eigen::Vector2d& outwards) {
  const Eigen::Vector3d first = lens.unproject_pixel(from).value().direction,
                        last = lens.unproject_pixel(to).value().direction;
  const Eigen::Vector2d chord = to - from;
  Eigen::Vector3d offsets_px;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double target = 0.25 * double(i + 1);
    double fraction = target;
    Eigen::Vector2d off;
    for (int iteration = 0; iteration < 20; ++iteration) {
      off = lens.project_point((1 - fraction) * first + fraction * last).value() - from;
      fraction += target - chord.dot(off) / chord.squaredNorm();
    }
    offsets_px[i] = outwards.dot(off);
  }
  return offsets_px;
}

TEST(BoardDetector, MeasuresCurvaturesOfStraightEdgesBehindDistortingLens) {
  Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/fisheye/scene.yaml");
  scene.camera.readout = Readout::rows;  // the sensor's lines are rows of the image
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  const CaptureSet views = find_board_set(scene);
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  int edges = 0;
  double squared_errors = 0, squared_offsets = 0;
  for (std::size_t index = 0; index < 3; ++index) {
    const cv::Mat image = simulate_sensor_image(
        scene.sensor,
        renderer.render_board_in_electrons(make_board_capture_parameters(scene, views, index)),
        index, scene.processing);
    for (const TagDetection& tag : detector.detect_board(image).tags) {
      const auto& corners = tag.corners_px;
      const Eigen::Vector2d middle = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
      for (std::size_t k = 0; k < 4; ++k) {
        const Eigen::Vector2d &from = corners[k], &to = corners[(k + 1) % 4];
        Eigen::Vector2d outwards = Eigen::Vector2d(from.y() - to.y(), to.x() - from.x());
        if (outwards.dot(from - middle) < 0) outwards = -outwards;
        outwards.normalize();
        const Eigen::Vector3d expected_px = compute_offsets_from_chord_px(lens, from, to, outwards);
        for (Eigen::Index i = 0; i < 3; ++i) {
          const double measured_px =
              tag.curvatures[k].curve_offset_from_straight_line_px(0.5 * double(i - 1));
          squared_errors += std::pow(measured_px - expected_px[i], 2) / 3;
          squared_offsets += expected_px.squaredNorm() / 9;
        }
        EXPECT_GT(tag.curvatures[k].reach, 0.5);
        EXPECT_LE(tag.curvatures[k].reach, 1.1);
        ++edges;
      }
    }
  }
  ASSERT_GT(edges, 100);
  const double error_px = std::sqrt(squared_errors / edges),
               offset_px = std::sqrt(squared_offsets / edges);
  RecordProperty("error_px", std::to_string(error_px));
  RecordProperty("offset_px", std::to_string(offset_px));
  EXPECT_GT(offset_px, 0.1);
  EXPECT_LT(error_px, 0.1 * offset_px);
}

TEST(BoardDetector, ListsFitForEachToneCurveOfImageWithGamma) {
  Scene scene = paper_rig();
  scene.processing = ImageProcessing{};
  scene.processing->gamma = 2.0;
  const FrameRenderer renderer(scene);
  const cv::Mat image =
      simulate_sensor_image(scene.sensor,
                            renderer.render_board_in_electrons(
                                make_board_capture_parameters(scene, find_board_set(scene), 0)),
                            1, scene.processing);
  const BoardDetection seen = BoardDetector(scene.board->pattern).detect_board(image);
  ASSERT_GT(seen.tags.size(), 5U);
  ASSERT_EQ(seen.curve_costs.size(), kGammas.size());
  // The third gamma above 1 is the true one.
  EXPECT_EQ(std::ranges::min_element(seen.curve_costs) - seen.curve_costs.begin(), 3);
  for (const TagDetection& tag : seen.tags) {
    ASSERT_EQ(tag.tone_curve_fits.size(), kGammas.size() - 1) << tag.id;
    EXPECT_NE(tag.tone_curve_fits[2].corners_px, tag.corners_px);
  }
}

TEST(BoardDetectorOnNarrowTags, CornersAreNotBiasedByWhiteBits) {
  Scene scene = paper_rig();
  scene.sensor.shot_noise = false;
  scene.sensor.read_noise_e = 0;
  const CornerErrors errors =
      measure_errors(scene, find_board_set(scene), 16,
                     [](const auto& corners) { return narrowest_px(corners) < 24; });
  ASSERT_GT(errors.corners, 40);
  EXPECT_LT(std::abs(errors.outwards_px()), 0.006);  // without the bits 0.02
  EXPECT_LT(errors.rms_px(), 0.012);
  RecordProperty("outwards_px", std::to_string(errors.outwards_px()));
  RecordProperty("rms_px", std::to_string(errors.rms_px()));
}

TEST(BoardDetectorOnSaturatedTags, CornersAreNotBiasedOutwards) {
  Scene scene = paper_rig();
  CaptureSet views = find_board_set(scene);
  views.exposure_s = 0.0079;  // one and a half times white
  const CornerErrors errors = measure_errors(scene, views, 6, [](const auto&) { return true; });
  ASSERT_GT(errors.corners, 400);
  EXPECT_LT(std::abs(errors.outwards_px()), 0.02);
  EXPECT_LT(errors.rms_px(), 0.025);  // without the light of the others 0.042
  RecordProperty("outwards_px", std::to_string(errors.outwards_px()));
  RecordProperty("rms_px", std::to_string(errors.rms_px()));
}

}  // namespace
}  // namespace vlp
