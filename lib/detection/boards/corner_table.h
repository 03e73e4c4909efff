// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <vector>

#include "detection/boards/board_detector.h"
#include "rig/board.h"

namespace vlp {

/// Reads the corners of a board in images from a table, which replaces the images.
///
/// Columns for boards of tags:
///   image, tag, corner, u_px, v_px         corner 0 to 3 as in BoardTag::corners_m
///   edge_quadratic_px, edge_cubic_px,
///   edge_half_extent                       optional: EdgeCurvature from this corner to the next
/// Columns for boards of squares:
///   image, corner, u_px, v_px              corner as in PointDetection::index; rows may also
///                                          be counted upwards (renumber_lattice())
/// Column for both:
///   sd_px                                  optional: PointDetection::sd_px
/// An image without corners has one row with its name only. Tags without all four corners are
/// rejected. Tags that the board does not have are BoardDetection::foreign_tags.
///
/// @throws InputError with file and line, also for a repeated corner, and if too many corners are
///         outside the image (are_too_many_corners_outside())
std::vector<BoardView> read_corner_table(const std::filesystem::path& file, const Board& board,
                                         const std::array<int, 2>& imager_px);

/// Writes the detected corners of `views` as a table (CSV) for read_corner_table(), atomically.
/// read_corner_table() restores the same doubles.
/// @throws InputError if the file cannot be written
void write_corner_table(const std::filesystem::path& file, std::span<const BoardView> views,
                        const Board& board);

/// Describes that a corner is outside the image; empty if it is inside.
std::string describe_corner_outside(const Eigen::Vector2d& pixel,
                                    const std::array<int, 2>& imager_px);

/// Returns true if more than 2 % of the corners are outside the image. Fewer may be outliers; more
/// indicate an image of another size.
bool are_too_many_corners_outside(std::size_t outside, std::size_t corners);

}  // namespace vlp
