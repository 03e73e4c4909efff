// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

/// Points of the plane as complex numbers x + j y, the notation of the positioning equations.
/// std::complex is not used because it checks every product for infinities.
namespace vlp {

/// Returns the complex product a b of two vectors x + j y: `b` rotated by the angle of `a` and
/// multiplied by |a|.
inline Eigen::Vector2d complex_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {a.x() * b.x() - a.y() * b.y(), a.x() * b.y() + a.y() * b.x()};
}

/// Returns conj(a) b. The real part is the dot product, the imaginary part the cross product.
inline Eigen::Vector2d conjugate_product(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {a.x() * b.x() + a.y() * b.y(), a.x() * b.y() - a.y() * b.x()};
}

/// Returns the matrix M for which M b is complex_product(a, b).
inline Eigen::Matrix2d complex_product_matrix(const Eigen::Vector2d& a) {
  return (Eigen::Matrix2d() << a.x(), -a.y(), a.y(), a.x()).finished();
}

}  // namespace vlp
