// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/valid_region.h"
#include "detection/boards/board_detector.h"
#include "rig/board.h"

namespace vlp {

/// Writes mrcal's .cameramodel: the lens with 17 digits, its calibrated region
/// (valid_intrinsics_region, CalibrationReport::region), and the solved problem
/// (format_optimization_inputs).
///
/// mrcal's tools use the problem, such as mrcal-show-projection-uncertainty and
/// mrcal-show-residuals. The former assumes independent errors of the corners. For a board of tags
/// it shows less than IntrinsicsReport::expected_max_error_px, which is by tags
/// (ProjectionUncertainty).
/// @throws InputError
/// @pre can_mrcal_solve() of the lens model, also for write_mrcal_corners()
void write_cameramodel(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                       const ImageRegion& region);

/// Writes the corners of a solution in the format of mrcal-calibrate-cameras (--corners-cache),
/// image by image and row by row of the lattice. Pixels are in px.
///
/// @param images  file names of the views of the input, before views were dropped. A second image
///     of the same name becomes NAME-2, because the table identifies views by name.
/// @throws InputError if the file cannot be written
/// @pre can_mrcal_solve() of the lens model
///
/// The columns are `filename x y level` with level = -log2(weight). If a weight does not correspond
/// to a whole level from 0 on, they are `filename x y weight` (--corners-cache-has-weights). A
/// corner that was not detected, or is an outlier, has the row `NAME -1 -1 -`. An image of a board
/// in four parts occurs four times, as NAME-corner0 to NAME-corner3.
void write_mrcal_corners(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                         std::span<const std::string> images);

/// Reads the corners of a board in the format of mrcal's tools (--corners-cache), from mrgingham or
/// write_mrcal_corners(): `filename x y level`, every point of the lattice of the board, row by
/// row, image after image.
///
/// The residual of a point is weighted by 2^-level, with the level rounded down and at most 30. A
/// fourth column named `weight` gives the weight itself, at most 1000. Without a fourth column the
/// weight is 1. A point with "-" or a negative x, y, level or weight was not seen. A single row
/// with "-" is an image without the board.
/// @throws InputError with file and line
std::vector<BoardView> read_mrcal_corners(const std::filesystem::path& file, const Board& board,
                                          const std::array<int, 2>& imager_px);

/// Returns the version of mrcal that the toolbox was built with, from Debian's package; "unknown"
/// without a package.
std::string get_mrcal_version();

}  // namespace vlp
