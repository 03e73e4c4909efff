// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "calibration/intrinsics/intrinsics.h"
#include "detection/boards/board_view.h"
#include "rig/board.h"

namespace vlp {

/// Writes mrcal's .cameramodel: the lens with 17 digits, where it is known
/// (valid_intrinsics_region, known_region()), and all of the solved problem
/// (optimization_inputs), on which mrcal's own tools work, such as
/// mrcal-show-projection-uncertainty and mrcal-show-residuals. The former is of corners that err by
/// themselves, and of a board of tags shows less than IntrinsicsReport::uncertainty_px, which is by
/// tags (ProjectionUncertainty). Throws InputError. Precondition, here and below: mrcal has the
/// lens model, has_mrcal().
void write_cameramodel(const std::filesystem::path& file, const IntrinsicsSolution& solution);

/// Writes the corners that were solved for as mrcal-calibrate-cameras reads them (--corners-cache):
/// filename x y level, with level -log2(weight), or, of weights that no whole levels have, filename
/// x y weight (--corners-cache-has-weights), row by row of the lattice, "-" for a corner not seen
/// or left out. Of a board in four parts each image stands four times, as NAME-corner0 to
/// NAME-corner3. images: the names of the input's views; where folders have images of one name, the
/// second is NAME-2, because the table knows views by their names. Throws InputError.
void write_corners(const std::filesystem::path& file, const IntrinsicsSolution& solution,
                   std::span<const std::string> images);

/// Corners of a board as mrcal's tools keep them (--corners-cache; of mrgingham, or what
/// write_corners() wrote): `filename x y level`, every point of the board's lattice, row by row,
/// image after image. The residual of a point is weighted by 2^-level, the level rounded down and
/// 30 at most, or by a fourth column named `weight`, 1000 at most; without a fourth column by 1. A
/// point with "-" or a negative x, y, level or weight was not seen; a single row with "-" is an
/// image without the board. Throws InputError, with file and line.
std::vector<BoardView> read_corners(const std::filesystem::path& file, const Board& board,
                                    const std::array<int, 2>& imager_px);

/// The version of mrcal that the toolbox was built with, as Debian's package tells it; "unknown"
/// where there is no package.
std::string mrcal_version();

}  // namespace vlp
