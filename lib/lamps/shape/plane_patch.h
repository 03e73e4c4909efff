// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "geometry/types.h"
#include "lamps/image/pixel_box.h"
#include "lamps/shape/light_center.h"

namespace vlp {

/// Map from the pixels (column, line) of a box to the plane of LightShape: a polynomial of degree
/// 7, fitted at 8 x 8 Chebyshev nodes. Its error is below 0.01 px for a lens of 80 degrees and
/// boxes of half of the image. Terms of high degree are not evaluated if their sum is below 1e-4
/// px.
class PlanePatch {
  static constexpr int kMaxDegree = 7, kTerms = (kMaxDegree + 1) * (kMaxDegree + 2) / 2;

 public:
  /// Point in the plane of LightShape, and its derivative with respect to the pixel (column, line).
  struct Point {
    Eigen::Vector2d at;
    Matrix2 d_at_d_pixel;
  };

  /// Returns std::nullopt if the lens has no ray at a node of the box.
  static std::optional<PlanePatch> fit(const LightShape& shape, const PixelBox& box);

  /// Polynomials in the column, for one scanline.
  class Row {
   public:
    Row(const PlanePatch& patch, double line);
    Point at_column(double column) const;

   private:
    double middle_, half_;
    std::size_t degree_;
    std::array<Eigen::Vector2d, kMaxDegree + 1> at_, d_line_;
  };

 private:
  int select_polynomial_degree() const;

  Eigen::Vector2d middle_, half_;
  int degree_;
  Eigen::Matrix<double, kTerms, 2> coefficients_;
};

}  // namespace vlp
