// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/other_tags.h"

#include "detection/board_detector.h"

namespace vlp {
namespace {

/// One tag may be a pattern that looks like one.
constexpr int kEnough = 2;

int tags_in(const cv::Mat& image, const Board& board) {
  const SeenBoard seen = BoardDetector(board).detect(image);
  return static_cast<int>(seen.tags.size()) + seen.foreign + seen.unusable;
}

}  // namespace

std::string other_tags(const Board& board, const cv::Mat& image) {
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  if (tags_in(mirrored, board) >= kEnough) {
    return "the image is mirrored: mirror it back, or tell the camera not to";
  }
  constexpr const char* common[] = {"tag36h11", "tag25h9", "tag16h5"};
  for (const char* family : common) {
    for (const int border_bits : {1, 2}) {
      for (const bool squares : {false, true}) {
        Board other = board;
        other.family = family;
        other.border_bits = border_bits;
        other.corner_squares = squares;
        if (tags_in(image, other) < kEnough) continue;
        return "the image shows tags of family " + other.family + ", border_bits " +
               std::to_string(border_bits) + ", corner_squares " + (squares ? "true" : "false");
      }
    }
  }
  constexpr const char* others[] = {"tagCircle21h7", "tagCircle49h12", "tagCustom48h12",
                                    "tagStandard41h12", "tagStandard52h13"};
  for (const char* family : others) {
    Board other = board;
    other.family = family;
    other.border_bits = 1;
    other.corner_squares = false;
    if (tags_in(image, other) >= kEnough) {
      return std::string("the image shows tags of family ") + family;
    }
  }
  return "";
}

}  // namespace vlp
