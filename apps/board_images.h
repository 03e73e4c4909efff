// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "detection/boards/detect_boards.h"

namespace vlp {

/// Each name that is a folder replaced by the images in it; of files that are named, in their
/// order. Throws InputError.
std::vector<std::filesystem::path> image_files(const std::vector<std::string>& names);

/// The board in each image, with progress and a warning for each image that is skipped. cache:
/// folder of what was found in images seen before, or empty. Throws InputError when no image can be
/// used, images differ in size, or the board is another than board_file says; Undetermined when no
/// tag is seen at all.
std::vector<BoardView> board_views(const std::vector<std::filesystem::path>& images,
                                   const Board& board, const std::string& board_file, int threads,
                                   const std::string& cache);

}  // namespace vlp
