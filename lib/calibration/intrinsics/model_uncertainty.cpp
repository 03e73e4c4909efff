// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/model_uncertainty.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

/// Difference between the lens of a solution and that of another model.
struct ModelDifference {
  LensModel model;
  /// Displacement of each pixel, u and v, and the larger one of both directions, px.
  Eigen::VectorXd displacements_px, lengths_px;
  /// Change of the intrinsics that causes the displacements.
  Eigen::VectorXd intrinsics;
  double worst_px, noise_px;

  double excess_px2() const { return worst_px * worst_px - noise_px * noise_px; }
};

/// Returns std::nullopt if the lenses have rays of fewer than three pixels in common.
std::optional<ModelDifference> compute_difference(const Lens& lens, const Lens& other,
                                                  const std::vector<Eigen::Vector2d>& pixels) {
  constexpr double min_pivot = 1e-5;  // combinations that displace hardly any pixel are left out
  const auto other_from_lens = fit_lens_rotation(lens, other, pixels);
  if (!other_from_lens) return {};
  const auto count = static_cast<Eigen::Index>(num_lens_parameters(lens.lens_model()));
  const auto rows = std::ssize(pixels);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(2 * rows, count + 3);
  Eigen::VectorXd displacements_px = Eigen::VectorXd::Zero(2 * rows),
                  lengths_px = Eigen::VectorXd::Zero(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const auto ray = lens.unproject_pixel(pixels[static_cast<std::size_t>(i)]),
               other_ray = other.unproject_pixel(pixels[static_cast<std::size_t>(i)]);
    if (!ray || !other_ray) continue;
    const Eigen::Vector3d from = ray->direction.normalized(),
                          to = other_ray->direction.normalized(),
                          change = *other_from_lens * from - to;
    const auto at = lens.project_with_jacobians(from), other_at = other.project_with_jacobians(to);
    if (!at || !other_at) continue;
    const Eigen::Vector2d displacement_px = other_at->d_pixel_d_point * change;
    const Eigen::Vector2d reverse_px = at->d_pixel_d_point * other_from_lens->transpose() * change;
    jacobian.middleRows<2>(2 * i) << at->d_pixel_d_parameters,
        -at->d_pixel_d_point * skew_symmetric_matrix(from);
    displacements_px.segment<2>(2 * i) = displacement_px;
    lengths_px[i] = std::max(displacement_px.norm(), reverse_px.norm());
  }
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(min_pivot);
  solver.compute(jacobian * scale.asDiagonal());
  const Eigen::VectorXd intrinsics =
      (scale.asDiagonal() * solver.solve(displacements_px)).head(count);
  const double worst_px = lengths_px.maxCoeff();
  return ModelDifference{other.lens_model(), displacements_px, lengths_px, intrinsics, worst_px, 0};
}

/// Returns w_m of each difference. The differences are in descending order of their excess.
Eigen::VectorXd compute_weights(const std::vector<ModelDifference>& differences) {
  const auto count = std::ssize(differences);
  Eigen::MatrixXd scaled_px(differences.front().displacements_px.size(), count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const ModelDifference& difference = differences[static_cast<std::size_t>(m)];
    scaled_px.col(m) = difference.worst_px * difference.displacements_px.normalized();
  }
  const Eigen::MatrixXd products = scaled_px.transpose() * scaled_px;
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(count);
  for (Eigen::Index m = 0; m < count; ++m) {
    const double noise_px2 = std::pow(differences[static_cast<std::size_t>(m)].noise_px, 2);
    // Inverse of s^2 1 + B B' by the matrix inversion lemma.
    const Eigen::VectorXd root = weights.cwiseSqrt();
    const Eigen::MatrixXd inner =
        Eigen::MatrixXd(root.asDiagonal() * products * root.asDiagonal()) +
        noise_px2 * Eigen::MatrixXd::Identity(count, count);
    const Eigen::VectorXd common = root.cwiseProduct(products.col(m));
    const double beyond_px2 = products(m, m) - common.dot(inner.ldlt().solve(common));
    weights[m] = 1 - noise_px2 / std::max(beyond_px2, noise_px2);
  }
  return weights;
}

}  // namespace

std::vector<IntrinsicsSolution> list_plausible_model_fits(const IntrinsicsSolution& solution,
                                                          const LensChoice& comparison) {
  const LensModel model = solution.problem.lens_model;
  const auto own = std::ranges::find(comparison.candidates, model, &LensCandidate::model);
  const double own_excess = own == comparison.candidates.end() ? 0 : own->excess;
  std::vector<IntrinsicsSolution> fits;
  for (const LensCandidate& candidate : comparison.candidates) {
    const bool counts = candidate.may_describe_lens() || candidate.excess <= own_excess;
    if (candidate.fit && counts && candidate.model != model) fits.push_back(*candidate.fit);
  }
  return fits;
}

std::optional<ModelUncertainty> combine_model_fits(const IntrinsicsSolution& solution,
                                                   std::span<const IntrinsicsSolution> others,
                                                   const ImageRegion& region, double noise_px) {
  const Lens lens = solution.fitted_lens();
  const std::array<int, 2>& imager_px = solution.problem.imager_px;
  std::vector<Eigen::Vector2d> pixels = make_pixel_grid(imager_px);
  std::erase_if(pixels, [&](const auto& pixel) { return !polygon_contains(region, pixel); });
  std::vector<ModelDifference> differences;
  for (const IntrinsicsSolution& fit : others) {
    auto difference = compute_difference(lens, fit.fitted_lens(), pixels);
    if (!difference || difference->worst_px <= noise_px) continue;
    difference->noise_px = std::max(
        noise_px,
        predict_max_difference_px(fit.fitted_lens(), imager_px, jackknife_covariance(fit), region));
    if (difference->excess_px2() > 0) differences.push_back(std::move(*difference));
  }
  if (differences.empty()) return {};
  std::ranges::sort(differences, std::greater(), &ModelDifference::excess_px2);
  const Eigen::VectorXd weights = compute_weights(differences);
  const auto count = differences.front().intrinsics.size();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  Eigen::VectorXd variances_px2 = Eigen::VectorXd::Zero(std::ssize(pixels));
  for (std::size_t m = 0; m < differences.size(); ++m) {
    const ModelDifference& difference = differences[m];
    const double weight = weights[static_cast<Eigen::Index>(m)];
    covariance += weight * difference.intrinsics * difference.intrinsics.transpose();
    variances_px2 += weight * difference.lengths_px.cwiseAbs2();
  }
  return ModelUncertainty{differences.front().model, covariance, variances_px2.cwiseSqrt().mean(),
                          std::sqrt(variances_px2.maxCoeff())};
}

}  // namespace vlp
