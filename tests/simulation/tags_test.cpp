// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rendered boards as detected by libapriltag.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagStandard41h12.h>
#include <gmock/gmock.h>

#include <map>

#include "geometry/angles.h"
#include "rig/board.h"
#include "rig/input_error.h"
#include "simulation/board_print.h"
#include "simulation/exposure.h"
#include "simulation/plain_scene.h"
#include "simulation/truth.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using Corners = std::map<std::pair<int, int>, Eigen::Vector2d>;

/// Tag and corner in libapriltag's order, with the center of the top left pixel at (0, 0).
Corners detected(cv::Mat image, apriltag_family_t* family) {
  apriltag_detector_t* detector = apriltag_detector_create();
  detector->quad_decimate = 1;
  apriltag_detector_add_family(detector, family);
  image_u8_t view{image.cols, image.rows, int(image.step), image.data};
  zarray_t* detections = apriltag_detector_detect(detector, &view);
  Corners corners;
  for (int i = 0; i < zarray_size(detections); ++i) {
    apriltag_detection_t* tag = nullptr;
    zarray_get(detections, i, &tag);
    for (int corner = 0; corner < 4; ++corner) {
      corners[{tag->id, corner}] = {tag->p[corner][0] - 0.5, tag->p[corner][1] - 0.5};
    }
  }
  apriltag_detections_destroy(detections);
  apriltag_detector_destroy(detector);
  return corners;
}

void expect_all_read(const Scene& scene, apriltag_family_t* family) {
  const FrameRenderer renderer(scene);
  const CaptureSet views = board_views(4, 0.28, rad_from_deg(35), rad_from_deg(180), 0);
  for (std::size_t index = 0; index < 4; ++index) {
    const BoardShot shot = make_board_shot(scene, views, index);
    const Corners found =
        detected(simulate_sensor_image(scene.sensor, renderer.render_board(shot), 1), family);
    const auto truth = list_true_corners(scene, renderer, shot);
    ASSERT_FALSE(truth.empty());
    EXPECT_EQ(found.size(), truth.size());
    for (const auto& [tag, corner, pixel] : truth) {
      ASSERT_TRUE(tag);
      const auto at = found.find({*tag, corner});
      ASSERT_NE(at, found.end()) << *tag;
      EXPECT_LT((at->second - pixel).norm(), 0.5) << *tag << ' ' << corner;
    }
  }
}

class FrameRendererTags : public testing::Test {
 protected:
  FrameRendererTags() {
    scene_.board = plain_board();
    scene_.sensor = {8, 0.2, 5, 60000, 0, false, {}};
    scene_.optics.blur_px = 0.5;
  }
  Scene scene_ = plain_scene();
};

TEST_F(FrameRendererTags, AprilTagDetectsPlainTagsAtTrueCorners) {
  scene_.board->pattern.id_order = {true, BoardCorner::bottom_right};
  apriltag_family_t* family = tag36h11_create();
  expect_all_read(scene_, family);
  tag36h11_destroy(family);
}

TEST_F(FrameRendererTags, AprilTagDetectsTagsWithOuterBitsAtTrueCorners) {
  scene_.board->pattern.family = "tagStandard41h12";
  scene_.board->pattern.first_id = 100;
  apriltag_family_t* family = tagStandard41h12_create();
  expect_all_read(scene_, family);
  tagStandard41h12_destroy(family);
}

TEST(MakeTagPattern, AddsSecondBlackRingForTwoBorderBits) {
  const TagPattern plain = make_tag_pattern("tag36h11", 17, 1),
                   wide = make_tag_pattern("tag36h11", 17, 2);
  ASSERT_EQ(plain.pattern_width_bits(), 8);
  ASSERT_EQ(wide.pattern_width_bits(), 10);
  for (int row = 0; row < 10; ++row) {
    for (int column = 0; column < 10; ++column) {
      const bool ring = row == 0 || column == 0 || row == 9 || column == 9;
      const bool white = !ring && plain.white[std::size_t((row - 1) * 8 + column - 1)];
      EXPECT_EQ(wide.white[std::size_t(row * 10 + column)], white) << row << ' ' << column;
    }
  }
}

TEST(MakeTagPattern, ThrowsForUnknownIdOrBorderWidth) {
  EXPECT_THROW(make_tag_pattern("tag36h11", 587, 1), std::invalid_argument);
  EXPECT_NO_THROW(make_tag_pattern("tag36h11", 586, 1));
  EXPECT_THROW(make_tag_pattern("tag36h11", -1, 1), std::invalid_argument);
  EXPECT_THROW(make_tag_pattern("tagStandard41h12", 0, 2), std::invalid_argument);
}

/// The last id of each family is readable as a board and has a pattern; the next one is neither.
TEST(ReadBoard, AcceptsAsManyTagsAsEachFamilyHas) {
  const TemporaryFolder folder;
  for (const auto& [family, tags] : {std::pair("tag36h11", 587),
                                     {"tag25h9", 35},
                                     {"tag16h5", 30},
                                     {"tagCircle21h7", 38},
                                     {"tagCircle49h12", 65535},
                                     {"tagCustom48h12", 42211},
                                     {"tagStandard41h12", 2115},
                                     {"tagStandard52h13", 48714}}) {
    const auto read_with_first_id = [&, name = family](int id) {
      Board board{name, 1, 1, 0.1, 1, 1, false, id, {false, BoardCorner::top_left}};
      write_board(folder / "board.yaml", board);
      read_board(folder / "board.yaml");
    };
    EXPECT_NO_THROW(read_with_first_id(tags - 1)) << family;
    EXPECT_THROW(read_with_first_id(tags), InputError) << family;
    EXPECT_NO_THROW(make_tag_pattern(family, tags - 1, 1)) << family;
    EXPECT_THROW(make_tag_pattern(family, tags, 1), std::invalid_argument) << family;
  }
}

}  // namespace
}  // namespace vlp
