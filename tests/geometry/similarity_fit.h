// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "geometry/similarity.h"
#include "support/random.h"

namespace vlp {

using Points = std::vector<Eigen::Vector2d>;

inline Points random_points(Random& random, std::size_t count, double half_width = 1) {
  Points points(count);
  for (auto& point : points) {
    point.x() = random.uniform(-half_width, half_width);
    point.y() = random.uniform(-half_width, half_width);
  }
  return points;
}

inline std::optional<Similarity> fit(const Points& from, const Points& to) {
  return fit_similarity_transform(
      from.size(), [&](std::size_t i) { return from[i]; }, [&](std::size_t i) { return to[i]; });
}

}  // namespace vlp
