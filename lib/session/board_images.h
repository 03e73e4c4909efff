// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "detection/boards/detect_boards.h"
#include "rig/board.h"
#include "session/step_result.h"

namespace vlp {

/// Images and videos of a board, to look for it.
struct BoardImages {
  std::vector<std::filesystem::path> images;
  Board board;
  std::filesystem::path board_file;
  /// Images at a time.
  int threads = 1;
  /// Folder of what was found in images before, see corner_cache(); may be empty.
  std::filesystem::path cache = {};
  /// Larger images are refused unread.
  double max_mpx = kUsualMaxMpx;
  /// Of a video every so many-th frame.
  int every = 1;
};

/// The board in each image that can be used, in their order.
struct SeenBoards : StepResult {
  std::vector<BoardView> views;
};

/// Each name that is a folder replaced by the images in it; of files that are named, in their
/// order. Throws InputError.
std::vector<std::filesystem::path> image_files(const std::vector<std::string>& names);

/// Corners that were found elsewhere, or before, instead of images.
struct CornerFile {
  /// Of mrcal (.vnl, read_corners()), or a table (.csv, read_corner_table()).
  std::filesystem::path file;
  Board board;
  std::filesystem::path board_file;
  /// Neither kind of file tells it.
  std::array<int, 2> imager_px;
};

/// By its name.
bool holds_corners(const std::filesystem::path& file);

/// Throws InputError. wrong_board: there is no corner of the board.
SeenBoards see_corners(const CornerFile& input);

/// Throws InputError when no image can be used, or they differ in size. wrong_board: tags of other
/// ids or another kind; undetermined: no tag is seen at all.
SeenBoards see_boards(const BoardImages& input, const StepProgress& progress = {});

}  // namespace vlp
