// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/lamp_bundle.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>

#include "calibration/levelling/lamp_equations.h"
#include "geometry/symmetric.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Observation = LampBundle::Observation;

double chi_squared(const LampBundle& bundle) {
  double sum = 0;
  for (const Capture& capture : bundle.captures) {
    for (const Observation& seen : capture.seen) {
      sum += whitened_residual(bundle, capture, seen).squaredNorm();
    }
    sum += motion_deviations(capture).squaredNorm();
  }
  return sum;
}

/// The inverse of the information along `free`; nothing where that is nothing but rounding.
std::optional<Eigen::MatrixXd> covariance_of(const SharedEquations& shared,
                                             const Eigen::MatrixXd& free) {
  constexpr double rounding = 1e-10;
  const Eigen::MatrixXd information = free.transpose() * shared.information * free;
  // Radians and metres are made comparable by what each would be worth if the poses were known.
  const Eigen::VectorXd scale =
      (free.cwiseAbs2().transpose() * shared.undiminished).cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return std::nullopt;
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const auto eigen = symmetric_eigen(scaled);
  if (!(eigen.values.minCoeff() > rounding)) return std::nullopt;
  const Eigen::MatrixXd directions = free * scale.asDiagonal() * eigen.vectors *
                                     eigen.values.cwiseInverse().cwiseSqrt().asDiagonal();
  return directions * directions.transpose();
}

/// Sets the effect of errors of the map on the fit.
void set_map_effect(const SharedEquations& shared, BundleFit& fit) {
  const Eigen::Index lamps = shared.information.rows() - 2;
  const Eigen::MatrixXd mixed = shared.information.topRightCorner(2, lamps);
  fit.d_tilt_d_lamps = -solve_symmetric(shared.information.topLeftCorner<2, 2>(), mixed);
  fit.d_chi_squared_d_lamp_squares =
      shared.information.diagonal().tail(lamps) +
      mixed.cwiseProduct(fit.d_tilt_d_lamps).colwise().sum().transpose();
}

/// How many unknowns of motions the sightings determine, where what is known does not: of each one
/// less its variance over that which was known before.
double told_of_motions(const LampBundle& bundle, const std::vector<OwnEquations>& own) {
  double told = 0;
  for (std::size_t k = 0; k < own.size(); ++k) {
    const OwnVector weights = motion_weights(bundle.captures[k]);
    if (weights.size() == 0) continue;
    const Eigen::Index size = 4 + weights.size();
    const OwnMatrix covariance = own[k].own.solve(OwnMatrix::Identity(size, size));
    told += static_cast<double>(weights.size()) -
            covariance.diagonal().tail(weights.size()).dot(weights.cwiseAbs2());
  }
  return told;
}

struct Step {
  Eigen::VectorXd shared;
  std::vector<OwnVector> own;

  double largest() const {
    double largest = shared.cwiseAbs().maxCoeff();
    for (const auto& one : own) largest = std::max(largest, one.cwiseAbs().maxCoeff());
    return largest;
  }
  void halve() {
    shared /= 2;
    for (auto& one : own) one /= 2;
  }
};

LampBundle moved(const LampBundle& bundle, const Step& step) {
  LampBundle next = bundle;
  const Eigen::Vector3d turn(step.shared[0], step.shared[1], 0);
  if (const double angle = turn.norm(); angle > 0) {
    next.level_from_camera =
        Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * bundle.level_from_camera;
  }
  for (std::size_t i = 0; i < next.lamps_m.size(); ++i) {
    next.lamps_m[i] += step.shared.segment<3>(static_cast<Eigen::Index>(2 + 3 * i));
  }
  for (std::size_t k = 0; k < next.captures.size(); ++k) {
    next.captures[k] = moved(bundle.captures[k], step.own[k]);
  }
  return next;
}

}  // namespace

Eigen::Vector2d whitened_residual(const LampBundle& bundle, const Capture& capture,
                                  const Observation& seen) {
  const Eigen::Vector3d x =
      bundle.level_from_camera.transpose() * x_in_level(capture, seen, bundle.lamps_m[seen.lamp]);
  if (!(x.z() > 0)) return Eigen::Vector2d::Constant(std::nan(""));
  return seen.whitening * (seen.z_in_camera - x.head<2>() / x.z());
}

std::optional<BundleFit> adjust(LampBundle& bundle, const Eigen::MatrixXd& free) {
  constexpr int max_iterations = 50;
  constexpr double small_step = 1e-10;  // metres and radians: far below any noise
  constexpr double rounding = 1e-12;    // of the sum of squares, near the minimum
  BundleFit fit{chi_squared(bundle), static_cast<int>(-free.cols()), 0, {}, {}, {}};
  if (!std::isfinite(fit.chi_squared)) return std::nullopt;
  for (const Capture& capture : bundle.captures) {
    fit.degrees_of_freedom += 2 * static_cast<int>(capture.seen.size()) - 4;
  }
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    SharedEquations shared{Eigen::MatrixXd::Zero(free.rows(), free.rows()),
                           Eigen::VectorXd::Zero(free.rows()), Eigen::VectorXd::Zero(free.rows())};
    std::vector<OwnEquations> own;
    own.reserve(bundle.captures.size());
    for (const Capture& capture : bundle.captures) {
      own.push_back(eliminate(bundle, capture, shared));
      if (own.back().own.info() != Eigen::Success) return std::nullopt;
    }
    const auto covariance = covariance_of(shared, free);
    if (!covariance) return std::nullopt;
    Step step{*covariance * shared.gradient, {}};
    step.own.reserve(own.size());
    for (std::size_t k = 0; k < own.size(); ++k) {
      const auto indices = shared_of(bundle.captures[k]);
      step.own.emplace_back(
          own[k].own.solve(own[k].own_gradient - own[k].mixed * step.shared(indices)));
    }
    for (;; step.halve()) {
      const double largest = step.largest();
      if (!std::isfinite(largest)) return std::nullopt;
      LampBundle next = moved(bundle, step);
      const double next_chi_squared = chi_squared(next);
      const bool helps = next_chi_squared <= fit.chi_squared * (1 + rounding);
      if (helps) {
        bundle = std::move(next);
        fit.chi_squared = next_chi_squared;
      }
      if (helps || largest <= small_step) {
        if (largest > small_step) break;
        fit.covariance = *covariance;
        set_map_effect(shared, fit);
        fit.redundancy = fit.degrees_of_freedom - told_of_motions(bundle, own);
        return fit;
      }
    }
  }
  return std::nullopt;
}

}  // namespace vlp
