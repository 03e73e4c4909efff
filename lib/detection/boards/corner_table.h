// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "detection/boards/board_view.h"
#include "rig/board.h"

namespace vlp {

/// Corners of a board in images, instead of the images: a table of `image, tag, corner, u_px,
/// v_px`, with the corners of a tag from 0 to 3 as in BoardTag::corners_m, or, of a board of
/// squares, `image, corner, u_px, v_px`, with corners as in SeenPoint::index, or counted up the
/// columns (order_lattice()). Of tags also, where the table has it, the EdgeBow from each corner to
/// the next: `bow_square_px, bow_cube_px, bow_reach`, and the corner's SeenTag::Deviations:
/// `sd_px`. An image without any corner has one row, empty but for its name. Tags without all four
/// corners are left out, those that the board does not have are foreign. Throws InputError, with
/// file and line, also for a corner that stands twice, and when too_many_outside() the image.
std::vector<BoardView> read_corner_table(const std::filesystem::path& file, const Board& board,
                                         const std::array<int, 2>& imager_px);

/// Writes what read_corner_table() reads back as the same doubles, whole or not at all. Throws
/// InputError.
void write_corner_table(const std::filesystem::path& file, std::span<const BoardView> views,
                        const Board& board);

/// What is wrong with the place of a corner; empty when nothing is.
std::string outside_words(const Eigen::Vector2d& pixel, const std::array<int, 2>& imager_px);

/// A few corners outside the image may be slips; more mean an image of another size.
bool too_many_outside(std::size_t outside, std::size_t corners);

}  // namespace vlp
