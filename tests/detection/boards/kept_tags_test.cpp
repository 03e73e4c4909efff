// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fraction of the tags detected by the tag finders whose corners BoardDetector refines, for
/// saturated images and for images with tone curve, sharpening and JPEG.
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "detection/boards/board_detector.h"
#include "detection/boards/tag_finder.h"
#include "rig/board_layout.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "simulation/scene.h"

namespace vlp {
namespace {

struct Pictures {
  const char* scene;
  /// Brightness of the board's white, relative to full scale.
  double white;
  std::optional<ImageProcessing> picture;
  /// Minimum fraction of the tags with refined corners.
  double kept;
  const char* name;

  friend void PrintTo(const Pictures& pictures, std::ostream* out) { *out << pictures.name; }
};

class BoardDetectorYield : public testing::TestWithParam<Pictures> {
 protected:
  const Scene scene =
      read_scene_file(std::string(VLP_SOURCE_DIR "/datasets/") + GetParam().scene + "/scene.yaml");
  const Board& board = scene.board->pattern;

  cv::Mat image(const FrameRenderer& renderer, const CaptureSet& set, std::size_t index) const {
    const BoardShot shot = make_board_shot(scene, set, index);
    const auto& picture = GetParam().picture;
    const cv::Mat exposed =
        simulate_sensor_image(scene.sensor, renderer.render_board(shot), shot.noise_seed, picture);
    return cv::imdecode(encode_image(exposed, picture), cv::IMREAD_GRAYSCALE);
  }
  std::set<int> detect_ids(const TagFinder& finder, const cv::Mat& image) const {
    std::set<int> ids;
    for (const TagDetection& tag : finder.detect_tags(image)) ids.insert(tag.id);
    std::set<int> of_board;
    for (const BoardTag& tag : list_board_tags(board)) {
      if (ids.contains(tag.id)) of_board.insert(tag.id);
    }
    return of_board;
  }
};

TEST_P(BoardDetectorYield, KeepsAtLeast95PercentOfTagsThatTagFinderDetects) {
  constexpr std::size_t views = 36, apart = 3;
  CaptureSet set = *std::find_if(scene.sets.begin(), scene.sets.end(),
                                 [](const CaptureSet& each) { return each.folder == "boards"; });
  const double white_e =
      (white_level_dn(scene.sensor) - scene.sensor.black_level_dn) / scene.sensor.gain_dn_per_e;
  set.exposure_s = GetParam().white * white_e / scene.board->white_e_per_s;
  const FrameRenderer renderer(scene);
  const BoardDetector detector(board);
  const auto finder =
      board.corner_squares ? make_aruco_detector(board) : make_apriltag_finder(board);
  double all = 0, kept = 0;
  for (std::size_t index = 0; index < views; index += apart) {
    const cv::Mat picture = image(renderer, set, index);
    const std::set<int> ids = detect_ids(*finder, picture);
    all += static_cast<double>(ids.size());
    for (const TagDetection& tag : detector.detect_board(picture).tags)
      kept += ids.contains(tag.id) ? 1 : 0;
  }
  RecordProperty("told", std::to_string(all));
  RecordProperty("kept", std::to_string(kept));
  EXPECT_GE(kept, GetParam().kept * all) << kept << " of " << all;
  EXPECT_GT(all, 0);
}

constexpr ImageProcessing kCoded{2.4, Sharpening{1, 1}, 80};
INSTANTIATE_TEST_SUITE_P(
    Scenes, BoardDetectorYield,
    testing::Values(Pictures{"paper-rig", 1, {}, 0.98, "PlainOfWhite"},
                    Pictures{"paper-rig", 1.5, {}, 0.98, "PlainOfOneAndAHalfTimesWhite"},
                    Pictures{"paper-rig", 2, {}, 0.98, "PlainOfTwiceWhite"},
                    Pictures{"paper-rig", 3, {}, 0.97, "PlainOfThriceWhite"},
                    Pictures{"paper-rig", 0.76, kCoded, 0.98, "PlainCoded"},
                    Pictures{"paper-rig-faulty", 1, {}, 0.98, "KalibrOfWhite"},
                    Pictures{"paper-rig-faulty", 1.5, {}, 0.98, "KalibrOfOneAndAHalfTimesWhite"},
                    Pictures{"paper-rig-faulty", 2, {}, 0.98, "KalibrOfTwiceWhite"},
                    Pictures{"paper-rig-faulty", 3, {}, 0.95, "KalibrOfThriceWhite"},
                    Pictures{"paper-rig-faulty", 0.76, kCoded, 0.98, "KalibrCoded"}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace vlp
