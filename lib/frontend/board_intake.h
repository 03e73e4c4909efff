// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/board_lattice.h"
#include "frontend/corner_cache.h"
#include "frontend/observation.h"
#include "frontend/options.h"
#include "rig/board.h"

namespace vlp {

/// Detector of a board in images, which rejects images that a calibration of the lens cannot use.
/// Safe to share between threads.
class BoardIntake {
 public:
  /// Creates the detector of a board, which accepts or rejects images by `options`.
  /// @param imager_px  width and height of the camera's images; std::nullopt: images of any size
  ///     are accepted
  /// @throws std::invalid_argument if BoardDetector or BoardLattice reject the board
  BoardIntake(const Board& board, const FrontendOptions& options,
              const std::optional<std::array<int, 2>>& imager_px = std::nullopt);

  /// Detects the board in an image. Rejects the image if it is unreadable, of another size, too
  /// dark, blurred, overexposed with inaccurate corners, or shows too few corners to determine the
  /// board's pose. An overexposed image with accurate corners has an Observation::doubt.
  /// Repeated images are not rejected here, see Selection.
  Observation detect_board(const SourceImage& source) const;

 private:
  /// Rejects an image that is overexposed, too dark, blurred, or shows too few corners.
  void reject_low_quality_image(Observation& image, double bright_fraction,
                                double white_fraction) const;
  /// Returns the reason why an image with a measured blur is too blurred; empty if it is not.
  std::string describe_blur(const Observation& image) const;

  const Board board_;
  const BoardLattice lattice_;
  const BoardDetector detector_;
  const FrontendOptions options_;
  const std::optional<std::array<int, 2>> imager_px_;
  const CornerCache cache_;
};

/// Detects a board in images and videos (BoardIntake) and rejects repeated views (Selection).
/// Images whose size differs from that of most images are rejected. Results do not depend on the
/// number of threads.
///
/// Sets Observations::failure if no image shows the board. Its file is `board_file` if the images
/// show another board.
/// @throws InputError if no image can be read
Observations detect_boards(const std::vector<std::filesystem::path>& images, const Board& board,
                           const std::filesystem::path& board_file, const FrontendOptions& options,
                           const IntakeProgress& progress = {});

/// Returns true if the extension is that of a file of corners: .vnl of mrcal, or .csv.
bool is_corner_file(const std::filesystem::path& file);

/// Reads the corners of a board from a file of mrcal (read_mrcal_corners()) or from a table
/// (read_corner_table()), instead of images of size `imager_px`. Selects views as
/// detect_boards() does. Rejects corners that contradict their neighbors, with a warning.
/// @throws InputError if the file cannot be read
Observations read_board_views(const std::filesystem::path& file, const Board& board,
                              const std::filesystem::path& board_file,
                              const std::array<int, 2>& imager_px, const FrontendOptions& options);

}  // namespace vlp
