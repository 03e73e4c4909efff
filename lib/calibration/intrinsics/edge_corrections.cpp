// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/edge_corrections.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "calibration/intrinsics/board_poses.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "geometry/median.h"
#include "geometry/symmetric.h"

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
std::optional<double> compute_lens_sagitta(const Chord& chord, const Eigen::Vector3d& from_ray,
                                           const Eigen::Vector3d& to_ray, const Lens& lens,
                                           double w) {
  constexpr int max_iterations = 3;
  const Eigen::Vector2d length = chord.to - chord.from;
  double fraction = (1 + w) / 2;
  for (int iteration = 0;; ++iteration) {
    const auto pixel = lens.project_point((1 - fraction) * from_ray + fraction * to_ray);
    if (!pixel) return {};
    const Eigen::Vector2d offset = *pixel - chord.from;
    if (iteration + 1 == max_iterations) return chord.outwards.dot(offset);
    fraction += (1 + w) / 2 - length.dot(offset) / length.squaredNorm();
  }
}

/// Outward displacements of the ends of an edge, and the curvature by the lens.
struct DisplacedEdge {
  std::array<double, 2> outwards_px;
  EdgeCurvature curvature;
};

std::optional<DisplacedEdge> displace_edge(const Chord& chord, const EdgeCurvature& seen,
                                           const Lens& lens) {
  const auto from_ray = lens.unproject_pixel(chord.from), to_ray = lens.unproject_pixel(chord.to);
  if (!from_ray || !to_ray) return {};
  const auto lens_at = [&](double w) {
    return compute_lens_sagitta(chord, from_ray->direction, to_ray->direction, lens, w);
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
    const double difference = seen.curve_offset_px(w) - *lens_offset;
    mean += weight / 2 * difference;
    slope += 3 * weight / 2 * difference * place / seen.reach;
  }
  const auto middle = lens_at(0), before = lens_at(-0.5), after = lens_at(0.5);
  if (!middle || !before || !after) return {};
  return DisplacedEdge{{mean - slope, mean + slope},
                       {-*middle, (*before - *after) / 0.75, seen.reach}};
}

}  // namespace

double correct_curvature(std::vector<BoardLattice::Corner>& corners, const Lens& lens) {
  constexpr double max_fraction = 0.25;  // of an edge; beyond it the corner or the edges are wrong
  double max_displacement_px = 0;
  for (std::size_t first = 0; first + 4 <= corners.size(); first += 4) {
    const auto tag = corners.begin() + static_cast<std::ptrdiff_t>(first);
    if (!std::all_of(tag, tag + 4, [](const auto& corner) { return corner.curvature.reach > 0; })) {
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
      edges[k] = displace_edge(chord, tag[at].curvature, lens);
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
      corner.curvature = edges[k]->curvature;
      max_displacement_px = std::max(max_displacement_px, steps[k].norm());
    }
  }
  return max_displacement_px;
}

namespace {

constexpr int kPose = 6, kUnknowns = kPose + 4;
using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Column = Eigen::Matrix<double, kUnknowns, 1>;

/// Normal equations of the pose and the shift of a view, for corners of variance 1 / weight^2.
struct DisplacementEquations {
  Square normal = Square::Zero();
  Column right = Column::Zero();
  EdgeDisplacement shift;
  bool is_valid = false;

  /// Solves with priors: the terms of the shift are `prior`, with the given weights.
  EdgeDisplacement solve_with_prior(const Eigen::Vector4d& prior,
                                    const Eigen::Vector4d& weights) const {
    Square all = normal;
    Column sum = right;
    all.diagonal().tail<4>() += weights;
    sum.tail<4>() += weights.cwiseProduct(prior);
    const Column solution = solve_symmetric(all, sum);
    EdgeDisplacement result = shift;
    if (solution.allFinite()) result.coefficients = solution.tail<4>();
    return result;
  }
};

DisplacementEquations make_equations(const std::vector<BoardLattice::Corner>& corners,
                                     const Lens& lens) {
  constexpr std::size_t min_corners = 12;
  if (corners.size() < min_corners || corners.front().d_pixel_d_edge_shift.isZero(0)) return {};
  const auto pose = estimate_view_pose(corners, lens);
  if (!pose) return {};
  DisplacementEquations equations;
  const auto count = static_cast<double>(corners.size());
  double squares = 0;
  for (const auto& corner : corners) equations.shift.middle += corner.pixel / count;
  for (const auto& corner : corners) {
    squares += (corner.pixel - equations.shift.middle).squaredNorm() / count;
  }
  equations.shift.radius_px = std::max(1.0, std::sqrt(squares));
  const auto& [rotation, translation_m] = pose->camera_from_board;
  const Eigen::Matrix3d rotation_matrix = rotation_from_vector(rotation);
  for (const auto& corner : corners) {
    const Eigen::Vector3d rotated = rotation_matrix * corner.in_board_m;
    const auto projection = lens.project_with_jacobians(rotated + translation_m);
    if (!projection) return {};
    const Eigen::Vector2d x = (corner.pixel - equations.shift.middle) / equations.shift.radius_px;
    Eigen::Matrix<double, 2, kUnknowns> jacobian;
    jacobian << -projection->d_pixel_d_point * skew_symmetric_matrix(rotated),
        projection->d_pixel_d_point,
        corner.d_pixel_d_edge_shift * Eigen::RowVector4d(1, x.x(), x.y(), x.squaredNorm());
    jacobian *= corner.weight;
    equations.normal += jacobian.transpose() * jacobian;
    equations.right += jacobian.transpose() * (corner.weight * (corner.pixel - projection->pixel));
  }
  equations.is_valid = true;
  return equations;
}

}  // namespace

std::vector<EdgeDisplacement> fit_displacements(
    std::span<const std::vector<BoardLattice::Corner>> views, const Lens& lens,
    DisplacementForm form) {
  // Corner noise of 0.05 px; shifts differ by 0.1 px from view to view and within a view.
  constexpr double weight = 0.25, none = 1e-6, all = 1e9;
  const double uneven = form == DisplacementForm::constant ? all : weight;
  const Eigen::Vector4d weak_weights(none, uneven, uneven, uneven),
      prior_weights(weight, uneven, uneven, uneven);
  std::vector<DisplacementEquations> equations;
  std::vector<double> alone_px;
  for (const auto& corners : views) {
    equations.push_back(make_equations(corners, lens));
    if (equations.back().is_valid) {
      alone_px.push_back(
          equations.back().solve_with_prior(Eigen::Vector4d::Zero(), weak_weights).coefficients[0]);
    }
  }
  std::vector<EdgeDisplacement> shifts(views.size());
  if (alone_px.empty()) return shifts;
  const Eigen::Vector4d prior(upper_median(alone_px), 0, 0, 0);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (equations[i].is_valid) {
      shifts[i] = equations[i].solve_with_prior(prior, prior_weights);
    } else if (!views[i].empty() && !views[i].front().d_pixel_d_edge_shift.isZero(0)) {
      shifts[i].coefficients = prior;
    }
  }
  return shifts;
}

double correct_displacement(std::vector<BoardLattice::Corner>& corners,
                            const EdgeDisplacement& shift) {
  double sum_px = 0;
  for (auto& corner : corners) {
    const double shift_px = shift.inward_shift_px(corner.pixel);
    corner.pixel -= shift_px * corner.d_pixel_d_edge_shift;
    sum_px += shift_px;
  }
  return corners.empty() ? 0 : sum_px / static_cast<double>(corners.size());
}

}  // namespace vlp
