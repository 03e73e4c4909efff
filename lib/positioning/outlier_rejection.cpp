// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/outlier_rejection.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "geometry/normal_equations.h"
#include "positioning/closed_form.h"
#include "positioning/residual_noise.h"

namespace vlp {

namespace {

/// Ratio of the reduced chi-squared of all lamps to that of a majority above which the others are
/// wrong, if the reported noise does not explain the residuals of all (kMaxReducedChiSquared). A
/// small error of the tilt or of the map affects all lamps and rarely has this pattern.
constexpr double kClearGain = 100;

using Agreeing = std::bitset<kMaxSightings>;

/// Returns the distance of a lamp from its observed ray at its height, in m; infinity if the lamp
/// is behind the ray or not above the camera.
double distance_from_ray(const LampObservation& seen, const BodyProblem& problem,
                         const EvaluatedState& body) {
  const Eigen::Vector3d q = body.lamp_position_in_body(seen.lamp_m, seen.time_s) - problem.arm_m;
  const Eigen::Vector3d up = body.body_from_level.col(2);
  const double height_m = up.dot(q), slope = up.dot(seen.ray);
  if (!(height_m > 0 && slope > 0)) return std::numeric_limits<double>::infinity();
  return (q - height_m / slope * seen.ray).norm();
}

/// Returns the largest accepted distance of a lamp from its ray, in m.
double compute_residual_limit(const FrameObservations& frame, double max_residual_fraction) {
  constexpr double max_neighbor_fraction = 0.15;
  const double n = static_cast<double>(frame.size);
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (const LampObservation& seen : frame.observations_span()) mean_m += seen.lamp_m / n;
  double sum_m2 = 0;
  for (const LampObservation& seen : frame.observations_span()) {
    sum_m2 += (seen.lamp_m - mean_m).squaredNorm();
  }
  const double nearest_m = *std::min_element(
      frame.nearest_m.begin(), frame.nearest_m.begin() + static_cast<std::ptrdiff_t>(frame.size));
  return std::min(max_residual_fraction * std::sqrt(sum_m2 / n), max_neighbor_fraction * nearest_m);
}

/// Returns true if each quantity with a prior is within five standard deviations of its mean, given
/// the quantities before it. The components of the position, of velocity, and of the inclination
/// count together.
bool is_within_prior(const BodyPrior& prior, const BodyState& state) {
  constexpr double max_sds = 5;
  constexpr std::array<std::size_t, kBodyStates> quantities{0, 0, 0, 1, 2, 2, 3, 4, 4};
  std::array<double, 5> squares{};
  const PriorTerms priors = compute_prior_terms(prior, EvaluatedState(state));
  for (const PriorTerm& term : priors.list()) {
    squares[quantities[static_cast<std::size_t>(term.state)]] += term.residual * term.residual;
  }
  return *std::max_element(squares.begin(), squares.end()) <= max_sds * max_sds;
}

/// Observations that agree with a state: those whose lamp is within `limit_m` of its ray.
struct Agreement {
  Agreeing agreeing;
  /// Sum of the squared distances of these lamps, m^2.
  double sum_m2 = 0;

  Agreement() = default;
  Agreement(const BodyState& state, const FrameObservations& frame, const BodyProblem& problem,
            double limit_m) {
    const EvaluatedState body(state);
    for (std::size_t i = 0; i < frame.size; ++i) {
      const double distance_m = distance_from_ray(frame.sightings[i], problem, body);
      if (!(distance_m <= limit_m)) continue;
      agreeing.set(i);
      sum_m2 += distance_m * distance_m;
    }
  }
  bool is_better_than(const Agreement& other) const {
    const std::size_t count = agreeing.count(), other_count = other.agreeing.count();
    return count > other_count || (count == other_count && sum_m2 < other.sum_m2);
  }
};

bool is_consistent(const BodySolution& solution, const FrameObservations& frame,
                   const BodyProblem& problem, double limit_m) {
  return has_fix(solution) && is_within_prior(problem.prior, solution.fix.state) &&
         Agreement(solution.fix.state, frame, problem, limit_m).agreeing.count() == frame.size;
}

FrameObservations select_lamps(const FrameObservations& frame, const Agreeing& agreeing) {
  FrameObservations remaining = frame;
  remaining.keep_observations(agreeing);
  return remaining;
}

/// Returns the frame with the mirror image of the map.
FrameObservations mirror_lamp_positions(FrameObservations frame) {
  for (std::size_t i = 0; i < frame.size; ++i) frame.sightings[i].lamp_m.y() *= -1;
  return frame;
}

/// Finds the largest set of lamps that agree with a state of unknown roll and pitch, at rest. Every
/// triple of lamps proposes its states.
Agreeing select_tilted_majority(const FrameObservations& frame, const BodyProblem& problem,
                                double limit_m) {
  constexpr std::size_t few = 12;
  const std::size_t n = frame.num_current, stride = n <= few ? 1 : n * n * n / (few * few * few);
  Agreement best;
  std::size_t turn = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (turn++ % stride != 0) continue;
        const InitialStates initial_states = solve_for_three_lamps(frame, {i, j, k}, problem);
        for (const BodyState& state : initial_states.list()) {
          const Agreement agreement(state, frame, problem, limit_m);
          if (agreement.is_better_than(best)) best = agreement;
        }
      }
    }
  }
  return best.agreeing;
}

/// Finds the largest set of lamps that agree with a state with the inclination of the prior, at
/// rest. Every pair of lamps proposes its states; of more than 64 lamps, a fixed selection of
/// pairs.
Agreeing select_level_majority(const FrameObservations& frame, const BodyProblem& problem,
                               double limit_m) {
  const Eigen::Matrix3d lean =
      level_rotation_from_inclination(problem.prior.mean.motion.inclination);
  const LevelSightings level(frame, lean);
  if (!level.are_lamps_above_horizon) return {};
  const std::size_t stride = 1 + level.size / 65;
  Agreement best;
  for (std::size_t i = 0; i < level.size; ++i) {
    for (std::size_t j = i + 1; j < level.size; j += stride) {
      const TwoLampPoses pair = solve_for_two_lamps(level.sightings[i], level.sightings[j]);
      for (std::size_t k = 0; static_cast<int>(k) < pair.count; ++k) {
        const Agreement agreement(make_body_state(pair.poses[k], problem, lean), frame, problem,
                                  limit_m);
        if (agreement.is_better_than(best)) best = agreement;
      }
    }
  }
  return best.agreeing;
}

/// Computes the fix of a majority of the lamps, and removes the others from the frame.
BodySolution estimate_majority(FrameObservations& frame, const BodyProblem& problem,
                               double max_residual_fraction) {
  const BodySolution none{FixStatus::inconsistent};
  const double limit_m = compute_residual_limit(frame, max_residual_fraction);
  double latest_s = 0;
  for (const LampObservation& seen : frame.observations_span()) {
    latest_s = std::max(latest_s, std::abs(seen.time_s));
  }
  const double driven_m = 2 * std::sqrt(problem.prior.max_variance(kBodyVelocity, 2)) * latest_s;
  const bool is_tilt_unknown = is_roll_pitch_unknown(problem.prior);
  const std::size_t min_lamps = is_tilt_unknown ? 4 : 3;  // one more than propose a state
  Agreeing agreeing = is_tilt_unknown ? select_tilted_majority(frame, problem, limit_m + driven_m)
                                      : select_level_majority(frame, problem, limit_m + driven_m);
  // The majority ignored motion: with estimated motion, rejected lamps may agree.
  constexpr int max_iterations = 3;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (agreeing.count() < min_lamps || 2 * agreeing.count() <= frame.size) return none;
    const FrameObservations remaining = select_lamps(frame, agreeing);
    if (remaining.num_current < 2) return none;
    const BodySolution solution = estimate_pose_from_all_lamps(remaining, problem);
    if (solution.status != FixStatus::ok) return solution;
    const Agreeing now_agreeing = Agreement(solution.fix.state, frame, problem, limit_m).agreeing;
    if (now_agreeing == agreeing) {
      if (!is_within_prior(problem.prior, solution.fix.state)) return none;
      frame = remaining;
      return solution;
    }
    agreeing = now_agreeing;
  }
  return none;
}

}  // namespace

BodySolution estimate_pose_robustly(FrameObservations& frame, const BodyProblem& problem,
                                    double max_residual_fraction) {
  const BodySolution all = estimate_pose_from_all_lamps(frame, problem);
  if (frame.size < 3) {
    const bool is_contradicted =
        all.status == FixStatus::ok && !is_within_prior(problem.prior, all.fix.state);
    return is_contradicted ? BodySolution{FixStatus::inconsistent} : all;
  }
  const double limit_m = compute_residual_limit(frame, max_residual_fraction);
  const bool is_all_consistent = is_consistent(all, frame, problem, limit_m);
  const double excess = compute_reduced_chi_squared(all.fix.chi_squared, frame.size);
  if (is_all_consistent && (all.status != FixStatus::ok || excess <= kMaxReducedChiSquared))
    return all;
  const FrameObservations mirror_frame = mirror_lamp_positions(frame);
  const BodySolution mirror_image = estimate_pose_from_all_lamps(mirror_frame, problem);
  const bool is_mirrored =
      mirror_image.status == FixStatus::ok &&
      is_consistent(mirror_image, mirror_frame, problem, limit_m) &&
      (!is_all_consistent ||
       kClearGain * compute_reduced_chi_squared(mirror_image.fix.chi_squared, frame.size) < excess);
  if (is_mirrored) return {FixStatus::mirrored_map};
  // Constant velocity and yaw rate do not explain the earlier frames.
  if (is_all_consistent && frame.num_current < frame.size) return {FixStatus::inconsistent};
  if (is_all_consistent) return all;
  if (frame.size < 4) return has_fix(all) ? BodySolution{FixStatus::inconsistent} : all;
  const BodySolution majority = estimate_majority(frame, problem, max_residual_fraction);
  if (majority.status == FixStatus::inconsistent && !has_fix(all)) return all;
  return majority;
}

namespace {

/// Observations linearized at a fix, in standard deviations of all errors together.
class LinearizedFrame {
 public:
  /// Effect of the removal of a lamp.
  struct Removal {
    std::size_t lamp = 0;
    double chi_squared_reduction = 0;
  };
  /// Chi-squared of the residuals and its expectation; removals with the two largest effects.
  struct Residuals {
    double chi_squared = 0, redundancy = 0;
    Removal best = {}, second = {};
  };

  LinearizedFrame(std::span<const LampObservation> sightings, std::span<const Matrix2> common,
                  const BodyProblem& problem, const BodyFix& fix)
      : size_(sightings.size()),
        priors_(compute_prior_terms(problem.prior, EvaluatedState(fix.state))),
        is_fixed_(fix.covariance.diagonal().array() <= 0) {
    const EvaluatedState body(fix.state);
    for (std::size_t i = 0; i < size_; ++i) {
      LinearizedObservation seen = linearize_observation(sightings[i], body, problem.arm_m);
      for (int state = 0; state < kBodyStates; ++state) {
        if (is_fixed_[state]) seen.jacobian.col(state).setZero();
      }
      const Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() + common[i];
      const Eigen::Matrix2d root = covariance.llt().matrixL();
      const Eigen::Matrix2d whitening = root.inverse();
      observations_[i] = {whitening * seen.residual, whitening * seen.jacobian};
    }
  }

  /// Solves for the state without the rejected lamps. Returns std::nullopt if the others do not
  /// determine it.
  std::optional<Residuals> compute_residuals(const OutlierLamps& rejected) const {
    const Normal<kBodyStates> normal = make_normal_equations(rejected);
    const Cholesky<kBodyStates> factor(normal);
    if (!factor.is_positive) return std::nullopt;
    const BodyVector step = solve(factor, normal.gradient);
    Residuals found;
    for (std::size_t i = 0; i < size_; ++i) {
      if (rejected[i]) continue;
      const auto& [residual, jacobian] = observations_[i];
      const Eigen::Vector2d r = residual - jacobian * step;
      Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity();
      for (const int axis : {0, 1}) {
        std::array<double, kBodyStates> row;
        BodyVector::Map(row.data()) = jacobian.row(axis);
        covariance.col(axis) -= jacobian * solve(factor, row);
      }
      found.chi_squared += r.squaredNorm();
      found.redundancy += covariance.trace();
      if (!(covariance.determinant() > 0)) continue;
      const Removal removal{i, r.dot(covariance.inverse() * r)};
      if (removal.chi_squared_reduction > found.best.chi_squared_reduction) {
        found.second = std::exchange(found.best, removal);
      } else if (removal.chi_squared_reduction > found.second.chi_squared_reduction) {
        found.second = removal;
      }
    }
    return found;
  }

 private:
  using BodyVector = Eigen::Matrix<double, kBodyStates, 1>;

  static BodyVector solve(const Cholesky<kBodyStates>& factor,
                          const std::array<double, kBodyStates>& right) {
    const auto solution = factor.solve_system(right);
    return BodyVector::Map(solution.data());
  }

  Normal<kBodyStates> make_normal_equations(const OutlierLamps& rejected) const {
    Normal<kBodyStates> normal;
    for (std::size_t i = 0; i < size_; ++i) {
      for (const int axis : {0, 1}) {
        if (rejected[i]) continue;
        const BodyVector row = observations_[i].jacobian.row(axis);
        normal.add_residual_row(row, observations_[i].residual[axis]);
      }
    }
    for (const PriorTerm& prior : priors_.list()) {
      const BodyVector row = is_fixed_.select(0, prior.row.array());
      normal.add_residual_row(row, prior.residual);
    }
    for (std::size_t i = 0; i < kBodyStates; ++i) {
      if (is_fixed_[static_cast<int>(i)]) normal.information[i][i] = 1;
    }
    return normal;
  }

  std::size_t size_;
  PriorTerms priors_;
  Eigen::Array<bool, kBodyStates, 1> is_fixed_;
  std::array<LinearizedObservation, kMaxSightings> observations_;
};

}  // namespace

OutlierLamps flag_outlier_lamps(std::span<const LampObservation> sightings,
                                std::span<const Matrix2> common, const BodyProblem& problem,
                                const BodyFix& fix, bool are_all_errors_known) {
  constexpr double min_redundancy = 1.5;  // two, less the information of the priors
  constexpr double max_remaining_ratio = 9;
  const auto is_contradiction = [&](double chi_squared, double redundancy) {
    const double limit = are_all_errors_known ? compute_chi_squared_limit(redundancy)
                                              : kMaxReducedChiSquared * redundancy;
    return chi_squared > limit;
  };
  const LinearizedFrame frame(sightings, common, problem, fix);
  OutlierLamps found;
  double initial_ratio = 0;
  for (std::size_t num_left = sightings.size();; --num_left) {
    const auto residuals = frame.compute_residuals(found);
    if (!residuals) return {};
    const auto& [chi_squared, redundancy, best, second] = *residuals;
    if (found.none()) initial_ratio = chi_squared / redundancy;
    if (!is_contradiction(chi_squared, redundancy)) {
      const bool is_clear =
          are_all_errors_known || (chi_squared < max_remaining_ratio * redundancy &&
                                   kClearGain * chi_squared < initial_ratio * redundancy);
      return is_clear ? found : OutlierLamps();
    }
    const bool is_unique =
        are_all_errors_known ||
        is_contradiction(chi_squared - second.chi_squared_reduction, redundancy - 2);
    // Fewer lamps, or a minority, do not determine which lamp is wrong.
    if (!(best.chi_squared_reduction > 0) || !is_unique || redundancy - 2 < min_redundancy ||
        2 * (num_left - 1) <= sightings.size()) {
      return {};
    }
    found.set(best.lamp);
  }
}

BodySolution reject_outlier_lamps(FrameObservations& frame, const OutlierLamps& outliers,
                                  const BodyProblem& problem, const BodySolution& all) {
  if (outliers.none()) return all;
  FrameObservations remaining = select_lamps(frame, ~outliers);
  const auto fix = estimate_body_state(remaining.observations_span(), problem, all.fix.state);
  if (!fix || !is_within_prior(problem.prior, fix->state) ||
      !is_position_determined(remaining, problem.prior, *fix)) {
    return all;
  }
  frame = remaining;
  return {FixStatus::ok, *fix};
}

}  // namespace vlp
