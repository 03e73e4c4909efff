// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/other_tags.h"

#include <algorithm>
#include <vector>

#include "detection/boards/board_detector.h"

namespace vlp {
namespace {

/// Minimum number of tags of another pattern; fewer may be false detections.
constexpr int kMinTags = 4;

/// Returns the number of usable tags, including those of other ids.
int count_detected_tags(const BoardDetection& seen) {
  return static_cast<int>(seen.tags.size() + seen.foreign_tags.size());
}

BoardDetection detect_board(const cv::Mat& image, const Board& board) {
  return BoardDetector(board).detect_board(image);
}

/// Returns boards with the largest dictionary of each number of bits.
std::vector<Board> list_other_markers(const Board& board) {
  std::vector<Board> others;
  for (const char* dictionary : {"DICT_4X4_1000", "DICT_5X5_1000", "DICT_6X6_1000", "DICT_7X7_1000",
                                 "DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_36h11"}) {
    others.push_back(board);
    others.back().family = dictionary;
  }
  return others;
}

/// Returns boards with tags of small families, whose detection is fast.
std::vector<Board> list_other_tags(const Board& board) {
  std::vector<Board> others;
  for (const std::string family :
       {"tag36h11", "tag25h9", "tag16h5", "tagStandard41h12", "tagCircle21h7"}) {
    const bool plain = family == "tag36h11" || family == "tag25h9" || family == "tag16h5";
    for (const int border_bits : {1, 2}) {
      for (const bool squares : {false, true}) {
        const bool is_stated = family == board.family && border_bits == board.border_bits &&
                               squares == board.corner_squares;
        if (is_stated || (!plain && (border_bits > 1 || squares))) continue;
        others.push_back(board);
        others.back().family = family;
        others.back().border_bits = border_bits;
        others.back().corner_squares = squares;
      }
    }
  }
  return others;
}

std::string describe_markers(const std::string& dictionary, const BoardDetection& seen) {
  const std::string begin = "the image shows markers of ";
  if (!dictionary.ends_with("_1000")) return begin + dictionary;
  int largest = 0;
  for (const auto* tags : {&seen.tags, &seen.foreign_tags}) {
    for (const TagDetection& tag : *tags) largest = std::max(largest, tag.id);
  }
  return begin + dictionary.substr(0, dictionary.rfind('_')) + ", the largest of id " +
         std::to_string(largest);
}

std::string describe_tags(const Board& board) {
  return "the image shows tags of family " + board.family + ", border_bits " +
         std::to_string(board.border_bits) + ", corner_squares " +
         (board.corner_squares ? "true" : "false");
}

}  // namespace

std::string describe_other_tags(const Board& board, const cv::Mat& image) {
  if (board.kind == BoardKind::chessboard) return "";  // it has none
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  if (count_detected_tags(detect_board(mirrored, board)) >= kMinTags) {
    return "the image is mirrored: mirror it back, or turn mirroring off in the camera";
  }
  const bool charuco = board.kind == BoardKind::charuco;
  // Damaged tags of the board can look like tags of other families. Another family therefore needs
  // at least as many tags as the board's family has with unusable ones, and more than without them.
  const BoardDetection stated = detect_board(image, board);
  const int num_unusable = charuco ? 0 : std::max(0, stated.num_unusable_tags - 1);
  int max_count = std::max(kMinTags - 1, count_detected_tags(stated) + num_unusable);
  std::string found;
  for (const Board& other : charuco ? list_other_markers(board) : list_other_tags(board)) {
    const BoardDetection seen = detect_board(image, other);
    if (count_detected_tags(seen) <= max_count) continue;
    max_count = count_detected_tags(seen);
    found = charuco ? describe_markers(other.family, seen) : describe_tags(other);
  }
  return found;
}

}  // namespace vlp
