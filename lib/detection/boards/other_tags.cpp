// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/other_tags.h"

#include <algorithm>

#include "detection/boards/board_detector.h"

namespace vlp {
namespace {

/// A few may be patterns that look like tags.
constexpr int kEnough = 4;

/// Tags whose corners can be used, and those of other ids.
int tags_in(const SeenBoard& seen) {
  return static_cast<int>(seen.tags.size() + seen.foreign.size());
}

SeenBoard seen_in(const cv::Mat& image, const Board& board) {
  return BoardDetector(board).detect(image);
}

}  // namespace

std::string other_tags(const Board& board, const cv::Mat& image) {
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  if (tags_in(seen_in(mirrored, board)) >= kEnough) {
    return "the image is mirrored: mirror it back, or tell the camera not to";
  }
  // Families of few tags, which can be searched for quickly.
  constexpr const char* families[] = {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12",
                                      "tagCircle21h7"};
  // Spoilt tags of the board look like a few of others: these have to be as many, and more than
  // those that are of the board's kind.
  const SeenBoard stated = seen_in(image, board);
  const int alike = tags_in(stated);
  int most = std::max({kEnough - 1, alike, alike + stated.unusable - 1});
  std::string found;
  for (const std::string family : families) {
    const bool plain = family == "tag36h11" || family == "tag25h9" || family == "tag16h5";
    for (const int border_bits : {1, 2}) {
      for (const bool squares : {false, true}) {
        if (!plain && (border_bits > 1 || squares)) continue;
        if (family == board.family && border_bits == board.border_bits &&
            squares == board.corner_squares) {
          continue;
        }
        Board other = board;
        other.family = family;
        other.border_bits = border_bits;
        other.corner_squares = squares;
        const int count = tags_in(seen_in(image, other));
        if (count <= most) continue;
        most = count;
        found = "the image shows tags of family " + family + ", border_bits " +
                std::to_string(border_bits) + ", corner_squares " + (squares ? "true" : "false");
      }
    }
  }
  return found;
}

}  // namespace vlp
