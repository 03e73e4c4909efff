// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>

#include "plane.h"

namespace vlp {

/// Planar similarity transform in complex notation: p = offset + factor * z. The scale is |factor|,
/// the rotation angle arg factor. Reflections are excluded.
struct Similarity {
  Eigen::Vector2d offset;
  Eigen::Vector2d factor;
};

/// Fits the similarity p = offset + factor * z that maps from(i) to to(i), i < count. Minimizes the
/// sum of the squared distances in the `to` plane, with equal weights. Two pairs are fitted
/// exactly.
///
/// @param from, to  callables that return point i as an Eigen::Vector2d, in any units
/// @return          std::nullopt for fewer than two pairs; also if within rounding all `from` or
///     all `to` coincide or the best factor is 0 (regular polygon and its mirror image)
///
/// Closed form, with primes for means:
///   factor = sum conj(from_i - from')(to_i - to') / sum |from_i - from'|^2,
///   offset = to' - factor * from'.
template <typename From, typename To>
std::optional<Similarity> fit_similarity_transform(std::size_t count, const From& from,
                                                   const To& to) {
  if (count < 2) return std::nullopt;
  Eigen::Vector2d from_mean = Eigen::Vector2d::Zero(), to_mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    from_mean += from(i);
    to_mean += to(i);
  }
  from_mean /= static_cast<double>(count);
  to_mean /= static_cast<double>(count);
  Eigen::Vector2d product = Eigen::Vector2d::Zero();
  double sum_of_squares = 0, from_magnitude = 0, to_magnitude = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d difference = from(i) - from_mean;
    product += conjugate_product(difference, to(i) - to_mean);
    sum_of_squares += difference.squaredNorm();
    from_magnitude += from(i).squaredNorm();
    to_magnitude += to(i).squaredNorm();
  }
  // Smaller differences are rounding errors of the coordinates.
  constexpr double numeric_tolerance = 4 * std::numeric_limits<double>::epsilon();
  if (!(sum_of_squares > numeric_tolerance * numeric_tolerance * from_magnitude) ||
      !(product.squaredNorm() >
        numeric_tolerance * numeric_tolerance * sum_of_squares * to_magnitude)) {
    return std::nullopt;
  }
  const Eigen::Vector2d factor = product / sum_of_squares;
  return Similarity{to_mean - complex_product(factor, from_mean), factor};
}

}  // namespace vlp
