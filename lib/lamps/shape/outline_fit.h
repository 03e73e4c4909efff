// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "lamps/image/background.h"
#include "lamps/image/image_view.h"
#include "lamps/shape/light.h"
#include "lamps/shape/light_center.h"
#include "lamps/shape/shear.h"

namespace vlp {

/// Result of fit_disc_outline().
struct OutlineFit {
  PlaneEllipse outline;
  /// Standard deviation of the center per axis, in pixels of the image.
  double center_sd_px;
  /// Radius of the disc of equal area, and standard deviation of the blur of the outline, in px.
  double radius_px, blur_px;
  /// Fraction of the ends of scanlines with contrast that agree with the outline.
  double inlier_fraction;
  /// RMS slope of the levels inside along the scanlines, per pixel and as a fraction of the level;
  /// median of the levels inside, above the dark level.
  double unevenness, level;
  /// Normal equations with free ovality, in units of the radius; see OutlineEquations.
  OutlineEquations::Matrix5 matrix;
  OutlineEquations::Vector5 gradient;

  /// Adds an independent error of the center, as a standard deviation per axis.
  void add_center_error(double sd_px);
};

/// Ratio of Light::rise_px and the blur: distance of the quartiles of a normal distribution.
inline constexpr double kRisePerBlur = 1.349;

/// Known size of an outline in the plane of LightShape: its radius, and the standard deviation of
/// the logarithm.
struct KnownRadius {
  double radius, log_sd;

  /// Returns true if a light has this radius, within two standard deviations and the error of its
  /// outline.
  bool is_radius_of(const MeasuredLight& light) const;

  /// Returns true if a fit with this prior would be another one, for one of three reasons. Its
  /// radius differs from that of the light by more than two standard deviations. Its center moves
  /// by more than a tenth of its standard deviation. Its variance falls by more than a tenth. True
  /// for rims, whose size depends on the reflector; false without a lens.
  bool improves_fit(const MeasuredLight& light) const;
};

/// Fits the outline of a disc to the levels of all pixels within 5 px or 3 blurs of it.
///
/// A cell is the part of a scanline on one side of the center. With the depth d of a pixel behind
/// the outline, in pixels, and the coverage C = Phi(d / blur), the levels of a cell are
///
///     level = (out + out_slope d) (1 - H) + (in + in_slope d) H,   H = C + tone (H_coded - C),
///     H_coded = ((r^2.2 (1 - C) + C)^(1 / 2.2) - r) / (1 - r),     r = out / in.
///
/// H_coded is the coverage in levels coded as light^(1 / 2.2), and `tone` the share of this tone
/// curve, with the prior 0.85 +- 0.2. Each cell has its own four levels: stripes, LED chips behind
/// a diffuser, halos, vignetting and reflectors need no further unknowns. The model is linear in
/// the levels, which are eliminated in closed form. Slopes are 0 with a standard deviation of 3 %
/// of the level per pixel. A cell without pixels deeper than 2.5 blurs has the level of the
/// scanlines one and two periods away.
///
/// The unknowns are center, size, blur, tone, and without a lens the ovality. They are estimated by
/// variable projection (Golub and Pereyra 1973; Kaufman 1975), from a wide blur to the actual one.
/// Tukey's biweight applies to cells. The variance of a pixel is the sum of that of the background,
/// of a multiple of the level, of 0.1 for quantization, and of the square of 0.3 % of the level.
/// The multiple is estimated from the residuals of cells with contrast.
///
/// The covariance of the center is that of the normal equations times a factor. The factor is the
/// mean square of the residuals or, if larger, the power of their 3rd to 8th harmonic along the
/// outline. If the levels inside vary, the variance includes the square of the shift of the center
/// in a narrower band.
///
/// @param lines         image whose rows are the scanlines
/// @param start         first outline
/// @param start_blur_px blur of the first iteration, about the error of the first outline
/// @param period_lines  period of the stripes in scanlines; 0 if the light is steady
/// @param known_radius  prior of the radius
/// @return              std::nullopt if less than 60 pixels are near the outline, if they do not
///                      determine it, or if its center or radius differ from the first ones by more
///                      than a quarter of the radius
std::optional<OutlineFit> fit_disc_outline(const ImageView& lines, const PlaneEllipse& start,
                                           double start_blur_px, double period_lines,
                                           const Background& background, const LightShape& shape,
                                           const std::optional<KnownRadius>& known_radius = {});

/// Rectangle in the plane of LightShape. The normalized position of a point p on the light is
/// between -1 and 1 in both components. With P = off_axis, q = p - start:
///
///     u = unit_from_plane (p + distortion (P |q|^2 + 2 q (P . q) + q |q|^2) - center),
///     normalized position = u / (1 + keystone . u).
///
/// A tilt error causes the keystone, an unknown lens the distortion: the part of second and third
/// order in q of (P + q) |P + q|^2.
struct PlaneRectangle : PlaneEllipse {
  Eigen::Vector2d keystone = Eigen::Vector2d::Zero();
  double distortion = 0;
  Eigen::Vector2d start = Eigen::Vector2d::Zero(), off_axis = Eigen::Vector2d::Zero();

  /// Returns the ratio of the sides along the first and the second normalized axis.
  double aspect() const;
  /// Returns the deviation from right angles, in rad.
  double shear() const;
  Eigen::Vector2d compute_bend(const Eigen::Vector2d& point) const;
  /// Returns a bound of the effect of keystone and distortion on normalized positions.
  double compute_nonlinearity() const;
  Eigen::Vector2d unit_from_plane_point(const Eigen::Vector2d& point) const;
  Eigen::Vector2d plane_point_from_unit(const Eigen::Vector2d& unit) const;
};

/// Result of fit_rectangle_outline().
struct RectangleFit {
  PlaneRectangle outline;
  /// As in OutlineFit; radius of the disc of equal area.
  double center_sd_px, radius_px, blur_px, inlier_fraction;
  /// Covariance of center, size, elongation, rotations of both pairs of sides, keystone and
  /// distortion, in pixels.
  Eigen::Matrix<double, 9, 9> covariance_px;

  void add_center_error(double sd_px) { center_sd_px = std::hypot(center_sd_px, sd_px); }
};

/// Change of the log aspect ratio of a rectangle that an unknown tilt of 5 degrees causes, 35
/// degrees off axis. Its angles change by about as much, in rad.
inline constexpr double kUnknownTiltSd = 0.06;

/// Returns the standard deviation of the angles and of the log aspect ratio in the plane: a
/// calibrated tilt is accurate to some tenths of a degree. Every given tilt counts as calibrated,
/// and an identity rotation as an unknown tilt.
double get_tilt_sd(const LightShape& shape);

/// Fits the outline of a rectangle as fit_disc_outline() fits that of a disc. Pixels within 4 px or
/// a quarter of a side of a corner are not used. The level inside also changes along a scanline: by
/// the slope common to the cells, which their levels on both sides of the center determine, and in
/// each cell by 0 +- 0.1 % of the level per pixel. The tone curve is not estimated.
///
/// Priors: right angles up to get_tilt_sd(), a keystone of 1.5 times this error times half of a
/// side; without a lens 0.2 rad, and the distortion 0 +- 1 / (3 f^2), with f half of the diagonal
/// of the image, as for an equidistant lens of 115 degrees from corner to corner.
///
/// Sides in dark stripes: a cell of low contrast does not constrain the outline. The position of
/// each side is estimated by the likelihood of the pixels near its middle as well. It assumes that
/// the level inside is that of the scanlines whole periods away, with its standard deviation, and
/// limits the contribution of a scanline. A side that is more than 1.5 px from its mean position is
/// moved there, and the fit repeated. If the standard deviation of the position exceeds 0.25 px,
/// the side is hidden: mean and standard deviation replace the result of the fit, and the outline
/// is corrected by the aspect ratio of the only one of `sizes_m` that agrees with it.
///
/// @return std::nullopt as fit_disc_outline(), if a side cannot be placed, and without a lens if a
///     side is hidden
std::optional<RectangleFit> fit_rectangle_outline(const ImageView& lines, const PlaneEllipse& start,
                                                  double start_blur_px, double period_lines,
                                                  const Background& background,
                                                  const LightShape& shape,
                                                  std::span<const Eigen::Vector2d> sizes_m);

/// Sets the outline of a light: its kind (edge or rim), center, sigma, box, radius, points, width
/// of the edge, inlier fraction, and with a lens outline_equations. Adds 0.05 % of the radius to
/// the standard deviation of the center of a rim, unless its level varies little. Returns false,
/// and changes nothing, if the lens does not cover the outline.
bool set_fitted_outline(OutlineFit fit, const LightShape& shape, MeasuredLight& light);

}  // namespace vlp
