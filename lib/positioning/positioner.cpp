// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/positioner.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "camera/lens.h"
#include "geometry/angles.h"
#include "geometry/plane.h"
#include "positioning/correlated_errors.h"
#include "positioning/lamps_below.h"
#include "positioning/outlier_rejection.h"
#include "positioning/pose_observations.h"
#include "positioning/residual_noise.h"
#include "positioning/row_clock.h"

namespace vlp {
namespace {

/// Redundancies below are rounding errors of zero.
constexpr double kMinRedundancy = 1e-6;

void check_lamp_positions(const std::vector<Lamp>& lamps) {
  std::map<std::array<double, 3>, int> id_by_position;
  for (const Lamp& lamp : lamps) {
    const Eigen::Vector3d& at = lamp.position_m;
    const std::string name = "lamp " + std::to_string(lamp.id);
    if (!at.allFinite()) throw std::invalid_argument(name + " has a position that is not finite");
    const auto [other, is_free] = id_by_position.try_emplace({at.x(), at.y(), at.z()}, lamp.id);
    if (!is_free) {
      throw std::invalid_argument(name + " is where lamp " + std::to_string(other->second) + " is");
    }
  }
}

std::vector<Lamp> sorted_by_id(std::vector<Lamp> lamps) {
  if (lamps.empty()) throw std::invalid_argument("the lamp map is empty");
  check_lamp_positions(lamps);
  std::ranges::sort(lamps, {}, &Lamp::id);
  for (std::size_t i = 1; i < lamps.size(); ++i) {
    if (lamps[i].id == lamps[i - 1].id) {
      throw std::invalid_argument("lamp " + std::to_string(lamps[i].id) + " occurs twice");
    }
  }
  return lamps;
}

bool is_valid_sd(double value) { return std::isfinite(value) && value >= 0; }

/// Returns true if covariances of states with a finite variance are equal on both sides of the
/// diagonal.
bool is_symmetric(const BodyCovariance& covariance) {
  constexpr double tolerance = 1e-9;
  for (Eigen::Index i = 0; i < kBodyStates; ++i) {
    for (Eigen::Index k = 0; k < i; ++k) {
      const double scale = std::sqrt(covariance(i, i) * covariance(k, k));
      if (std::isfinite(scale) &&
          !(std::abs(covariance(i, k) - covariance(k, i)) <= tolerance * scale))
        return false;
    }
  }
  return true;
}

/// Returns true if the covariance of a given prior is symmetric and positive definite.
bool is_covariance_valid(const BodyPrior& prior) {
  const PriorTerms terms = compute_prior_terms(prior, EvaluatedState(BodyState()));
  return is_symmetric(prior.covariance) &&
         std::ranges::all_of(terms.list(),
                             [](const PriorTerm& term) { return term.row.allFinite(); });
}

/// Returns true if the mean is finite, and the variances not negative.
bool is_valid_prior(const BodyPrior& prior) {
  const auto variances = prior.covariance.diagonal().array();
  return (variances >= 0).all() && variances.tail<5>().isFinite().all() &&
         subtract_states(prior.mean, {}).allFinite();
}

bool are_values_valid(const Sensors& sensors) {
  const auto& known = sensors.height_and_yaw;
  const auto& height = sensors.height;
  const auto& motion = sensors.motion;
  const bool are_there_readings =
      sensors.inclination || sensors.inclination_sigma_rad != 0 || motion || height || known;
  return is_valid_sd(sensors.inclination_sigma_rad) &&
         (!motion || (is_valid_sd(motion->velocity_sd_m_per_s) &&
                      is_valid_sd(motion->yaw_rate_sd_rad_per_s))) &&
         (!height || (is_valid_sd(height->sd_m) && height->sd_m > 0)) &&
         (!known || (std::isfinite(known->z_m) && std::isfinite(known->yaw_rad) &&
                     is_valid_sd(known->z_sd_m) && is_valid_sd(known->yaw_sd_rad))) &&
         !(sensors.prior && are_there_readings);
}

/// Returns true if all frames are earlier than the current one, and no two of them simultaneous.
bool are_times_valid(std::span<const EarlierFrame> frames) {
  return std::all_of(frames.begin(), frames.end(), [&](const EarlierFrame& frame) {
    return std::isfinite(frame.before_s) && frame.before_s > 0 &&
           std::ranges::count(frames, frame.before_s, &EarlierFrame::before_s) == 1;
  });
}

/// Returns the mean position of the lamps, relative to which national coordinates lose no digits.
Eigen::Vector3d get_lamp_center(const std::vector<Lamp>& lamps) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) sum += lamp.position_m - lamps.front().position_m;
  return lamps.front().position_m + sum / static_cast<double>(lamps.size());
}

/// Returns the horizontal distance of each lamp to the nearest other one; infinity if there is
/// none.
std::vector<double> list_nearest_distances(const std::vector<Lamp>& lamps) {
  std::vector<double> nearest_m(lamps.size(), std::numeric_limits<double>::infinity());
  std::vector<std::pair<Eigen::Vector2d, std::size_t>> sorted;
  sorted.reserve(lamps.size());
  for (const Lamp& lamp : lamps) sorted.emplace_back(lamp.position_m.head<2>(), sorted.size());
  std::ranges::sort(sorted, {}, [](const auto& lamp) { return lamp.first.x(); });
  for (auto lamp = sorted.begin(); lamp != sorted.end(); ++lamp) {
    double& distance_m = nearest_m[lamp->second];
    const auto improve = [&](const auto& other) {
      distance_m = std::min(distance_m, (other.first - lamp->first).norm());
      return std::abs(other.first.x() - lamp->first.x()) < distance_m;
    };
    for (auto after = lamp + 1; after != sorted.end() && improve(*after);) ++after;
    for (auto before = lamp; before != sorted.begin() && improve(*std::prev(before));) --before;
  }
  return nearest_m;
}

/// Returns the covariance of x and y, m^2, from second-order effects of the errors of yaw and
/// height on a fix of one lamp. With the horizontal positions d of the lamp from the body and c
/// from the camera, and H its height above the camera, the effects are d yaw^2 / 2 and J c / H yaw
/// height. J is a quarter turn.
Matrix2 expand_to_second_order(const LampObservation& seen, const BodyProblem& problem,
                               const BodyFix& fix) {
  const EvaluatedState body(fix.state);
  const Eigen::Vector3d arm_m = body.body_from_level.transpose() * problem.arm_m;
  const Eigen::Vector3d from_body_m = seen.lamp_m - fix.state.pose.position_m;
  const Eigen::Vector2d d = from_body_m.head<2>();
  const Eigen::Vector2d c = d - complex_product(body.heading, arm_m.head<2>());
  const Eigen::Vector2d slope = Eigen::Vector2d(-c.y(), c.x()) / (from_body_m.z() - arm_m.z());
  const double yaw_variance = fix.covariance(kBodyYaw, kBodyYaw);
  return 0.75 * yaw_variance * yaw_variance * d * d.transpose() +
         yaw_variance * fix.covariance(2, 2) * slope * slope.transpose();
}

void set_rejected_lamps(const FrameObservations& frame, Fix& fix) {
  fix.rejected_lamps = frame.rejected_lamps;
  const auto listed =
      std::min(static_cast<std::size_t>(frame.rejected_lamps), fix.rejected_ids.size());
  std::copy_n(frame.rejected_ids.begin(), listed, fix.rejected_ids.begin());
}

Fix make_fix_without_pose(FixStatus status, int unknown_lamps) {
  Fix fix;
  fix.status = status;
  fix.unknown_lamps = unknown_lamps;
  return fix;
}

}  // namespace

static_assert(Positioner::max_lamps == kMaxSightings);

class Positioner::Impl {
 public:
  Impl(const LampMap& map, const Calibration& calibration, const PositionerOptions& options)
      : lamps_below_camera_(map.lamps_below_camera),
        lamps_(sorted_by_id(rotate_upside_down_if(map.lamps_below_camera, map).lamps)),
        lens_(calibration.camera.lens_model, calibration.camera.intrinsics),
        origin_m_(get_lamp_center(lamps_)),
        base_from_camera_(compute_level_from_camera_matrix(calibration, options.correction)),
        common_(lamps_, rotate_upside_down_if(map.lamps_below_camera, calibration),
                options.correction),
        mount_(rotate_upside_down_if(map.lamps_below_camera, options.mount.value_or(CameraMount{
                                                                 Eigen::Vector3d::Zero(), 0}))),
        body_from_base_(rotation_about_z(mount_.yaw_in_robot_rad)),
        body_from_camera_(body_from_base_ * base_from_camera_),
        max_residual_fraction_(options.max_residual_fraction),
        checks_residuals_(options.checks_residuals),
        unstated_sigma_px_(options.unstated_sigma_px),
        row_clock_(make_readout_clock(calibration.camera)) {
    for (Lamp& lamp : lamps_) lamp.position_m -= origin_m_;
    nearest_m_ = list_nearest_distances(lamps_);
    if (!(mount_.position_in_robot_m.allFinite() && std::isfinite(mount_.yaw_in_robot_rad))) {
      throw std::invalid_argument("the position of the camera on the robot is not finite");
    }
    if (!(max_residual_fraction_ > 0))
      throw std::invalid_argument("max_residual_fraction is not positive");
    if (!(unstated_sigma_px_ >= kMinSigma_px && unstated_sigma_px_ <= kMaxSigma_px)) {
      throw std::invalid_argument("unstated_sigma_px is not within 0.0001 and 1000");
    }
  }

  bool is_above_lamps() const { return lamps_below_camera_; }

  Fix compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                           std::span<const EarlierFrame> earlier) const {
    BodyPrior prior = make_prior(sensors);
    if (!are_values_valid(sensors) || !is_valid_prior(prior) ||
        (sensors.prior && !is_covariance_valid(prior)) || !are_times_valid(earlier))
      return make_fix_without_pose(FixStatus::not_finite, 0);
    FrameObservations frame;
    FixStatus status = make_observations(detections, 0, prior, frame);
    const int unknown_lamps = frame.unknown_lamps;
    frame.num_current = frame.size;
    for (const EarlierFrame& before : earlier) {
      if (status != FixStatus::ok || frame.num_current < 2) break;
      status = make_observations(before.detections, -before.before_s, prior, frame);
    }
    if (status != FixStatus::ok) return make_fix_without_pose(status, unknown_lamps);
    if (frame.size == 1) set_height_and_yaw(sensors, prior);
    if (frame.size == 0 || (frame.size == 1 && std::isinf(prior.max_variance(kBodyZ, 2))))
      return make_fix_without_pose(FixStatus::too_few_lamps, unknown_lamps);
    const BodyMotion& motion = prior.mean.motion;
    const bool may_move = prior.is_motion_estimated() || !motion.velocity_m_per_s.isZero(0) ||
                          motion.yaw_rate_rad_per_s != 0;
    if (may_move && !row_clock_)
      return make_fix_without_pose(FixStatus::row_time_unknown, unknown_lamps);
    const BodyProblem problem{mount_.position_in_robot_m, prior};
    BodySolution solution = estimate_pose_robustly(frame, problem, max_residual_fraction_);
    if (solution.status == FixStatus::ok && checks_residuals_)
      reject_contradicting(frame, problem, solution);
    Fix fix = solution.status == FixStatus::ok ? make_consistent_fix(frame, problem, solution.fix)
                                               : make_fix_with_candidates(solution);
    fix.time_s = sensors.time_s;
    fix.unknown_lamps = unknown_lamps;
    return fix;
  }

  Eigen::Matrix3d compute_level_from_camera(const Inclination& inclination) const {
    const Eigen::Matrix3d level_from_body = level_rotation_from_inclination(inclination);
    return level_rotation_from_zenith((level_from_body * body_from_camera_).inverse().col(2));
  }

  LampProjection project_lamp(int id, const BodyState& state) const {
    constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
    const LampProjection none{Eigen::Vector2d::Constant(unknown),
                              LampProjection::Jacobian::Constant(unknown)};
    constexpr int max_iterations = 20;
    constexpr double tolerance_s = 1e-12;
    if (!has_lamp(id)) return none;
    const Lamp& lamp_in_map = lamps_[require_lamp_index(id)];
    BodyState local = state;
    local.pose.position_m -= origin_m_;
    const EvaluatedState body(local);
    const Eigen::Matrix3d camera_from_body = body_from_camera_.inverse();
    double time_s = 0;
    for (int iteration = 0; iteration < max_iterations; ++iteration) {
      const auto lamp =
          linearize_lamp_position(lamp_in_map.position_m, time_s, body, mount_.position_in_robot_m);
      const auto seen = lens_.project_with_jacobians(camera_from_body * lamp.q);
      if (!seen) return none;
      const double read_s = row_clock_ ? row_clock_->compute_readout_time_s(seen->pixel) : 0;
      if (!(std::abs(read_s - time_s) > tolerance_s)) {
        // The readout time t depends on the pixel p: dp = d_pixel_d_q (J dx + dq/dt dt).
        const Eigen::Matrix<double, 2, 3> d_pixel_d_q = seen->d_pixel_d_point * camera_from_body;
        Eigen::Matrix2d implicit = Eigen::Matrix2d::Identity();
        if (row_clock_) {
          implicit -= d_pixel_d_q * lamp.velocity_m_per_s * row_clock_->d_time_d_pixel();
        }
        return {seen->pixel, implicit.inverse() * d_pixel_d_q * lamp.jacobian};
      }
      time_s = read_s;
    }
    return none;
  }

  bool has_lamp(int id) const {
    const std::size_t index = require_lamp_index(id);
    return index < lamps_.size() && lamps_[index].id == id;
  }

  int num_lamps_moved_since_calibration() const {
    return common_.num_lamps_moved_since_calibration();
  }

 private:
  /// Returns the prior of the state from the readings; without height and yaw of the camera.
  BodyPrior make_prior(const Sensors& sensors) const {
    BodyPrior prior;
    if (sensors.prior) {
      static_cast<StatePrior&>(prior) = *sensors.prior;
    } else {
      if (const auto& motion = sensors.motion) {
        prior.mean.motion = {motion->velocity_m_per_s, motion->yaw_rate_rad_per_s, {}};
        prior.set_state_sd(kBodyVelocity, motion->velocity_sd_m_per_s);
        prior.set_state_sd(kBodyYawRate, motion->yaw_rate_sd_rad_per_s);
      }
      if (sensors.inclination) prior.mean.motion.inclination = *sensors.inclination;
      if (sensors.inclination_sigma_rad > 0)
        prior.set_state_sd(kBodyRoll, sensors.inclination_sigma_rad);
      if (const auto& height = sensors.height) {
        prior.mean.pose.position_m.z() = height->z_m;
        prior.set_state_sd(kBodyZ, height->sd_m);
      }
    }
    prior.mean.pose.position_m -= origin_m_;
    return prior;
  }

  void set_height_and_yaw(const Sensors& sensors, BodyPrior& prior) const {
    if (!sensors.height_and_yaw) return;
    const HeightAndYaw& known = *sensors.height_and_yaw;
    prior.mean.pose = {{0, 0, known.z_m - origin_m_.z()}, known.yaw_rad - mount_.yaw_in_robot_rad};
    prior.height_point_m = mount_.position_in_robot_m;
    prior.set_state_sd(kBodyZ, known.z_sd_m);
    prior.set_state_sd(kBodyYaw, known.yaw_sd_rad);
  }

  /// Adds the detections of lamps of the map to the frame. `time_s` is the time of the detections.
  FixStatus make_observations(std::span<const Detection> detections, double time_s,
                              const BodyPrior& prior, FrameObservations& frame) const {
    // With known roll and pitch, detections without sigma_px have equal weights in the level plane.
    std::optional<Eigen::Matrix3d> level_from_body;
    if (!prior.is_tilt_estimated())
      level_from_body = level_rotation_from_inclination(prior.mean.motion.inclination);
    const auto ids_begin = frame.ids.begin() + static_cast<std::ptrdiff_t>(frame.size);
    for (const Detection& detection : detections) {
      const auto lamp = std::ranges::lower_bound(lamps_, detection.lamp, {}, &Lamp::id);
      if (lamp == lamps_.end() || lamp->id != detection.lamp) {
        ++frame.unknown_lamps;
        continue;
      }
      const auto ids_end = frame.ids.begin() + static_cast<std::ptrdiff_t>(frame.size);
      if (std::find(ids_begin, ids_end, lamp->id) != ids_end) return FixStatus::duplicate_lamp;
      if (frame.size == max_lamps) return FixStatus::too_many_lamps;
      const double sigma_px = detection.sigma_px.value_or(unstated_sigma_px_);
      const bool plausible = sigma_px >= kMinSigma_px && sigma_px <= kMaxSigma_px;
      if (!detection.pixel.allFinite() || !plausible) return FixStatus::not_finite;
      const auto ray = lens_.unproject_pixel(detection.pixel);
      if (!ray) return FixStatus::outside_lens;
      const Eigen::Vector3d direction = body_from_camera_ * ray->direction;
      const Eigen::Matrix<double, 3, 2> d_direction = body_from_camera_ * ray->d_direction_d_pixel;
      const auto whitened = whiten_ray_jacobian(direction, d_direction, sigma_px);
      if (!whitened) return FixStatus::outside_lens;
      const double read_s = row_clock_ ? row_clock_->compute_readout_time_s(detection.pixel) : 0;
      frame.sightings[frame.size] = {lamp->position_m, direction.normalized(), *whitened, sigma_px,
                                     time_s + read_s};
      frame.noise[frame.size].setIdentity();
      if (!detection.sigma_px) {
        frame.noise_is_stated = false;
        if (level_from_body &&
            !weight_in_level_plane(*level_from_body, d_direction / direction.norm(), frame))
          return FixStatus::lamp_below_camera;
      }
      frame.nearest_m[frame.size] = nearest_m_[static_cast<std::size_t>(lamp - lamps_.begin())];
      frame.ids[frame.size++] = lamp->id;
    }
    return FixStatus::ok;
  }

  /// Weights the last observation as if the noise were equal in the undistorted image, the level
  /// plane. `d_ray_d_pixel` is the derivative of a ray of unit length. Returns false if the lamp is
  /// not above the horizon.
  bool weight_in_level_plane(const Eigen::Matrix3d& level_from_body,
                             const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel,
                             FrameObservations& frame) const {
    LampObservation& seen = frame.sightings[frame.size];
    const Eigen::Vector3d ray = level_from_body * seen.ray;
    if (!(ray.z() > 0)) return false;
    const LampObservation level = make_level_observation(
        seen.lamp_m, ray.hnormalized(), lens_.focal_px().asDiagonal(), seen.sigma_px);
    seen.whitened_pixel_from_ray = level.whitened_pixel_from_ray * level_from_body;
    seen.depth_axis = level_from_body.transpose() * level.depth_axis;
    const Eigen::Matrix2d d_residual_d_noise =
        seen.sigma_px / ray.z() * seen.whitened_pixel_from_ray * d_ray_d_pixel;
    frame.noise[frame.size] = d_residual_d_noise * d_residual_d_noise.transpose();
    frame.is_weighted_by_noise = false;
    return true;
  }

  std::size_t require_lamp_index(int id) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(lamps_, id, {}, &Lamp::id) -
                                    lamps_.begin());
  }

  /// Observations of a frame with the indices of their lamps in the map.
  struct MapObservations {
    std::array<std::size_t, max_lamps> lamps;
    CommonErrors::Observations errors;

    MapObservations(const FrameObservations& frame, const BodyProblem& problem, const Impl& impl)
        : errors{frame.observations_span(),
                 {lamps.data(), frame.size},
                 impl.lens_,
                 impl.body_from_base_,
                 problem.arm_m} {
      for (std::size_t i = 0; i < frame.size; ++i) lamps[i] = impl.require_lamp_index(frame.ids[i]);
    }
  };

  /// Rejects the lamps that noise and common errors do not explain.
  void reject_contradicting(FrameObservations& frame, const BodyProblem& problem,
                            BodySolution& solution) const {
    constexpr std::size_t min_lamps = 4;  // fewer identify no outlier
    const bool are_all_errors_known = common_.has_all_errors();
    const BodyFix& fix = solution.fix;
    if (frame.num_current < frame.size || frame.size < min_lamps ||
        !(are_all_errors_known || frame.noise_is_stated)) {
      return;
    }
    // If the noise alone explains the residuals, no other error is needed.
    if (fix.pixels_chi_squared <= compute_chi_squared_limit(fix.redundancy)) {
      return;
    }
    std::array<Matrix2, max_lamps> common;
    const std::span<Matrix2> covariances(common.data(), frame.size);
    add_covariances(frame, problem, fix, covariances);
    const OutlierLamps outliers = flag_outlier_lamps(frame.observations_span(), covariances,
                                                     problem, fix, are_all_errors_known);
    solution = reject_outlier_lamps(frame, outliers, problem, solution);
  }

  void add_covariances(const FrameObservations& frame, const BodyProblem& problem,
                       const BodyFix& fix, std::span<Matrix2> covariances) const {
    std::ranges::fill(covariances, Matrix2::Zero());
    if (!common_.has_known_errors()) return;
    common_.add_covariances(MapObservations(frame, problem, *this).errors, fix.state, covariances);
  }

  /// Returns G C G', the covariance of the states from the common errors. Only that of the pose if
  /// no other state is estimated.
  BodyCovariance compute_common_covariance(const FrameObservations& frame,
                                           const BodyProblem& problem, const BodyFix& fix) const {
    BodyCovariance common = BodyCovariance::Zero();
    if (!common_.has_known_errors()) return common;
    const MapObservations observations(frame, problem, *this);
    if (problem.prior.is_motion_or_tilt_free())
      return common_.propagate(common_.differentiate_fix<kBodyStates>(observations.errors, fix));
    common.topLeftCorner<4, 4>() =
        common_.propagate(common_.differentiate_fix<4>(observations.errors, fix));
    return common;
  }

  /// Makes a fix whose covariance agrees with its residuals. If these contradict the noise, it
  /// includes an unknown tilt or motion that explains them, or the noise is scaled until it does.
  /// Chi-squared stays that of the stated noise.
  Fix make_consistent_fix(FrameObservations& frame, const BodyProblem& problem,
                          const BodyFix& solution) const {
    Fix fix = make_fix(frame, problem, solution, BodyCovariance::Zero());
    // Noise that is not stated is no contradiction.
    const bool may_contradict = checks_residuals_ && frame.noise_is_stated;
    const double scale = may_contradict ? compute_birge_ratio(fix) : 1;
    if (scale > 1) {
      if (const auto covariance = find_wider_covariance(frame, problem, solution)) {
        fix = make_fix(frame, problem, solution, *covariance - solution.covariance);
      } else {
        fix = make_fix_with_noise(frame, problem, solution, scale);
      }
    }
    return fix;
  }

  Fix make_fix_with_noise(FrameObservations& frame, const BodyProblem& problem,
                          const BodyFix& solution, double scale) const {
    for (std::size_t i = 0; i < frame.size; ++i) {
      frame.sightings[i].whitened_pixel_from_ray /= scale;
      frame.sightings[i].sigma_px *= scale;
    }
    const auto again = estimate_body_state(frame.observations_span(), problem, solution.state);
    if (!again) return make_fix_without_pose(FixStatus::inconsistent, 0);
    Fix fix = make_fix(frame, problem, *again, BodyCovariance::Zero());
    fix.chi_squared *= scale * scale;
    fix.common_chi_squared *= scale * scale;
    return fix;
  }

  /// Returns the covariance of a state if roll and pitch that were assumed to be exact, or the
  /// motion, are unknown instead: that of the state estimated with them, plus the square of the
  /// difference. Returns std::nullopt if neither explains the residuals.
  std::optional<BodyCovariance> find_wider_covariance(const FrameObservations& frame,
                                                      const BodyProblem& problem,
                                                      const BodyFix& fix) const {
    constexpr double tilt_sd_rad = 0.15, speed_sd_m_per_s = 1.5, yaw_rate_sd_rad_per_s = 1;
    const BodyPrior& known = problem.prior;
    BodyPrior tilted = known, moving = known;
    tilted.set_state_sd(kBodyRoll, tilt_sd_rad);
    moving.set_state_sd(kBodyVelocity, speed_sd_m_per_s);
    moving.set_state_sd(kBodyYawRate, yaw_rate_sd_rad_per_s);
    std::optional<BodyCovariance> found;
    const auto add = [&](const BodyPrior& prior) {
      const auto other =
          estimate_body_state(frame.observations_span(), {problem.arm_m, prior}, fix.state);
      if (!other || other->pixels_chi_squared > compute_chi_squared_limit(other->redundancy))
        return;
      const Eigen::Matrix<double, kBodyStates, 1> difference =
          subtract_states(other->state, fix.state);
      const BodyCovariance covariance =
          other->covariance + BodyCovariance(difference * difference.transpose());
      found = found ? BodyCovariance(*found + covariance) : covariance;
    };
    if (!known.is_tilt_estimated()) add(tilted);
    if (!known.is_motion_estimated() && row_clock_) add(moving);
    if (!found) return found;
    // States given as exact remain so in the result.
    for (int i = 0; i < kBodyStates; ++i) {
      if (fix.covariance(i, i) > 0) continue;
      found->row(i).setZero();
      found->col(i).setZero();
    }
    return found;
  }

  Fix make_fix_with_candidates(const BodySolution& solution) const {
    Fix fix = make_fix_without_pose(solution.status, 0);
    if (solution.status != FixStatus::ambiguous) return fix;
    fix.num_candidates = solution.num_candidates;
    fix.candidates = solution.candidates;
    for (FixCandidate& candidate : fix.candidates) candidate.state.pose.position_m += origin_m_;
    return fix;
  }

  /// `excess` is added to the covariance as an error that is not noise.
  Fix make_fix(const FrameObservations& frame, const BodyProblem& problem, BodyFix solution,
               const BodyCovariance& excess) const {
    const BodyCovariance common = compute_common_covariance(frame, problem, solution);
    Fix fix;
    fix.status = FixStatus::ok;
    if (solution.pixels_chi_squared > solution.redundancy && common_.has_known_errors() &&
        solution.redundancy > kMinRedundancy) {
      std::array<Matrix2, max_lamps> covariances;
      add_covariances(frame, problem, solution, {covariances.data(), frame.size});
      fix.common_chi_squared =
          compute_expected_chi_squared(MapObservations(frame, problem, *this).errors,
                                       {covariances.data(), frame.size}, solution, common);
    }
    if (!frame.is_weighted_by_noise) convert_to_image_noise(frame, problem, solution);
    fix.redundancy = solution.redundancy > kMinRedundancy ? solution.redundancy : 0;
    fix.chi_squared = solution.pixels_chi_squared;
    fix.state = solution.state;
    fix.noise_covariance = solution.covariance;
    if (frame.size == 1) {
      fix.noise_covariance.topLeftCorner<2, 2>() +=
          expand_to_second_order(frame.sightings[0], problem, solution);
    }
    fix.covariance = fix.noise_covariance + common + excess;
    fix.state.pose.position_m += origin_m_;
    fix.residual_px = solution.residual_px;
    fix.lamps = static_cast<int>(frame.num_current);
    fix.sightings = static_cast<int>(frame.size);
    set_rejected_lamps(frame, fix);
    return fix;
  }

  /// If true, all other members and the methods refer to the rotated world (lamps_below.h).
  bool lamps_below_camera_;
  std::vector<Lamp> lamps_;        // in the order of ids, positions relative to origin_m_
  std::vector<double> nearest_m_;  // from each to the nearest other, on the floor plan
  Lens lens_;
  Eigen::Vector3d origin_m_;
  Eigen::Matrix3d base_from_camera_;
  CommonErrors common_;
  /// Without a mount, the robot is the camera.
  CameraMount mount_;
  /// The base is the camera's level frame.
  Eigen::Matrix3d body_from_base_, body_from_camera_;
  double max_residual_fraction_;
  bool checks_residuals_;
  double unstated_sigma_px_;
  /// std::nullopt if the calibration lacks row time or readout direction.
  std::optional<RowClock> row_clock_;
};

Positioner::Positioner(const LampMap& map, const Calibration& calibration,
                       const PositionerOptions& options)
    : impl_(std::make_shared<const Impl>(map, calibration, options)) {}

Fix Positioner::compute_position_fix(std::span<const Detection> detections,
                                     const Sensors& sensors) const noexcept {
  const bool below = impl_->is_above_lamps();
  return rotate_upside_down_if(
      below, impl_->compute_position_fix(detections, rotate_upside_down_if(below, sensors), {}));
}

Fix Positioner::compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                                     std::span<const EarlierFrame> earlier) const noexcept {
  const bool below = impl_->is_above_lamps();
  return rotate_upside_down_if(
      below,
      impl_->compute_position_fix(detections, rotate_upside_down_if(below, sensors), earlier));
}

Eigen::Matrix3d Positioner::compute_level_from_camera(const Inclination& inclination) const {
  return impl_->compute_level_from_camera(
      rotate_upside_down_if(impl_->is_above_lamps(), inclination));
}

LampProjection Positioner::project_lamp(int lamp, const BodyState& state) const noexcept {
  const bool below = impl_->is_above_lamps();
  return rotate_upside_down_if(below,
                               impl_->project_lamp(lamp, rotate_upside_down_if(below, state)));
}

DetectionResidual Positioner::compute_detection_residual(const Detection& detection,
                                                         const Fix& fix) const noexcept {
  const auto rejected = static_cast<std::size_t>(fix.rejected_lamps);
  const auto listed =
      std::span(fix.rejected_ids).first(std::min(rejected, fix.rejected_ids.size()));
  const DetectionUse use = !impl_->has_lamp(detection.lamp) ? DetectionUse::not_in_map
                           : std::ranges::find(listed, detection.lamp) != listed.end()
                               ? DetectionUse::rejected
                               : DetectionUse::used;
  const LampProjection predicted = project_lamp(detection.lamp, fix.state);
  return {use, predicted, detection.pixel - predicted.pixel};
}

int Positioner::num_lamps_moved_since_calibration() const noexcept {
  return impl_->num_lamps_moved_since_calibration();
}

}  // namespace vlp
