// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_uncertainty.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "calibration/intrinsics/rotation_vector.h"

namespace vlp {
namespace {

double compute_residual_sd(const BoardProblem& problem, const Eigen::VectorXd& residuals_px) {
  double sum = 0, squares = 0, count = 0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    if (problem.points[i].z() <= 0) continue;
    const auto at = residuals_px.segment<2>(2 * static_cast<Eigen::Index>(i));
    sum += at.sum();
    squares += at.squaredNorm();
    count += 2;
  }
  return std::sqrt(squares / count - (sum / count) * (sum / count));
}

/// Sums the rows over the residuals of each tag, weighted by the residuals: a row for each tag of
/// each view, from a row for each residual.
Eigen::MatrixXd sum_rows_by_tag(const Eigen::MatrixXd& by_residual,
                                const Eigen::VectorXd& residuals_px, const BoardLattice& lattice) {
  const std::size_t points = lattice.points_per_part(),
                    points_per_view = lattice.num_board_parts() * points;
  const Eigen::Index corners = residuals_px.size() / 2;
  const auto views = static_cast<std::size_t>(corners) / points_per_view;
  Eigen::MatrixXd sums =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(views * points), by_residual.cols());
  for (Eigen::Index i = 0; i < corners; ++i) {
    const auto corner = static_cast<std::size_t>(i);
    const std::size_t tag =
        corner / points_per_view * points + lattice.get_tag_of_point(corner % points);
    sums.row(static_cast<Eigen::Index>(tag)) +=
        residuals_px.segment<2>(2 * i).transpose() * by_residual.middleRows<2>(2 * i);
  }
  return sums;
}

/// Returns the factor n / (n - k) of ProjectionUncertainty.
double compute_freedom_factor(const BoardProblem& problem, Eigen::Index states) {
  const double count = 2 * static_cast<double>(list_inlier_pixels(problem).size());
  return count / std::max(count - static_cast<double>(states), 1.0);
}

/// Computes the regularization bias of the whole packed state.
Eigen::VectorXd compute_regularization_bias(const Linearization& at, double sigma_px,
                                            double regularization_noise_px) {
  constexpr double min_px = 0.01;  // bounds coefficients that the corners do not determine
  const Eigen::Index corners = at.residuals_px.size(),
                     num_regularization = at.regularization.size();
  if (num_regularization == 0) return Eigen::VectorXd::Zero(at.jacobian_transposed.rows());
  const Eigen::SparseMatrix<double> corner_jacobian = at.jacobian_transposed.leftCols(corners);
  const Eigen::SparseMatrix<double> regularization_jacobian =
      at.jacobian_transposed.rightCols(num_regularization);
  const double ratio =
      std::min(1.0, std::pow(std::max(sigma_px, min_px) / regularization_noise_px, 2));
  const Eigen::SparseMatrix<double> normal =
      corner_jacobian * corner_jacobian.transpose() +
      ratio * (regularization_jacobian * regularization_jacobian.transpose());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) {
    return Eigen::VectorXd::Zero(normal.rows());
  }
  return (1 - ratio) * factor.solve(regularization_jacobian * at.regularization);
}

}  // namespace

/// Sensitivity of the intrinsics and of the mean rotation to the residuals of the corners.
struct ProjectionUncertainty::Sensitivity {
  explicit Sensitivity(const IntrinsicsSolution& solution);

  Eigen::VectorXd residuals_px;
  double residual_sd_px = 0;
  Eigen::Index num_states = 0;
  /// A row for each residual; empty if the views do not determine all parameters.
  Eigen::MatrixXd by_residual;
  Eigen::VectorXd regularization_bias;
};

ProjectionUncertainty::Sensitivity::Sensitivity(const IntrinsicsSolution& solution)
    : regularization_bias(Eigen::VectorXd::Zero(std::ssize(solution.problem.intrinsics))) {
  const BoardProblem& problem = solution.problem;
  const Linearization at = linearize_board_problem(problem, solution.solved_parameters);
  const Eigen::SparseMatrix<double>& jt = at.jacobian_transposed;
  const Eigen::SparseMatrix<double> normal = jt * jt.transpose();
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(normal);
  if (factor.info() != Eigen::Success || !(factor.vectorD().minCoeff() > 0)) return;

  const auto intrinsics = static_cast<Eigen::Index>(problem.intrinsics.size());
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(jt.rows(), intrinsics + 3);
  wanted.block(0, at.first_intrinsic, at.poses, at.poses).setIdentity();
  const double ratio = 1 / static_cast<double>(problem.poses.size());
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    wanted.block<3, 3>(at.poses + 6 * static_cast<Eigen::Index>(i), intrinsics) =
        ratio * so3_left_jacobian(problem.poses[i].rotation).transpose();
  }
  wanted = at.scale.asDiagonal() * wanted;
  by_residual = (jt.leftCols(at.residuals_px.size()).transpose() * factor.solve(wanted)).eval();
  residuals_px = at.residuals_px;
  residual_sd_px = compute_residual_sd(problem, residuals_px);
  num_states = jt.rows();
  regularization_bias = wanted.leftCols(intrinsics).transpose() *
                        compute_regularization_bias(at, residual_sd_px, problem.noise_px);
}

ProjectionUncertainty::ProjectionUncertainty(const IntrinsicsSolution& solution)
    : ProjectionUncertainty(solution, Sensitivity(solution), nullptr) {}

ProjectionUncertainty::ProjectionUncertainty(const IntrinsicsSolution& solution,
                                             const BoardLattice& lattice)
    : ProjectionUncertainty(solution, Sensitivity(solution), &lattice) {}

ProjectionUncertainty::ByCornersAndByTags ProjectionUncertainty::compare_corners_and_tags(
    const IntrinsicsSolution& solution, const BoardLattice& lattice) {
  const Sensitivity sensitivity(solution);
  return {ProjectionUncertainty(solution, sensitivity, nullptr),
          ProjectionUncertainty(solution, sensitivity, &lattice)};
}

ProjectionUncertainty::ProjectionUncertainty(const IntrinsicsSolution& solution,
                                             const Sensitivity& sensitivity,
                                             const BoardLattice* lattice)
    : lens_(solution.fitted_lens()),
      is_determined_(false),
      regularization_bias_(sensitivity.regularization_bias) {
  const Eigen::MatrixXd& by_residual = sensitivity.by_residual;
  if (by_residual.size() == 0) return;
  if (lattice == nullptr) {
    const double sigma_px = sensitivity.residual_sd_px;
    covariance_ = sigma_px * sigma_px * by_residual.transpose() * by_residual;
  } else {
    const Eigen::MatrixXd sums = sum_rows_by_tag(by_residual, sensitivity.residuals_px, *lattice);
    covariance_ =
        compute_freedom_factor(solution.problem, sensitivity.num_states) * sums.transpose() * sums;
  }
  is_determined_ = covariance_.allFinite();
}

Eigen::Matrix2d ProjectionUncertainty::projection_covariance(const Eigen::Vector2d& pixel) const {
  const auto ray = lens_.unproject_pixel(pixel);
  const auto projection = ray ? lens_.project_with_jacobians(ray->direction) : std::nullopt;
  const auto derivatives =
      projection ? lens_.differentiate_intrinsics(ray->direction) : std::nullopt;
  if (!is_determined_ || !derivatives) {
    return Eigen::Matrix2d::Identity() * std::numeric_limits<double>::infinity();
  }
  std::vector<Eigen::Index> states = derivatives->parameters;
  for (Eigen::Index i = covariance_.rows() - 3; i < covariance_.rows(); ++i) states.push_back(i);
  Eigen::Matrix2Xd gradient(2, std::ssize(states));
  gradient << derivatives->d_pixel,
      -projection->d_pixel_d_point * skew_symmetric_matrix(ray->direction);
  const Eigen::MatrixXd state_covariance = covariance_(states, states);
  return gradient * state_covariance * gradient.transpose();
}

double ProjectionUncertainty::worst_direction_sd_px(const Eigen::Vector2d& pixel) const {
  const Eigen::Matrix2d c = projection_covariance(pixel);
  if (!c.allFinite()) return std::numeric_limits<double>::infinity();
  const double mean = c.trace() / 2, half = (c(0, 0) - c(1, 1)) / 2;
  return std::sqrt(mean + std::hypot(half, c(0, 1)));
}

Eigen::MatrixXd ProjectionUncertainty::intrinsics_covariance() const {
  const auto count = static_cast<Eigen::Index>(num_lens_parameters(lens_.lens_model()));
  if (is_determined_) return covariance_.topLeftCorner(count, count);
  return Eigen::MatrixXd::Constant(count, count, std::numeric_limits<double>::infinity());
}

double ProjectionUncertainty::focal_x_sd_px() const {
  return is_determined_ && covariance_(0, 0) > 0 ? std::sqrt(covariance_(0, 0))
                                                 : std::numeric_limits<double>::infinity();
}

}  // namespace vlp
