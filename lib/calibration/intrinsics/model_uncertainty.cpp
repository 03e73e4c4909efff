// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/model_uncertainty.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

/// Pixels of a lens with their rays, and their displacements through another lens, px.
struct Displacements {
  std::vector<Eigen::Vector3d> rays;
  std::vector<Eigen::Vector2d> displacements_px;
  double mean_px = 0, worst_px = 0;
};

Displacements compute_displacements(const Lens& lens, const Lens& other,
                                    const std::vector<Eigen::Vector2d>& pixels) {
  Displacements result;
  const auto other_from_lens = fit_rotation_between_lenses(lens, other, pixels);
  if (!other_from_lens) return result;
  for (const Eigen::Vector2d& pixel : pixels) {
    const auto ray = lens.unproject_pixel(pixel);
    const auto seen = ray ? other.project_point(*other_from_lens * ray->direction) : std::nullopt;
    // Without a ray through both lenses there is no displacement: the worst one is a lower limit.
    if (!seen || !lens.project_point(ray->direction.normalized())) continue;
    result.rays.push_back(ray->direction.normalized());
    result.displacements_px.emplace_back(*seen - pixel);
    const double length_px = result.displacements_px.back().norm();
    result.mean_px += length_px;
    result.worst_px = std::max(result.worst_px, length_px);
  }
  result.mean_px /= std::max(1.0, static_cast<double>(result.rays.size()));
  return result;
}

/// Fits the change of the intrinsics that displaces the pixels, with a rotation of the camera free.
Eigen::VectorXd fit_intrinsics_change(const Lens& lens, const Displacements& displacements) {
  constexpr double min_pivot = 1e-5;  // combinations that displace hardly any pixel are left out
  const auto count = static_cast<Eigen::Index>(num_lens_parameters(lens.lens_model()));
  const auto pixels = std::ssize(displacements.rays);
  Eigen::MatrixXd jacobian(2 * pixels, count + 3);
  Eigen::VectorXd target(2 * pixels);
  for (Eigen::Index i = 0; i < pixels; ++i) {
    const Eigen::Vector3d& ray = displacements.rays[static_cast<std::size_t>(i)];
    const auto at = lens.project_point_with_jacobians(ray).value();
    jacobian.middleRows<2>(2 * i) << at.d_pixel_d_parameters,
        -at.d_pixel_d_point * skew_symmetric_matrix(ray);
    target.segment<2>(2 * i) = displacements.displacements_px[static_cast<std::size_t>(i)];
  }
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(min_pivot);
  solver.compute(jacobian * scale.asDiagonal());
  return (scale.asDiagonal() * solver.solve(target)).head(count);
}

}  // namespace

std::optional<ModelUncertainty> compute_model_uncertainty(const IntrinsicsSolution& solution,
                                                          const LensChoice& comparison,
                                                          const ImageRegion& region,
                                                          double noise_px) {
  const Lens lens = solution.fitted_lens();
  const std::array<int, 2>& imager_px = solution.problem.imager_px;
  std::vector<Eigen::Vector2d> pixels = make_regular_pixel_grid(imager_px);
  std::erase_if(pixels, [&](const auto& pixel) { return !polygon_contains(region, pixel); });
  const auto own =
      std::ranges::find(comparison.candidates, lens.lens_model(), &LensCandidate::model);
  const double own_excess = own == comparison.candidates.end() ? 0 : own->excess;
  std::optional<ModelUncertainty> farthest;
  for (const LensCandidate& candidate : comparison.candidates) {
    const bool counts = candidate.may_describe_lens() || candidate.excess <= own_excess;
    if (!candidate.fit || !counts || candidate.model == lens.lens_model()) continue;
    const Lens other = candidate.fit->fitted_lens();
    const Displacements displacements = compute_displacements(lens, other, pixels);
    const Displacements reverse = compute_displacements(other, lens, pixels);
    const double worst_px = std::max(displacements.worst_px, reverse.worst_px),
                 mean_px = std::max(displacements.mean_px, reverse.mean_px),
                 found_px = farthest ? farthest->worst_px : 0;
    if (displacements.rays.empty() || worst_px <= std::max(noise_px, found_px)) continue;
    const double other_noise_px = estimate_expected_max_projection_difference_px(
        other, imager_px, estimate_intrinsics_covariance_by_jackknife(*candidate.fit), region);
    const double ratio = std::max(noise_px, other_noise_px) / worst_px;
    const double factor = std::sqrt(std::max(0.0, 1 - ratio * ratio));
    if (factor * worst_px <= found_px) continue;
    farthest = {candidate.model, factor * fit_intrinsics_change(lens, displacements),
                factor * mean_px, factor * worst_px};
  }
  return farthest;
}

}  // namespace vlp
