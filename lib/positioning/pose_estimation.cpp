// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/pose_estimation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/angles.h"
#include "geometry/normal_equations.h"
#include "geometry/plane.h"

namespace vlp {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using BodyVector = Eigen::Matrix<double, kBodyStates, 1>;

/// Returns `v` rotated about z by minus the angle of the unit complex number.
Eigen::Vector3d rotate_back_by_heading(const Eigen::Vector2d& heading, const Eigen::Vector3d& v) {
  return {heading.x() * v.x() + heading.y() * v.y(), heading.x() * v.y() - heading.y() * v.x(),
          v.z()};
}
Eigen::Vector2d make_unit_heading(double angle_rad) {
  return {std::cos(angle_rad), std::sin(angle_rad)};
}

/// Returns z x v.
Eigen::Vector3d cross_z(const Eigen::Vector3d& v) { return {-v.y(), v.x(), 0}; }

/// Intermediate results of q: relative to R along the level axes of time 0, without u t; along the
/// level axes of time t; and q + arm.
struct LampTerms {
  Eigen::Vector3d still, turned_level, in_body;
  Eigen::Vector2d turn;
};

LampTerms compute_lamp_terms(const EvaluatedState& at, const Eigen::Vector3d& lamp_m,
                             double time_s) {
  const BodyMotion& motion = at.state.motion;
  LampTerms terms;
  terms.still = rotate_back_by_heading(at.heading, lamp_m - at.state.pose.position_m);
  Eigen::Vector3d level = terms.still;
  level.head<2>() -= motion.velocity_m_per_s * time_s;
  terms.turn = motion.yaw_rate_rad_per_s == 0
                   ? Eigen::Vector2d(1, 0)
                   : make_unit_heading(motion.yaw_rate_rad_per_s * time_s);
  terms.turned_level = rotate_back_by_heading(terms.turn, level);
  terms.in_body = at.body_from_level * terms.turned_level;
  return terms;
}

/// Derivative of q, a column for each state.
template <std::size_t count>
using Columns = std::array<Eigen::Vector3d, count>;

/// The estimated states; their number is a compile-time constant.
template <bool velocity, bool yaw_rate, bool lean>
struct States {
  static constexpr std::size_t kYawRate = velocity ? 6 : 4, kLean = kYawRate + (yaw_rate ? 1 : 0);
  static constexpr std::size_t kCount = kLean + (lean ? 2 : 0);

  static Columns<kCount> d_lamp_in_body_d_estimated_states(const EvaluatedState& at,
                                                           const LampTerms& terms, double time_s) {
    const auto& body_from_level = at.body_from_level;
    const Eigen::Vector2d back(terms.turn.x() * at.heading.x() - terms.turn.y() * at.heading.y(),
                               -terms.turn.x() * at.heading.y() - terms.turn.y() * at.heading.x());
    Columns<kCount> d;
    d[0] = body_from_level * Eigen::Vector3d(-back.x(), -back.y(), 0);
    d[1] = body_from_level * Eigen::Vector3d(back.y(), -back.x(), 0);
    d[2] = -body_from_level.col(2);
    d[3] = body_from_level * -cross_z(rotate_back_by_heading(terms.turn, terms.still));
    if constexpr (velocity) {
      const Eigen::Vector2d turn = time_s * terms.turn;
      d[4] = body_from_level * Eigen::Vector3d(-turn.x(), turn.y(), 0);
      d[5] = body_from_level * Eigen::Vector3d(-turn.y(), -turn.x(), 0);
    }
    if constexpr (yaw_rate) d[kYawRate] = body_from_level * (-time_s * cross_z(terms.turned_level));
    if constexpr (lean) {
      d[kLean] = Eigen::Vector3d(0, terms.in_body.z(), -terms.in_body.y());
      d[kLean + 1] = terms.in_body.cross(at.pitch_axis);
    }
    return d;
  }

  /// Index of each estimated state among all states.
  static constexpr std::array<int, kCount> estimated_state_indices() {
    std::array<int, kCount> all{0, 1, 2, 3};
    std::size_t next = 4;
    if (velocity) all[next++] = kBodyVelocity, all[next++] = kBodyVelocity + 1;
    if (yaw_rate) all[next++] = kBodyYawRate;
    if (lean) all[next++] = kBodyRoll, all[next++] = kBodyPitch;
    return all;
  }
};

BodyState apply_body_step(const BodyState& from, const BodyVector& step) {
  BodyState next = from;
  next.pose.position_m += step.head<3>();
  next.pose.yaw_rad += step[kBodyYaw];
  BodyMotion& motion = next.motion;
  motion.velocity_m_per_s += step.segment<2>(kBodyVelocity);
  motion.yaw_rate_rad_per_s += step[kBodyYawRate];
  motion.inclination.roll_rad += step[kBodyRoll];
  motion.inclination.pitch_rad += step[kBodyPitch];
  return next;
}

/// Returns the weights of the priors: 1 / sd of each state, zero for fixed states.
BodyVector compute_prior_weights(const BodyPrior& prior) {
  const auto inverse = [](double sd) { return sd > 0 ? 1 / sd : 0; };
  BodyVector weights = BodyVector::Zero();
  if (prior.height) weights[2] = inverse(prior.height->sd_m);
  weights[kBodyVelocity] = weights[kBodyVelocity + 1] = inverse(prior.velocity_sd_m_per_s);
  weights[kBodyYawRate] = inverse(prior.yaw_rate_sd_rad_per_s);
  weights[kBodyRoll] = weights[kBodyPitch] = inverse(prior.inclination_sd_rad);
  return weights;
}

/// Returns the prior residuals, (state - prior mean) / sd.
BodyVector compute_prior_residuals(const BodyState& state, const BodyPrior& prior,
                                   const BodyVector& weights) {
  const BodyMotion &motion = state.motion, &mean = prior.mean;
  BodyVector deviations = BodyVector::Zero();
  if (prior.height) deviations[2] = state.pose.position_m.z() - prior.height->z_m;
  deviations.segment<2>(kBodyVelocity) = motion.velocity_m_per_s - mean.velocity_m_per_s;
  deviations[kBodyYawRate] = motion.yaw_rate_rad_per_s - mean.yaw_rate_rad_per_s;
  deviations[kBodyRoll] = wrap_angle_rad(motion.inclination.roll_rad - mean.inclination.roll_rad);
  deviations[kBodyPitch] =
      wrap_angle_rad(motion.inclination.pitch_rad - mean.inclination.pitch_rad);
  return deviations.cwiseProduct(weights);
}

/// Residual of a lamp in standard deviations, and 1 / depth along its ray; not positive if the
/// lamp
/// is behind the ray.
struct LampResidual {
  Eigen::Vector2d value;
  double inverse_depth;
};

LampResidual compute_lamp_residual(const BodyObservation& sighting, const Eigen::Vector3d& q) {
  const double inverse_depth = 1 / sighting.ray.dot(q);
  return {-inverse_depth * (sighting.whitened_pixel_from_ray * q), inverse_depth};
}

/// Returns the derivative of the lamp's pixel by q.
Matrix23 d_pixel_d_lamp_in_body(const BodyObservation& sighting, const LampResidual& residual) {
  return residual.inverse_depth *
         (sighting.whitened_pixel_from_ray + residual.value * sighting.ray.transpose());
}

template <typename S>
struct Linearized : Normal<S::kCount> {
  double chi_squared = 0;
  /// Contributions of the pixels.
  double pixels_chi_squared = 0, sum_px2 = 0;
  bool lamps_ahead = true;

  Linearized(std::span<const BodyObservation> sightings, const Eigen::Vector3d& arm_m,
             const BodyPrior& prior, const BodyVector& weights, const EvaluatedState& at) {
    for (const BodyObservation& sighting : sightings) {
      const LampTerms terms = compute_lamp_terms(at, sighting.lamp_m, sighting.time_s);
      const LampResidual residual = compute_lamp_residual(sighting, terms.in_body - arm_m);
      if (!(residual.inverse_depth > 0)) {
        lamps_ahead = false;
        return;
      }
      const Matrix23 d_pixel_d_q = d_pixel_d_lamp_in_body(sighting, residual);
      const auto d_q = S::d_lamp_in_body_d_estimated_states(at, terms, sighting.time_s);
      for (const int axis : {0, 1}) {
        const Eigen::Vector3d d_axis = d_pixel_d_q.row(axis);
        std::array<double, S::kCount> row;
        for (std::size_t i = 0; i < S::kCount; ++i) row[i] = d_axis.dot(d_q[i]);
        this->add_residual_row(row, residual.value[axis]);
      }
      const double square = residual.value.squaredNorm();
      chi_squared += square;
      sum_px2 += sighting.sigma_px * sighting.sigma_px * square;
    }
    pixels_chi_squared = chi_squared;
    const BodyVector deviations = compute_prior_residuals(at.state, prior, weights);
    constexpr auto indices = S::estimated_state_indices();
    for (std::size_t i = 2; i < S::kCount; ++i) {
      const double weight = weights[indices[i]];
      this->information[i][i] += weight * weight;
      this->gradient[i] -= weight * deviations[indices[i]];
    }
    chi_squared += deviations.squaredNorm();
  }
};

/// Convergence tolerances of a step, relative to the distance, 1 rad, 1 m/s and 1 rad/s. After a
/// full step of this size the error is its square, or a thousandth of it with noise in the pixels:
/// below any noise. A halved step must meet the smaller tolerance.
bool is_step_negligible(const BodyVector& step, double scale_m, bool whole) {
  const double small_step = whole ? 1e-7 : 1e-10, small_rate = whole ? 1e-6 : 1e-8;
  return step.head<3>().norm() <= small_step * scale_m && std::abs(step[kBodyYaw]) <= small_step &&
         step.segment<3>(kBodyVelocity).cwiseAbs().maxCoeff() <= small_rate &&
         step.tail<2>().cwiseAbs().maxCoeff() <= small_step;
}

template <typename S>
BodyFix make_body_fix(const Linearized<S>& normal, const Cholesky<S::kCount>& factor,
                      const BodyVector& weights, const BodyState& state, double lamps) {
  BodyFix fix;
  fix.state = state;
  fix.state.pose.yaw_rad = wrap_angle_rad(state.pose.yaw_rad);
  fix.chi_squared = normal.chi_squared;
  fix.pixels_chi_squared = normal.pixels_chi_squared;
  fix.residual_px = std::sqrt(normal.sum_px2 / lamps);
  fix.redundancy = 2 * lamps - static_cast<double>(S::kCount);
  constexpr auto indices = S::estimated_state_indices();
  for (std::size_t i = 0; i < S::kCount; ++i) {
    const auto column = factor.compute_inverse_column(i);
    const double weight = weights[indices[i]];
    fix.redundancy += weight * weight * column[i];
    for (std::size_t k = 0; k < S::kCount; ++k) {
      fix.covariance(indices[k], indices[i]) = column[k];
    }
  }
  return fix;
}

template <typename S>
std::optional<BodyFix> solve(std::span<const BodyObservation> sightings,
                             const Eigen::Vector3d& arm_m, const BodyPrior& prior,
                             const BodyState& start) {
  constexpr int max_iterations = 50, max_halvings = 60;
  // Near the minimum the sum of squares changes by less than it can be computed.
  constexpr double rounding = 1e-12;
  constexpr auto indices = S::estimated_state_indices();
  const BodyVector weights = compute_prior_weights(prior);
  EvaluatedState at(start);
  Linearized<S> normal(sightings, arm_m, prior, weights, at);
  if (!normal.lamps_ahead) return std::nullopt;
  const double scale_m = (sightings.front().lamp_m - start.pose.position_m).norm();
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Cholesky<S::kCount> factor(normal);
    if (!factor.is_positive) return std::nullopt;
    const auto solution = factor.solve_normal_equations(normal.gradient);
    BodyVector step = BodyVector::Zero();
    for (std::size_t i = 0; i < S::kCount; ++i) step[indices[i]] = solution[i];
    if (!step.allFinite()) return std::nullopt;
    for (int halving = 0;; ++halving, step /= 2) {
      const BodyState next_state = apply_body_step(at.state, step);
      if (is_step_negligible(step, scale_m, halving == 0)) {
        const auto lamps = static_cast<double>(sightings.size());
        std::optional<BodyFix> fix = make_body_fix<S>(normal, factor, weights, next_state, lamps);
        if (!fix->covariance.allFinite()) fix.reset();
        return fix;
      }
      const EvaluatedState next(next_state);
      const Linearized<S> next_normal(sightings, arm_m, prior, weights, next);
      if (next_normal.lamps_ahead &&
          next_normal.chi_squared <= normal.chi_squared * (1 + rounding)) {
        at = next, normal = next_normal;
        break;
      }
      if (halving == max_halvings) return std::nullopt;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Matrix<double, 2, 3>> compute_whitened_pixel_jacobian_wrt_ray(
    const Eigen::Vector3d& ray, const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel, double sigma_px) {
  const double inverse_length = 1 / ray.norm();
  const Eigen::Vector3d unit_ray = inverse_length * ray;
  // Derivative of the unit ray, perpendicular to it.
  const Eigen::Matrix<double, 3, 2> across =
      inverse_length * (d_ray_d_pixel - unit_ray * (unit_ray.transpose() * d_ray_d_pixel));
  const Eigen::Matrix2d square = across.transpose() * across;
  const Matrix23 pixel_from_ray = square.inverse() * across.transpose();
  if (!pixel_from_ray.allFinite()) return std::nullopt;
  return pixel_from_ray / sigma_px;
}

EvaluatedState::EvaluatedState(const BodyState& at)
    : state(at), heading(make_unit_heading(at.pose.yaw_rad)) {
  const Eigen::Vector2d roll = make_unit_heading(at.motion.inclination.roll_rad);
  const Eigen::Vector2d pitch = make_unit_heading(at.motion.inclination.pitch_rad);
  const double cr = roll.x(), sr = roll.y(), cp = pitch.x(), sp = pitch.y();
  body_from_level << cp, 0, -sp, sr * sp, cr, sr * cp, cr * sp, -sr, cr * cp;
  pitch_axis = {0, cr, -sr};
}

Eigen::Vector3d EvaluatedState::lamp_position_in_body(const Eigen::Vector3d& lamp_m,
                                                      double time_s) const {
  return compute_lamp_terms(*this, lamp_m, time_s).in_body;
}

Eigen::Matrix<double, 3, kBodyStates> EvaluatedState::d_lamp_position_in_body_d_state(
    const Eigen::Vector3d& lamp_m, double time_s) const {
  const auto columns = States<true, true, true>::d_lamp_in_body_d_estimated_states(
      *this, compute_lamp_terms(*this, lamp_m, time_s), time_s);
  Eigen::Matrix<double, 3, kBodyStates> derivative;
  for (int i = 0; i < kBodyStates; ++i) derivative.col(i) = columns[static_cast<std::size_t>(i)];
  return derivative;
}

Matrix23 d_whitened_pixel_d_lamp_position(const BodyObservation& sighting,
                                          const Eigen::Vector3d& lamp_from_camera_m) {
  return d_pixel_d_lamp_in_body(sighting, compute_lamp_residual(sighting, lamp_from_camera_m));
}

std::optional<double> compute_body_state_chi_squared(std::span<const BodyObservation> sightings,
                                                     const Eigen::Vector3d& arm_in_body_m,
                                                     const BodyPrior& prior,
                                                     const BodyState& state) {
  const EvaluatedState at(state);
  double sum = compute_prior_residuals(state, prior, compute_prior_weights(prior)).squaredNorm();
  for (const BodyObservation& sighting : sightings) {
    const Eigen::Vector3d q =
        compute_lamp_terms(at, sighting.lamp_m, sighting.time_s).in_body - arm_in_body_m;
    const LampResidual residual = compute_lamp_residual(sighting, q);
    if (!(residual.inverse_depth > 0)) return std::nullopt;
    sum += residual.value.squaredNorm();
  }
  return sum;
}

std::optional<BodyFix> estimate_body_state(std::span<const BodyObservation> sightings,
                                           const Eigen::Vector3d& arm_in_body_m,
                                           const BodyPrior& prior, const BodyState& start) {
  using Solver = std::optional<BodyFix> (*)(
      std::span<const BodyObservation>, const Eigen::Vector3d&, const BodyPrior&, const BodyState&);
  static constexpr std::array<Solver, 8> solvers{
      solve<States<false, false, false>>, solve<States<true, false, false>>,
      solve<States<false, true, false>>,  solve<States<true, true, false>>,
      solve<States<false, false, true>>,  solve<States<true, false, true>>,
      solve<States<false, true, true>>,   solve<States<true, true, true>>};
  const int index = 1 * (prior.velocity_sd_m_per_s > 0) + 2 * (prior.yaw_rate_sd_rad_per_s > 0) +
                    4 * (prior.inclination_sd_rad > 0);
  return solvers[static_cast<std::size_t>(index)](sightings, arm_in_body_m, prior, start);
}

}  // namespace vlp
