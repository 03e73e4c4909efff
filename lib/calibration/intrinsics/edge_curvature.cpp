// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/edge_curvature.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace vlp {
namespace {

/// Edge of a tag as a straight line between two pixels.
struct Chord {
  Eigen::Vector2d from, to, outwards;

  Chord(const Eigen::Vector2d& begin, const Eigen::Vector2d& end, const Eigen::Vector2d& inside)
      : from(begin), to(end), outwards(begin.y() - end.y(), end.x() - begin.x()) {
    outwards.normalize();
    if (outwards.dot(inside - from) > 0) outwards = -outwards;
  }
};

/// Returns the distance, px, outside of a chord at which the lens projects the straight line
/// between its ends, at w.
std::optional<double> compute_edge_sagitta_by_lens(const Chord& chord,
                                                   const Eigen::Vector3d& from_ray,
                                                   const Eigen::Vector3d& to_ray, const Lens& lens,
                                                   double w) {
  constexpr int max_iterations = 3;
  const Eigen::Vector2d length = chord.to - chord.from;
  double fraction = (1 + w) / 2;
  for (int iteration = 0;; ++iteration) {
    const auto pixel = lens.project((1 - fraction) * from_ray + fraction * to_ray);
    if (!pixel) return {};
    const Eigen::Vector2d offset = *pixel - chord.from;
    if (iteration + 1 == max_iterations) return chord.outwards.dot(offset);
    fraction += (1 + w) / 2 - length.dot(offset) / length.squaredNorm();
  }
}

/// Outward displacements of the ends of an edge, and the curvature by the lens.
struct DisplacedEdge {
  std::array<double, 2> outwards_px;
  EdgeCurvature bow;
};

std::optional<DisplacedEdge> compute_displaced_edge(const Chord& chord, const EdgeCurvature& seen,
                                                    const Lens& lens) {
  const auto from_ray = lens.unproject(chord.from), to_ray = lens.unproject(chord.to);
  if (!from_ray || !to_ray) return {};
  const auto lens_at = [&](double w) {
    return compute_edge_sagitta_by_lens(chord, from_ray->direction, to_ray->direction, lens, w);
  };
  // Nodes and weights of Gauss-Legendre quadrature.
  constexpr std::array<std::array<double, 2>, 4> rule{{{-0.8611363115940526, 0.3478548451374538},
                                                       {-0.3399810435848563, 0.6521451548625461},
                                                       {0.3399810435848563, 0.6521451548625461},
                                                       {0.8611363115940526, 0.3478548451374538}}};
  double mean = 0, slope = 0;
  for (const auto& [place, weight] : rule) {
    const double w = seen.reach * place;
    const auto lens_offset = lens_at(w);
    if (!lens_offset) return {};
    const double difference = seen.at(w) - *lens_offset;
    mean += weight / 2 * difference;
    slope += 3 * weight / 2 * difference * place / seen.reach;
  }
  const auto middle = lens_at(0), before = lens_at(-0.5), after = lens_at(0.5);
  if (!middle || !before || !after) return {};
  return DisplacedEdge{{mean - slope, mean + slope},
                       {-*middle, (*before - *after) / 0.75, seen.reach}};
}

}  // namespace

double correct_corners_for_curved_edges(std::vector<BoardLattice::Corner>& corners,
                                        const Lens& lens) {
  constexpr double max_fraction = 0.25;  // of an edge; beyond it the corner or the edges are wrong
  double max_displacement_px = 0;
  for (std::size_t first = 0; first + 4 <= corners.size(); first += 4) {
    const auto tag = corners.begin() + static_cast<std::ptrdiff_t>(first);
    if (!std::all_of(tag, tag + 4, [](const auto& corner) { return corner.bow.reach > 0; })) {
      continue;
    }
    const Eigen::Vector2d inside = (tag[0].pixel + tag[1].pixel + tag[2].pixel + tag[3].pixel) / 4;
    std::array<std::optional<DisplacedEdge>, 4> edges;
    std::array<Eigen::Vector2d, 4> outwards;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto at = static_cast<std::ptrdiff_t>(k),
                 next = static_cast<std::ptrdiff_t>((k + 1) % 4);
      const Chord chord(tag[at].pixel, tag[next].pixel, inside);
      outwards[k] = chord.outwards;
      edges[k] = compute_displaced_edge(chord, tag[at].bow, lens);
    }
    if (!std::all_of(edges.begin(), edges.end(), [](const auto& edge) { return edge; })) continue;
    std::array<Eigen::Vector2d, 4> steps;
    bool is_small = true;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t previous = (k + 3) % 4, next = (k + 1) % 4;
      Eigen::Matrix2d normals;
      normals << outwards[previous].transpose(), outwards[k].transpose();
      steps[k] = normals.inverse() *
                 Eigen::Vector2d(edges[previous]->outwards_px[1], edges[k]->outwards_px[0]);
      const auto at = static_cast<std::ptrdiff_t>(k), after = static_cast<std::ptrdiff_t>(next);
      is_small =
          is_small && steps[k].norm() < max_fraction * (tag[after].pixel - tag[at].pixel).norm();
    }
    if (!is_small) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      BoardLattice::Corner& corner = tag[static_cast<std::ptrdiff_t>(k)];
      corner.pixel += steps[k];
      corner.bow = edges[k]->bow;
      max_displacement_px = std::max(max_displacement_px, steps[k].norm());
    }
  }
  return max_displacement_px;
}

}  // namespace vlp
