// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "frontend/corner_cache.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "rig/board.h"

namespace vlp {

/// Detects a board in images and rejects those that a calibration of the lens cannot use. Safe to
/// share between threads.
class BoardIntake {
 public:
  /// Throws std::invalid_argument for a board that BoardDetector or BoardLattice refuse.
  /// `imager_px`: size of the camera's images, if it is known.
  BoardIntake(const Board& board, const FrontendOptions& options,
              const std::optional<std::array<int, 2>>& imager_px = std::nullopt);

  /// Detects the board in an image. Rejects the image if it is unreadable, of another size,
  /// overexposed, too dark, blurred, or shows too few corners to determine the board's pose.
  /// Repeated images are not rejected here, see Selection.
  Observation observe(const SourceImage& source) const;

 private:
  void reject_poor(Observation& image, double bright_fraction, double white_fraction) const;

  const Board board_;
  const BoardLattice lattice_;
  const BoardDetector detector_;
  const FrontendOptions options_;
  const std::optional<std::array<int, 2>> imager_px_;
  const BoardCache cache_;
};

/// Detects a board in images and videos (BoardIntake) and rejects repeated views (Selection). All
/// images have to be of one size: those of another size than most are rejected. Results do not
/// depend on the number of threads. Observations::failure: no image shows the board; a wrong file
/// if the images show another board than `board_file`.
///
/// Throws InputError if no image can be read.
Observations observe_boards(const std::vector<std::filesystem::path>& images, const Board& board,
                            const std::filesystem::path& board_file, const FrontendOptions& options,
                            const IntakeProgress& progress = {});

/// Returns true for the name of a file of corners: .vnl of mrcal, or .csv.
bool holds_corners(const std::filesystem::path& file);

/// Reads the corners of a board from a file of mrcal (read_corners()) or a table
/// (read_corner_table()) instead of images of size `imager_px`, and selects views as
/// observe_boards() does. Removes corners that contradict their neighbours, with a warning. Throws
/// InputError.
Observations read_board_views(const std::filesystem::path& file, const Board& board,
                              const std::filesystem::path& board_file,
                              const std::array<int, 2>& imager_px, const FrontendOptions& options);

}  // namespace vlp
