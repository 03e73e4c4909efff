// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace vlp {

/// Radial projection of a fisheye lens: distance d from the principal point, in focal lengths, of a
/// ray at the angle a to the optical axis:
///   d(a) = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)
/// Source: Kannala and Brandt, "A generic camera model and calibration method for conventional,
/// wide-angle, and fish-eye lenses", 2006; OpenCV's fisheye module; Kalibr's "equidistant".
struct Fisheye {
  /// Coefficients k1 k2 k3 k4 of d(a) = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8). Dimensionless; 0
  /// by default, which is the equidistant lens.
  std::array<double, 4> k{};

  /// Returns d(a): the distance from the principal point, in focal lengths, of a ray at `angle_rad`
  /// to the optical axis.
  double radius_from_angle(double angle_rad) const {
    const double t = angle_rad * angle_rad;
    return angle_rad * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
  }
  /// Returns the derivative of d with respect to the angle, in focal lengths per rad.
  double radius_derivative(double angle_rad) const {
    const double t = angle_rad * angle_rad;
    return 1 + t * (3 * k[0] + t * (5 * k[1] + t * (7 * k[2] + t * 9 * k[3])));
  }

  /// Computes the angle up to which the model is one to one: the smallest angle at which the
  /// distance stops growing, at most pi. Beyond it two rays share a pixel, and the model describes
  /// no lens.
  double compute_max_angle_rad() const;

  /// Inverts d(a) by Newton's method within a shrinking bracket.
  ///
  /// @param at_distance  distance to invert, in focal lengths, >= 0
  /// @param valid_rad    compute_max_angle_rad()
  /// @param start_rad    initial angle, 0 to valid_rad
  /// @return             angle in [0, valid_rad]; NaN if the distance exceeds that of valid_rad
  double angle_from_radius_rad(double at_distance, double valid_rad, double start_rad) const;
};

/// Inverse of the radial projection of one lens. A table of initial angles reduces Newton's method
/// to one step.
class FisheyeAngles {
 public:
  explicit FisheyeAngles(const Fisheye& fisheye);

  double max_angle_rad() const { return valid_rad_; }
  /// Returns the angle, rad, of a ray whose image is at `distance` focal lengths from the principal
  /// point. NaN beyond the valid range (Fisheye::angle_from_radius_rad()).
  double operator()(double distance) const {
    return fisheye_.angle_from_radius_rad(distance, valid_rad_, look_up_angle_rad(distance));
  }

 private:
  double look_up_angle_rad(double distance) const;

  Fisheye fisheye_;
  double valid_rad_;
  static constexpr int kIntervals = 64;
  double intervals_per_distance_;
  /// Initial angle in each of kIntervals equal intervals of the distance: coefficients of a cubic
  /// polynomial of the position in the interval (0 to 1), the constant first.
  std::array<std::array<double, 4>, kIntervals> initial_angles_;
};

}  // namespace vlp
