// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/pose_estimation.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

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

/// The estimated states; their number is a compile-time constant.
template <bool velocity, bool yaw_rate, bool lean>
struct States {
  static constexpr std::size_t kYawRate = velocity ? 6 : 4, kLean = kYawRate + (yaw_rate ? 1 : 0);
  static constexpr std::size_t kCount = kLean + (lean ? 2 : 0);

  /// Returns the derivatives of a function of q with respect to the estimated states. `d_q` are its
  /// derivatives with respect to q, `d_level` those with respect to L q.
  static std::array<double, kCount> make_row(const EvaluatedState& at, const LampTerms& terms,
                                             double time_s, const Eigen::Vector3d& d_q,
                                             const Eigen::Vector3d& d_level) {
    const double x = d_level.x(), y = d_level.y();
    const Eigen::Vector2d& turn = terms.turn;
    const Eigen::Vector2d yaw = complex_product(turn, at.heading);
    const Eigen::Vector2d still = conjugate_product(turn, terms.still.head<2>());
    std::array<double, kCount> row;
    row[0] = yaw.y() * y - yaw.x() * x;
    row[1] = -yaw.y() * x - yaw.x() * y;
    row[2] = -d_level.z();
    row[3] = still.y() * x - still.x() * y;
    if constexpr (velocity) {
      row[4] = time_s * (turn.y() * y - turn.x() * x);
      row[5] = -time_s * (turn.y() * x + turn.x() * y);
    }
    if constexpr (yaw_rate)
      row[kYawRate] = time_s * (terms.turned_level.y() * x - terms.turned_level.x() * y);
    if constexpr (lean) {
      const Eigen::Vector3d& in_body = terms.in_body;
      row[kLean] = in_body.z() * d_q.y() - in_body.y() * d_q.z();
      row[kLean + 1] = in_body.cross(at.pitch_axis).dot(d_q);
    }
    return row;
  }

  /// Index of each estimated state among all states.
  static constexpr std::array<int, kCount> estimated_indices() {
    std::array<int, kCount> all{0, 1, 2, 3};
    std::size_t next = 4;
    if (velocity) all[next++] = kBodyVelocity, all[next++] = kBodyVelocity + 1;
    if (yaw_rate) all[next++] = kBodyYawRate;
    if (lean) all[next++] = kBodyRoll, all[next++] = kBodyPitch;
    return all;
  }
  /// Position of each state among the estimated ones; 0 if it is not estimated.
  static constexpr std::array<std::size_t, kBodyStates> state_positions() {
    std::array<std::size_t, kBodyStates> all{};
    constexpr auto indices = estimated_indices();
    for (std::size_t i = 0; i < kCount; ++i) all[static_cast<std::size_t>(indices[i])] = i;
    return all;
  }
  /// Returns the derivatives of a prior with respect to the estimated states.
  static std::array<double, kCount> make_prior_row(const PriorTerm& prior) {
    constexpr auto indices = estimated_indices();
    std::array<double, kCount> row;
    for (std::size_t i = 0; i < kCount; ++i) row[i] = prior.row[indices[i]];
    return row;
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

/// Residual of a lamp in standard deviations, and 1 / depth; not positive if the lamp
/// is behind the ray.
struct LampResidual {
  Eigen::Vector2d value;
  double inverse_depth;
};

LampResidual compute_lamp_residual(const LampObservation& sighting, const Eigen::Vector3d& q) {
  const double inverse_depth = 1 / sighting.depth_axis.dot(q);
  return {-inverse_depth * (sighting.whitened_pixel_from_ray * q), inverse_depth};
}

/// Returns the derivative of the lamp's pixel by q.
Matrix23 d_pixel_d_lamp(const LampObservation& sighting, const LampResidual& residual) {
  return residual.inverse_depth *
         (sighting.whitened_pixel_from_ray + residual.value * sighting.depth_axis.transpose());
}

template <typename S>
struct Linearized : Normal<S::kCount> {
  double chi_squared = 0;
  /// Contributions of the pixels.
  double pixels_chi_squared = 0, sum_px2 = 0;
  bool lamps_ahead = true;

  Linearized(std::span<const LampObservation> sightings, const BodyProblem& problem,
             const EvaluatedState& at) {
    for (const LampObservation& sighting : sightings) {
      const LampTerms terms = compute_lamp_terms(at, sighting.lamp_m, sighting.time_s);
      const LampResidual residual = compute_lamp_residual(sighting, terms.in_body - problem.arm_m);
      if (!(residual.inverse_depth > 0)) {
        lamps_ahead = false;
        return;
      }
      const Matrix23 d_pixel_d_q = d_pixel_d_lamp(sighting, residual);
      const Matrix23 d_pixel_d_level = d_pixel_d_q.lazyProduct(at.body_from_level);
      for (const int axis : {0, 1}) {
        const auto row = S::make_row(at, terms, sighting.time_s, d_pixel_d_q.row(axis),
                                     d_pixel_d_level.row(axis));
        this->add_residual_row(row, residual.value[axis]);
      }
      const double square = residual.value.squaredNorm();
      chi_squared += square;
      sum_px2 += sighting.sigma_px * sighting.sigma_px * square;
    }
    pixels_chi_squared = chi_squared;
    constexpr auto positions = S::state_positions();
    const PriorTerms priors = compute_prior_terms(problem.prior, at);
    for (const PriorTerm& prior : priors.list()) {
      if (prior.is_diagonal) {
        const std::size_t i = positions[static_cast<std::size_t>(prior.state)];
        const double weight = prior.row[prior.state];
        this->information[i][i] += weight * weight;
        this->gradient[i] += weight * prior.residual;
      } else {
        this->add_residual_row(S::make_prior_row(prior), prior.residual);
      }
      chi_squared += prior.residual * prior.residual;
    }
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
                      const BodyPrior& prior, const BodyState& state, double lamps) {
  BodyFix fix;
  fix.state = state;
  fix.state.pose.yaw_rad = wrap_angle_rad(state.pose.yaw_rad);
  fix.chi_squared = normal.chi_squared;
  fix.pixels_chi_squared = normal.pixels_chi_squared;
  fix.residual_px = std::sqrt(normal.sum_px2 / lamps);
  fix.redundancy = 2 * lamps - static_cast<double>(S::kCount);
  constexpr auto indices = S::estimated_indices();
  for (std::size_t i = 0; i < S::kCount; ++i) {
    const auto column = factor.compute_inverse_column(i);
    for (std::size_t k = 0; k < S::kCount; ++k) {
      fix.covariance(indices[k], indices[i]) = column[k];
    }
  }
  const PriorTerms priors = compute_prior_terms(prior, EvaluatedState(state));
  for (const PriorTerm& term : priors.list()) {
    const auto row = S::make_prior_row(term);
    const auto gain = factor.solve_system(row);
    fix.redundancy += std::inner_product(row.begin(), row.end(), gain.begin(), 0.0);
  }
  return fix;
}

template <typename S>
std::optional<BodyFix> solve(std::span<const LampObservation> sightings, const BodyProblem& problem,
                             const BodyState& start) {
  constexpr int max_iterations = 50, max_halvings = 60;
  // Near the minimum the sum of squares changes by less than it can be computed.
  constexpr double rounding = 1e-12;
  constexpr auto indices = S::estimated_indices();
  EvaluatedState at(start);
  Linearized<S> normal(sightings, problem, at);
  if (!normal.lamps_ahead) return std::nullopt;
  const double scale_m = (sightings.front().lamp_m - start.pose.position_m).norm();
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const Cholesky<S::kCount> factor(normal);
    if (!factor.is_positive) return std::nullopt;
    const auto solution = factor.solve_system(normal.gradient);
    BodyVector step = BodyVector::Zero();
    for (std::size_t i = 0; i < S::kCount; ++i) step[indices[i]] = solution[i];
    if (!step.allFinite()) return std::nullopt;
    for (int halving = 0;; ++halving, step /= 2) {
      const BodyState next_state = apply_body_step(at.state, step);
      if (is_step_negligible(step, scale_m, halving == 0)) {
        const auto lamps = static_cast<double>(sightings.size());
        std::optional<BodyFix> fix =
            make_body_fix<S>(normal, factor, problem.prior, next_state, lamps);
        if (!std::isfinite(fix->covariance.sum())) fix.reset();
        return fix;
      }
      const EvaluatedState next(next_state);
      const Linearized<S> next_normal(sightings, problem, next);
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

std::optional<Eigen::Matrix<double, 2, 3>> whiten_ray_jacobian(
    const Eigen::Vector3d& ray, const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel, double sigma_px) {
  // M is the inverse of (d_ray_d_pixel, ray), without the last row, for a ray of unit length.
  const Eigen::Vector3d across_u = d_ray_d_pixel.col(1).cross(ray);
  const Eigen::Vector3d across_v = ray.cross(d_ray_d_pixel.col(0));
  const double scale = ray.norm() / (sigma_px * d_ray_d_pixel.col(0).dot(across_u));
  if (!std::isfinite(scale)) return std::nullopt;
  Matrix23 whitened;
  whitened << scale * across_u.transpose(), scale * across_v.transpose();
  return whitened;
}

LampObservation make_level_observation(const Eigen::Vector3d& lamp_m, const Eigen::Vector2d& z,
                                       const Eigen::Matrix2d& d_pixel_d_z, double sigma_px) {
  Matrix23 whitened;
  whitened << d_pixel_d_z, -d_pixel_d_z * z;
  LampObservation seen(lamp_m, z.homogeneous().normalized(), whitened / sigma_px, sigma_px, 0);
  seen.depth_axis = Eigen::Vector3d::UnitZ();
  return seen;
}

EvaluatedState::EvaluatedState(const BodyState& at)
    : state(at), heading(make_unit_heading(at.pose.yaw_rad)) {
  if (at.motion.inclination.roll_rad == 0 && at.motion.inclination.pitch_rad == 0) {
    body_from_level.setIdentity();
    pitch_axis = Eigen::Vector3d::UnitY();
    return;
  }
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

LinearizedLampPosition linearize_lamp_position(const Eigen::Vector3d& lamp_m, double time_s,
                                               const EvaluatedState& body,
                                               const Eigen::Vector3d& arm_m) {
  const LampTerms terms = compute_lamp_terms(body, lamp_m, time_s);
  LinearizedLampPosition lamp{terms.in_body - arm_m, {}, {}};
  for (int axis = 0; axis < 3; ++axis) {
    const auto row = States<true, true, true>::make_row(body, terms, 1, Eigen::Vector3d::Unit(axis),
                                                        body.body_from_level.row(axis));
    lamp.jacobian.row(axis) = Eigen::Map<const BodyVector>(row.data());
  }
  // Derivatives with respect to u t and w t.
  auto by_motion = lamp.jacobian.middleCols<3>(kBodyVelocity);
  const BodyMotion& motion = body.state.motion;
  lamp.velocity_m_per_s = by_motion.leftCols<2>() * motion.velocity_m_per_s +
                          by_motion.col(2) * motion.yaw_rate_rad_per_s;
  by_motion *= time_s;
  return lamp;
}

LinearizedObservation linearize_observation(const LampObservation& sighting,
                                            const EvaluatedState& body,
                                            const Eigen::Vector3d& arm_m) {
  const auto lamp = linearize_lamp_position(sighting.lamp_m, sighting.time_s, body, arm_m);
  const LampResidual residual = compute_lamp_residual(sighting, lamp.q);
  return {residual.value, d_pixel_d_lamp(sighting, residual).lazyProduct(lamp.jacobian)};
}

Eigen::Matrix<double, kBodyStates, 1> subtract_states(const BodyState& to, const BodyState& from) {
  const BodyMotion &a = to.motion, &b = from.motion;
  BodyVector difference;
  difference << to.pose.position_m - from.pose.position_m,
      wrap_angle_rad(to.pose.yaw_rad - from.pose.yaw_rad), a.velocity_m_per_s - b.velocity_m_per_s,
      a.yaw_rate_rad_per_s - b.yaw_rate_rad_per_s,
      wrap_angle_rad(a.inclination.roll_rad - b.inclination.roll_rad),
      wrap_angle_rad(a.inclination.pitch_rad - b.inclination.pitch_rad);
  return difference;
}

PriorTerms compute_prior_terms(const BodyPrior& prior, const EvaluatedState& body) {
  constexpr double min_variance = 1e-18;
  const std::array<bool, 3> is_free{prior.is_velocity_estimated(), prior.is_yaw_rate_estimated(),
                                    prior.is_tilt_estimated()};
  constexpr std::array<std::size_t, kBodyStates> quantity{0, 0, 0, 0, 0, 0, 1, 2, 2};
  PriorTerms priors;
  std::array<std::array<double, kBodyStates>, kBodyStates> lower;
  BodyVector difference;
  for (int state = 0; state < kBodyStates; ++state) {
    const double variance = prior.covariance(state, state);
    const bool is_fixed =
        state >= kBodyVelocity && !is_free[quantity[static_cast<std::size_t>(state)]];
    if (is_fixed || std::isinf(variance)) continue;
    if (priors.size == 0) difference = subtract_states(prior.mean, body.state);
    PriorTerm& term = priors.terms[priors.size];
    term = {state, true, difference[state], BodyVector::Unit(state)};
    if (state == kBodyZ && !prior.height_point_m.isZero(0)) {
      const Eigen::Matrix3d body_from_level = body.body_from_level;
      const Eigen::Vector3d& point_m = prior.height_point_m;
      term.residual -= body_from_level.col(2).dot(point_m);
      term.row[kBodyRoll] =
          point_m.y() * body_from_level(2, 2) - point_m.z() * body_from_level(1, 2);
      term.row[kBodyPitch] = -body_from_level.col(0).dot(point_m);
      term.is_diagonal = false;
    }
    double remaining = std::max(variance, min_variance);
    auto& factor = lower[priors.size];
    for (std::size_t k = 0; k < priors.size; ++k) {
      const PriorTerm& before = priors.terms[k];
      double covariance = variance > 0 ? prior.covariance(state, before.state) : 0;
      for (std::size_t m = 0; m < k; ++m) covariance -= factor[m] * lower[k][m];
      factor[k] = covariance / lower[k][k];
      if (factor[k] == 0) continue;
      remaining -= factor[k] * factor[k];
      term.residual -= factor[k] * before.residual;
      term.row -= factor[k] * before.row;
      term.is_diagonal = false;
    }
    factor[priors.size] = std::sqrt(remaining);
    const double inverse = 1 / factor[priors.size];
    term.residual *= inverse;
    if (term.is_diagonal) {
      term.row[state] = inverse;
    } else {
      term.row *= inverse;
    }
    ++priors.size;
  }
  return priors;
}

std::optional<double> compute_chi_squared(std::span<const LampObservation> sightings,
                                          const BodyProblem& problem, const BodyState& state) {
  const EvaluatedState at(state);
  double sum = 0;
  const PriorTerms priors = compute_prior_terms(problem.prior, at);
  for (const PriorTerm& prior : priors.list()) {
    sum += prior.residual * prior.residual;
  }
  for (const LampObservation& sighting : sightings) {
    const Eigen::Vector3d q =
        at.lamp_position_in_body(sighting.lamp_m, sighting.time_s) - problem.arm_m;
    const LampResidual residual = compute_lamp_residual(sighting, q);
    if (!(residual.inverse_depth > 0)) return std::nullopt;
    sum += residual.value.squaredNorm();
  }
  return sum;
}

std::optional<BodyFix> estimate_body_state(std::span<const LampObservation> sightings,
                                           const BodyProblem& problem, const BodyState& start) {
  using Solver = std::optional<BodyFix> (*)(std::span<const LampObservation>, const BodyProblem&,
                                            const BodyState&);
  static constexpr std::array<Solver, 8> solvers{
      solve<States<false, false, false>>, solve<States<true, false, false>>,
      solve<States<false, true, false>>,  solve<States<true, true, false>>,
      solve<States<false, false, true>>,  solve<States<true, false, true>>,
      solve<States<false, true, true>>,   solve<States<true, true, true>>};
  const BodyPrior& prior = problem.prior;
  const int index = 1 * prior.is_velocity_estimated() + 2 * prior.is_yaw_rate_estimated() +
                    4 * prior.is_tilt_estimated();
  return solvers[static_cast<std::size_t>(index)](sightings, problem, start);
}

void convert_to_image_noise(const FrameObservations& frame, const BodyProblem& problem,
                            BodyFix& fix) {
  using Matrix = Eigen::Matrix<double, kBodyStates, kBodyStates>;
  const EvaluatedState body(fix.state);
  Matrix by_weights = Matrix::Zero(), by_noise = Matrix::Zero();
  double expected_squares = 0;
  for (std::size_t i = 0; i < frame.size; ++i) {
    const auto jacobian = linearize_observation(frame.sightings[i], body, problem.arm_m).jacobian;
    by_weights += jacobian.transpose().lazyProduct(jacobian);
    by_noise += jacobian.transpose().lazyProduct(frame.noise[i].lazyProduct(jacobian));
    expected_squares += frame.noise[i].trace();
  }
  const Matrix old = fix.covariance;
  fix.covariance += old.lazyProduct((by_noise - by_weights).lazyProduct(old).eval());
  fix.redundancy = expected_squares - 2 * old.cwiseProduct(by_noise).sum() +
                   by_weights.cwiseProduct(fix.covariance).sum();
}

}  // namespace vlp
