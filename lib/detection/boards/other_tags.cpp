// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/other_tags.h"

#include <algorithm>

#include "detection/boards/board_detector.h"

namespace vlp {
namespace {

/// Minimum number of tags of another pattern; fewer may be false detections.
constexpr int kMinTags = 4;

/// Returns the number of usable tags, including those of other ids.
int count_tags(const BoardDetection& seen) {
  return static_cast<int>(seen.tags.size() + seen.foreign.size());
}

BoardDetection detect_board(const cv::Mat& image, const Board& board) {
  return BoardDetector(board).detect(image);
}

/// Describes markers of other dictionaries. Tries the largest dictionary of each number of bits.
std::string describe_other_markers(const Board& board, const cv::Mat& image) {
  constexpr const char* dictionaries[] = {"DICT_4X4_1000",       "DICT_5X5_1000",
                                          "DICT_6X6_1000",       "DICT_7X7_1000",
                                          "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11"};
  int max_count = std::max(kMinTags - 1, count_tags(detect_board(image, board)));
  std::string found;
  for (const std::string dictionary : dictionaries) {
    Board other = board;
    other.family = dictionary;
    const BoardDetection seen = detect_board(image, other);
    if (count_tags(seen) <= max_count) continue;
    max_count = count_tags(seen);
    int largest = 0;
    for (const auto* tags : {&seen.tags, &seen.foreign}) {
      for (const TagDetection& tag : *tags) largest = std::max(largest, tag.id);
    }
    const bool sized = dictionary.ends_with("_1000");
    found = "the image shows markers of " +
            (sized ? dictionary.substr(0, dictionary.rfind('_')) + ", the largest of id " +
                         std::to_string(largest)
                   : dictionary);
  }
  return found;
}

}  // namespace

std::string describe_other_tags(const Board& board, const cv::Mat& image) {
  if (board.kind == BoardKind::chessboard) return "";  // it has none
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  if (count_tags(detect_board(mirrored, board)) >= kMinTags) {
    return "the image is mirrored: mirror it back, or tell the camera not to";
  }
  if (board.kind == BoardKind::charuco) return describe_other_markers(board, image);
  // Small families, whose detection is fast.
  constexpr const char* families[] = {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12",
                                      "tagCircle21h7"};
  // Damaged tags of the board can look like tags of other families. Another family therefore needs
  // at least as many tags as the board's family has with unusable ones, and more than without them.
  const BoardDetection stated = detect_board(image, board);
  const int num_same_family = count_tags(stated);
  int max_count = std::max({kMinTags - 1, num_same_family, num_same_family + stated.unusable - 1});
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
        const int count = count_tags(detect_board(image, other));
        if (count <= max_count) continue;
        max_count = count;
        found = "the image shows tags of family " + family + ", border_bits " +
                std::to_string(border_bits) + ", corner_squares " + (squares ? "true" : "false");
      }
    }
  }
  return found;
}

}  // namespace vlp
