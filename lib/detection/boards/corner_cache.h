// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "detection/boards/detect_boards.h"

namespace vlp {

/// Keeps what was found in an image in a file of `folder` (made when it is not there; it can be
/// deleted at any time), named by the SHA-256 of the image and of all that the detection depends
/// on: the board and the program's version. Corners come back as the same doubles. Without effect
/// for an empty name. What cannot be read or written there is detected again, and not kept.
BoardCache corner_cache(const std::filesystem::path& folder, const Board& board);

}  // namespace vlp
