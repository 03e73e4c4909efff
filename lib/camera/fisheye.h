// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

namespace vlp {

/// How far from the centre a ray lands that makes the angle a with the axis, as a focal length's
/// share:
///   d(a) = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)
/// Source: Kannala and Brandt, "A generic camera model and calibration method for conventional,
/// wide-angle, and fish-eye lenses", 2006; OpenCV's fisheye module; Kalibr's "equidistant".
struct Fisheye {
  /// k1 k2 k3 k4.
  std::array<double, 4> k{};

  double distance(double angle_rad) const {
    const double t = angle_rad * angle_rad;
    return angle_rad * (1 + t * (k[0] + t * (k[1] + t * (k[2] + t * k[3]))));
  }
  double slope(double angle_rad) const {
    const double t = angle_rad * angle_rad;
    return 1 + t * (3 * k[0] + t * (5 * k[1] + t * (7 * k[2] + t * 9 * k[3])));
  }

  /// The smallest angle at which the distance stops growing, pi at most. Beyond it two rays share a
  /// pixel, and the model describes no lens.
  double valid_angle_rad() const;

  /// The angle up to valid_rad that lands there, by Newton's method in a shrinking bracket from
  /// start_rad; not a number when none does. Preconditions: distance >= 0, valid_rad =
  /// valid_angle_rad(), the start is within 0 and that.
  double angle_rad(double at_distance, double valid_rad, double start_rad) const;
};

/// The angles of a lens, from a table that leaves Newton's method a step.
class FisheyeAngles {
 public:
  explicit FisheyeAngles(const Fisheye& fisheye);

  double valid_rad() const { return valid_rad_; }
  /// As Fisheye::angle_rad().
  double operator()(double distance) const {
    return fisheye_.angle_rad(distance, valid_rad_, start_for(distance));
  }

 private:
  double start_for(double distance) const;

  Fisheye fisheye_;
  double valid_rad_;
  /// Of equal intervals of the distance, the angle as a cubic polynomial of the share of it, the
  /// constant first.
  static constexpr int kIntervals = 64;
  double intervals_per_distance_;
  std::array<std::array<double, 4>, kIntervals> starts_;
};

}  // namespace vlp
