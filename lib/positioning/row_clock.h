// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "../rig/calibration.h"

namespace vlp {

/// Readout time of a pixel relative to the middle row (or column) of the image.
struct RowClock {
  double row_time_s, middle_row;
  Readout readout;

  double compute_readout_time_s(const Eigen::Vector2d& pixel) const {
    return row_time_s * ((readout == Readout::rows ? pixel.y() : pixel.x()) - middle_row);
  }
  Eigen::RowVector2d d_time_d_pixel() const {
    return row_time_s *
           (readout == Readout::rows ? Eigen::RowVector2d::UnitY() : Eigen::RowVector2d::UnitX());
  }
};

/// Returns the row clock of a camera, which gives the readout time of each pixel. Time 0 is the
/// readout of the middle row (or column). Returns std::nullopt if row time or readout direction is
/// unknown.
inline std::optional<RowClock> make_readout_clock(const Camera& camera) {
  if (!camera.row_time_s || !camera.readout) return std::nullopt;
  const int rows = camera.imager_px[*camera.readout == Readout::rows ? 1 : 0];
  return RowClock{*camera.row_time_s, (rows - 1) / 2.0, *camera.readout};
}

}  // namespace vlp
