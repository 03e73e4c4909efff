// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/dispersion/dispersion.h"
#include "calibration/intrinsics/intrinsics.h"
#include "calibration/intrinsics/lens_sharpness.h"
#include "calibration/rotation/circle_center.h"
#include "geometry/circle_fit.h"
#include "report/plots/gnuplot.h"

namespace vlp {

/// Fixes about a known reference point, in the world: Chen and Guan, figure 6.
struct DispersionPlot {
  std::string title;
  /// Horizontal errors of fixes at the reference point (fix minus reference point), in the world,
  /// m. `circle` is their dispersion circle (DispersionFit), m.
  struct Fixes {
    std::vector<Eigen::Vector2d> errors_m;
    Circle circle;
  };
  Fixes before, after;
  /// Rejected fixes: their errors before the correction.
  std::vector<Eigen::Vector2d> outliers_m;
};

/// Makes the plot, in millimeters, for write_plot().
Drawing draw_dispersion(const DispersionPlot& plot);

/// Lamps in the undistorted image while the camera rotates in place: figure 4 of Chen and Guan.
struct RotationPlot {
  /// Positions of a lamp at one camera height, with the fitted ellipse.
  struct Trace {
    int lamp;
    std::vector<Eigen::Vector2d> positions_px;
    Eigen::Vector2d center_px;
    Eigen::Vector2d radii_px;
  };
  std::string title;
  std::vector<Trace> traces;
  Eigen::Vector2d rotation_center_px;
  Eigen::Vector2d principal_point_px;
};

/// Makes the plot for write_plot(): the traces, and next to them, enlarged, the centers of the
/// ellipses, the rotation center and the principal point.
Drawing draw_rotation(const RotationPlot& plot);

/// Residuals and uncertainty of a lens calibration over the image.
struct IntrinsicsPlot {
  struct Corner {
    Eigen::Vector2d detected_px;
    /// Detected minus projected position.
    Eigen::Vector2d residual_px;
    bool outlier;
  };
  std::string title;
  std::array<int, 2> imager_px;
  /// Corners of all views.
  std::vector<Corner> corners;
  /// Standard deviation of the projection on a regular grid up to the image edges. The values are
  /// row by row from the top left, `cols` (at least two) per row. Values that are not finite are
  /// left blank.
  int cols;
  std::vector<double> sd_px;
  /// MTF50 of equal tiles of the image in cycles per pixel, row by row from the top left,
  /// `mtf50_cols` per row. Tiles that are not finite are left blank. Empty if not measured.
  int mtf50_cols = 0;
  std::vector<double> mtf50 = {};
};

/// Returns the factor by which residuals of this RMS per axis are enlarged in an image of this
/// width.
///
/// The factor is a round number (1, 2 or 5 times a power of ten) that makes the RMS 1/100 to 1/40
/// of the width. 1 if there are no residuals.
double choose_residual_scale(double rms_px, int width_px);

/// Makes the plot for write_plot(): maps of the corners, of their enlarged residuals, of the
/// standard deviation of the projection, and of the MTF50 if it was measured.
Drawing draw_intrinsics(const IntrinsicsPlot& plot);

/// Collects corners and residuals of a solution, and the uncertainty of its projection. Includes
/// the sharpness if it was measured. `lattice` is that of the solution's boards.
/// @pre solution.has_succeeded()
IntrinsicsPlot make_intrinsics_plot(const std::string& title, const IntrinsicsSolution& solution,
                                    const BoardLattice& lattice,
                                    const std::optional<LensSharpness>& sharpness);

/// Collects the lamps of a rotation in place with their circles, and the rotation center.
RotationPlot make_rotation_plot(const std::string& title, const RotationCaptures& rotation,
                                const CircleCenters& circles, const RotationFit& fit,
                                const Camera& camera);

/// Collects the fixes at a known reference point, before and after the correction.
DispersionPlot make_dispersion_plot(const std::string& title, const DispersionFit& fit);

}  // namespace vlp
