// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Corners of rendered tags, compared with their projections.
#include "detection/boards/tag_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "camera/lens.h"
#include "detection/boards/tone_curve.h"
#include "simulation/exposure.h"
#include "simulation/scene.h"
#include "simulation/truth.h"
#include "support/matchers.h"

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
    const BoardShot shot = make_board_shot(scene, views, index);
    std::map<int, TagDetection::Corners> truth;
    for (const auto& [tag, corner, pixel] : list_true_corners(scene, renderer, shot)) {
      truth[*tag][static_cast<std::size_t>(corner)] = pixel;
    }
    const cv::Mat image =
        simulate_sensor_image(scene.sensor, renderer.render_board(shot), index, scene.processing);
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
        scene.sensor, renderer.render_board(make_board_shot(scene, views, index)), index,
        scene.processing);
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
          const double measured_px = tag.curvatures[k].curve_offset_px(0.5 * double(i - 1));
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

/// Renders the first board view of a scene.
cv::Mat render_first_board_view(const Scene& scene) {
  const FrameRenderer renderer(scene);
  const BoardShot shot = make_board_shot(scene, find_board_set(scene), 0);
  return simulate_sensor_image(scene.sensor, renderer.render_board(shot), 1, scene.processing);
}

TEST(BoardDetector, ListsFitForEachToneCurveOfImageWithGamma) {
  Scene scene = paper_rig();
  scene.processing = ImageProcessing{};
  scene.processing->gamma = 2.0;
  const BoardDetection seen =
      BoardDetector(scene.board->pattern).detect_board(render_first_board_view(scene));
  ASSERT_GT(seen.tags.size(), 5U);
  ASSERT_EQ(seen.curve_costs.size(), kGammas.size());
  // The third gamma above 1 is the true one.
  EXPECT_EQ(std::ranges::min_element(seen.curve_costs) - seen.curve_costs.begin(), 3);
  for (const TagDetection& tag : seen.tags) {
    ASSERT_EQ(tag.tone_curve_fits.size(), kGammas.size() - 1) << tag.id;
    EXPECT_NE(tag.tone_curve_fits[2].corners_px, tag.corners_px);
  }
}

TEST(BoardDetector, ListsNoFitsForToneCurvesOfLinearImage) {
  const Scene scene = paper_rig();
  const BoardDetection seen =
      BoardDetector(scene.board->pattern).detect_board(render_first_board_view(scene));
  ASSERT_GT(seen.tags.size(), 5U);
  EXPECT_LT(seen.curve_costs.size(), kGammas.size());
  for (const TagDetection& tag : seen.tags) EXPECT_TRUE(tag.tone_curve_fits.empty()) << tag.id;
}

/// A tag drawn by libapriltag, with bits of `bit_px`, slightly blurred.
struct DrawnTag {
  static constexpr int kId = 5;
  static constexpr int kMargin_px = 12;

  explicit DrawnTag(int bit_px) {
    const TagFamily family = make_tag_family("tag36h11");
    const std::unique_ptr<image_u8_t, void (*)(image_u8_t*)> drawn(
        apriltag_to_image(family.get(), kId), image_u8_destroy);
    const int border = (family->total_width - family->width_at_border) / 2;
    cv::Mat1b bits(drawn->height, drawn->width);
    for (int row = 0; row < bits.rows; ++row) {
      for (int col = 0; col < bits.cols; ++col) {
        bits(row, col) = drawn->buf[row * drawn->stride + col] > 0 ? 200 : 40;
      }
    }
    cv::resize(bits, image, {}, bit_px, bit_px, cv::INTER_NEAREST);
    cv::copyMakeBorder(image, image, kMargin_px, kMargin_px, kMargin_px, kMargin_px,
                       cv::BORDER_CONSTANT, cv::Scalar(200));
    cv::GaussianBlur(image, image, {}, 0.9);
    width_px = bit_px * family->width_at_border;
    const double low = kMargin_px + bit_px * border - 0.5, high = low + width_px;
    corners_px = {Eigen::Vector2d(low, high), {high, high}, {high, low}, {low, low}};
  }

  /// Refines the corners after the first one was displaced. Returns the refined first corner.
  Eigen::Vector2d refine_displaced_corner(const Eigen::Vector2d& displacement_px) const {
    Board board;
    board.family = "tag36h11";
    board.border_bits = 1;
    board.tag_spacing = 0.3;
    std::array<TagDetection, 1> tags;
    tags[0].id = kId;
    tags[0].corners_px = corners_px;
    tags[0].corners_px[0] += displacement_px;
    refine_tags(tags, image, TagGeometry(board));
    return tags[0].corners_px[0];
  }

  cv::Mat1b image;
  double width_px = 0;
  TagDetection::Corners corners_px;
};

TEST(RefineTags, LimitsDisplacementToLargerOf1p5PxAnd3PercentOfWidth) {
  for (const int bit_px : {4, 12}) {
    SCOPED_TRACE(bit_px);
    const DrawnTag tag(bit_px);
    const double limit_px = std::max(1.5, 0.03 * tag.width_px);
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 1), {1, -1}, {-1, -1}, {-1, 1}}) {
      SCOPED_TRACE(direction.transpose());
      const Eigen::Vector2d accepted_px = 0.85 * limit_px * direction.normalized(),
                            rejected_px = 1.15 * limit_px * direction.normalized();
      EXPECT_THAT(tag.refine_displaced_corner(accepted_px), IsNear(tag.corners_px[0], 0.02));
      EXPECT_THAT(tag.refine_displaced_corner(rejected_px),
                  IsNear(tag.corners_px[0] + rejected_px, 1e-12));
    }
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
