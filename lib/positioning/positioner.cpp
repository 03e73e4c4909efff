// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/positioner.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
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
#include "geometry/plane.h"
#include "positioning/closed_form.h"
#include "positioning/correlated_errors.h"
#include "positioning/inclination_rotation.h"
#include "positioning/known_motion.h"
#include "positioning/lamps_below.h"
#include "positioning/outlier_rejection.h"
#include "positioning/pose_observations.h"
#include "positioning/row_clock.h"
#include "positioning/sighting.h"

namespace vlp {
namespace {

using Sightings = std::span<const Sighting>;

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

bool are_values_finite(const KnownMotion& motion) {
  return motion.velocity_m_per_s.allFinite() && std::isfinite(motion.yaw_rate_rad_per_s) &&
         is_valid_sd(motion.velocity_sd_m_per_s) && is_valid_sd(motion.yaw_rate_sd_rad_per_s);
}

bool are_values_finite(const Sensors& sensors) {
  const auto& lean = sensors.inclination;
  const auto& known = sensors.height_and_yaw;
  const auto& height = sensors.height;
  return is_valid_sd(sensors.inclination_sigma_rad) &&
         (!sensors.motion || are_values_finite(*sensors.motion)) &&
         (!height ||
          (std::isfinite(height->z_m) && is_valid_sd(height->sd_m) && height->sd_m > 0)) &&
         (!lean || (std::isfinite(lean->roll_rad) && std::isfinite(lean->pitch_rad))) &&
         (!known || (std::isfinite(known->z_m) && std::isfinite(known->yaw_rad) &&
                     is_valid_sd(known->z_sd_m) && is_valid_sd(known->yaw_sd_rad)));
}

/// Returns the mean position of the lamps, relative to which national coordinates lose no digits.
Eigen::Vector3d get_lamp_center(const std::vector<Lamp>& lamps) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : lamps) sum += lamp.position_m - lamps.front().position_m;
  return lamps.front().position_m + sum / static_cast<double>(lamps.size());
}

/// Returns the horizontal distance of each lamp to the nearest other one; infinity if there is
/// none.
std::vector<double> compute_distances_to_nearest_lamp(const std::vector<Lamp>& lamps) {
  std::vector<double> nearest_m(lamps.size(), std::numeric_limits<double>::infinity());
  std::vector<std::pair<Eigen::Vector2d, std::size_t>> sorted;
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

/// Returns true if more than a pose is estimated, or if the camera moves during the readout.
bool needs_body_estimation(const Sensors& sensors) {
  return sensors.inclination_sigma_rad > 0 || sensors.height ||
         (sensors.motion && may_camera_move_during_readout(*sensors.motion));
}

/// Rotates velocity and covariances from the level frame to the world. `common` is added to the
/// covariance of the fix's own noise.
BodyEstimate rotate_estimate_to_world(const BodyFix& fix, const BodyCovariance& common) {
  const Eigen::Rotation2Dd world_from_level(fix.state.pose.yaw_rad);
  const BodyMotion& motion = fix.state.motion;
  BodyEstimate estimate{world_from_level * motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
                        motion.inclination, fix.covariance + common, fix.covariance};
  const Eigen::Matrix2d turn = world_from_level.toRotationMatrix();
  const Eigen::Vector2d by_yaw(-estimate.velocity_m_per_s.y(), estimate.velocity_m_per_s.x());
  for (BodyCovariance* covariance : {&estimate.covariance, &estimate.noise_covariance}) {
    covariance->middleRows<2>(kBodyVelocity) =
        (turn.lazyProduct(covariance->middleRows<2>(kBodyVelocity)) +
         by_yaw.lazyProduct(covariance->row(kBodyYaw)))
            .eval();
    covariance->middleCols<2>(kBodyVelocity) =
        (covariance->middleCols<2>(kBodyVelocity).lazyProduct(turn.transpose()) +
         covariance->col(kBodyYaw).lazyProduct(by_yaw.transpose()))
            .eval();
  }
  return estimate;
}

template <typename Frame>
void set_rejected_lamps(const Frame& frame, Fix& fix) {
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
        lamps_(sorted_by_id(turn_over_if(map.lamps_below_camera, map).lamps)),
        lens_(calibration.camera.lens_model, calibration.camera.intrinsics),
        origin_m_(get_lamp_center(lamps_)),
        base_from_camera_(compute_level_from_camera_matrix(calibration, options.correction)),
        common_(lamps_, turn_over_if(map.lamps_below_camera, calibration), options.correction),
        mount_(turn_over_if(map.lamps_below_camera,
                            options.mount.value_or(CameraMount{Eigen::Vector3d::Zero(), 0}))),
        body_from_base_(rotation_about_z(mount_.yaw_in_robot_rad)),
        body_from_camera_(body_from_base_ * base_from_camera_),
        max_residual_fraction_(options.max_residual_fraction),
        unstated_sigma_px_(options.unstated_sigma_px),
        computes_common_chi_squared_(options.computes_common_chi_squared),
        row_clock_(make_readout_clock(calibration.camera)) {
    for (Lamp& lamp : lamps_) lamp.position_m -= origin_m_;
    nearest_m_ = compute_distances_to_nearest_lamp(lamps_);
    if (!(mount_.position_in_robot_m.allFinite() && std::isfinite(mount_.yaw_in_robot_rad))) {
      throw std::invalid_argument("the position of the camera on the robot is not finite");
    }
    if (!(max_residual_fraction_ > 0))
      throw std::invalid_argument("max_residual_fraction is not positive");
    if (!(unstated_sigma_px_ >= kMinSigma_px && unstated_sigma_px_ <= kMaxSigma_px)) {
      throw std::invalid_argument("unstated_sigma_px is not within 0.0001 and 1000");
    }
  }

  Fix compute_position_fix(std::span<const Detection> detections, const Sensors& sensors) const {
    if (!are_values_finite(sensors)) return make_fix_without_pose(FixStatus::not_finite, 0);
    if (needs_body_estimation(sensors) && detections.size() > 1) {
      if (auto fix = compute_body_fix(detections, sensors, {})) return *fix;
    }
    const InclinationRotation lean =
        sensors.inclination
            ? compute_inclination_rotation(*sensors.inclination, mount_.yaw_in_robot_rad)
            : InclinationRotation();
    FrameObservations frame;
    const FixStatus seen = make_observations(detections, lean.level_from_base, frame);
    if (seen != FixStatus::ok) return make_fix_without_pose(seen, frame.unknown_lamps);

    Fix fix;
    Matrix4 height_and_yaw_covariance = Matrix4::Zero();
    InclinationJacobian d_pose_d_inclination = InclinationJacobian::Zero();
    if (frame.size > 1) {
      // If common errors are known, the noise alone must not reject lamps.
      const bool total = common_.are_lens_zenith_and_lamp_errors_known();
      if (total) frame.noise_is_stated = false;
      ConsistentFix found = estimate_pose_robust(frame, max_residual_fraction_);
      if (total) reject_outlier_lamps(frame, lean.level_from_base, found);
      const auto& [status, solution] = found;
      if (status != FixStatus::ok) return make_fix_without_pose(status, frame.unknown_lamps);
      fix.estimate = {solution.pose, solution.covariance};
      fix.residual_px = solution.residual_px;
      fix.chi_squared = solution.chi_squared;
    } else if (frame.size == 1 && sensors.height_and_yaw) {
      const auto readout = motion_at_readout(detections, frame.ids.front(), sensors);
      if (!readout) return make_fix_without_pose(FixStatus::row_time_unknown, frame.unknown_lamps);
      const Sighting& sighting = frame.sightings.front();
      HeightAndYaw known = *sensors.height_and_yaw;
      known.z_m -= origin_m_.z();
      const auto pose = compute_pose_at_known_height_and_yaw(sighting, known, *readout);
      if (!pose) return make_fix_without_pose(FixStatus::lamp_below_camera, frame.unknown_lamps);
      fix.estimate = {*pose, compute_one_lamp_fix_covariance_from_pixel_noise(sighting, *pose)};
      height_and_yaw_covariance =
          compute_one_lamp_fix_covariance_from_sensors(sighting, *pose, known, *readout);
      d_pose_d_inclination =
          compute_one_lamp_fix_jacobian_wrt_level_rotation(sighting, *pose) * lean.error_axes;
    } else {
      return make_fix_without_pose(FixStatus::too_few_lamps, frame.unknown_lamps);
    }
    fix.status = FixStatus::ok;
    fix.lamps = fix.sightings = static_cast<int>(frame.size);
    fix.redundancy = frame.size < 3 ? 0 : 2 * static_cast<double>(frame.size) - 4;
    fix.time_s = sensors.time_s;
    set_rejected_lamps(frame, fix);
    fix.unknown_lamps = frame.unknown_lamps;
    add_covariances(frame, lean, d_pose_d_inclination, sensors, height_and_yaw_covariance, fix);
    fix.estimate.pose.position_m += origin_m_;
    return fix;
  }

  bool are_lamps_below_camera() const { return lamps_below_camera_; }

  Fix compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                           std::span<const EarlierFrame> earlier) const {
    const bool finite_times =
        std::all_of(earlier.begin(), earlier.end(),
                    [](const EarlierFrame& before) { return std::isfinite(before.before_s); });
    if (!are_values_finite(sensors) || !finite_times)
      return make_fix_without_pose(FixStatus::not_finite, 0);
    if (const auto fix = compute_body_fix(detections, sensors, earlier)) return *fix;
    return compute_position_fix(detections, sensors);
  }

  int num_lamps_moved_since_calibration() const {
    return common_.num_lamps_moved_since_calibration();
  }

 private:
  /// Adds each detection of a lamp of the map to the frame: `add` takes it, its lamp, its ray and
  /// its standard deviation, and fills the frame's sighting.
  template <typename Frame, typename Add>
  FixStatus match_detections_to_map(std::span<const Detection> detections, Frame& frame,
                                    const Add& add) const {
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
      const FixStatus added = add(detection, *lamp, *ray, sigma_px);
      if (added != FixStatus::ok) return added;
      if (!detection.sigma_px) frame.noise_is_stated = false;
      frame.nearest_m[frame.size] = nearest_m_[static_cast<std::size_t>(lamp - lamps_.begin())];
      frame.ids[frame.size++] = lamp->id;
    }
    return FixStatus::ok;
  }

  std::size_t find_lamp_index_by_id(int id) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(lamps_, id, {}, &Lamp::id) -
                                    lamps_.begin());
  }

  /// Rejects lamps by the reported uncertainties if all are known; otherwise estimate_pose_robust()
  /// decides.
  void reject_outlier_lamps(FrameObservations& frame, const Eigen::Matrix3d& level_from_base,
                            ConsistentFix& solution) const {
    constexpr std::size_t min_lamps = 4;  // fewer identify no outlier
    if (solution.status != FixStatus::ok || frame.size < min_lamps) return;
    // If the noise alone explains the residuals, no other error is needed.
    if (solution.fix.chi_squared <= static_cast<double>(2 * frame.size - 4)) return;
    const LevelPose pose(solution.fix.pose);
    std::array<Matrix2, max_lamps> common;
    for (std::size_t i = 0; i < frame.size; ++i) {
      common[i] = common_.compute_observation_covariance(
          common_.compute_observation_jacobians_wrt_errors(frame.sightings[i], pose, lens_,
                                                           level_from_base),
          find_lamp_index_by_id(frame.ids[i]));
    }
    const OutlierLamps wrong =
        find_outlier_lamps(frame.observations_span(), {common.data(), frame.size}, solution.fix);
    if (wrong.count == 0) return;
    std::bitset<kMaxSightings> kept;
    kept.set();
    for (std::size_t i = 0; i < wrong.count; ++i) kept.reset(wrong.lamps[i]);
    frame.keep_only_selected_observations(kept);
    solution =
        estimate_and_check_pose(frame.observations_span(), std::numeric_limits<double>::infinity());
  }

  /// Returns G C G'. Sets fix.common_chi_squared if PositionerOptions require it.
  Matrix4 compute_common_covariance(const FrameObservations& frame,
                                    const Eigen::Matrix3d& level_from_base, Fix& fix) const {
    std::array<std::size_t, max_lamps> lamps;
    for (std::size_t i = 0; i < frame.size; ++i) lamps[i] = find_lamp_index_by_id(frame.ids[i]);
    const std::span<const std::size_t> in_map(lamps.data(), frame.size);
    const Matrix4 common =
        common_.propagate_covariance_to_fix(common_.compute_gain_from_errors_to_fix(
            frame.observations_span(), in_map, fix.estimate, lens_, level_from_base));
    if (computes_common_chi_squared_ && fix.redundancy > 0) {
      fix.common_chi_squared = common_.compute_expected_chi_squared_of_common_errors(
          frame.observations_span(), in_map, fix.estimate, common, lens_, level_from_base);
    }
    return common;
  }

  BodyCovariance compute_common_covariance(const BodyObservations& frame,
                                           const Eigen::Vector3d& arm_m, const BodyFix& solution,
                                           Fix& fix) const {
    std::array<std::size_t, max_lamps> lamps;
    for (std::size_t i = 0; i < frame.size; ++i) lamps[i] = find_lamp_index_by_id(frame.ids[i]);
    const std::span<const std::size_t> in_map(lamps.data(), frame.size);
    const BodyCovariance common =
        common_.propagate_covariance_to_fix(common_.compute_gain_from_errors_to_fix(
            frame.observations_span(), in_map, arm_m, solution, lens_, body_from_base_));
    if (computes_common_chi_squared_ && fix.redundancy > 0) {
      fix.common_chi_squared = common_.compute_expected_chi_squared_of_common_errors(
          frame.observations_span(), in_map, arm_m, solution, common, lens_, body_from_base_);
    }
    return common;
  }

  FixStatus make_observations(std::span<const Detection> detections,
                              const Eigen::Matrix3d& level_from_base,
                              FrameObservations& frame) const {
    const Eigen::Matrix3d level_from_camera = level_from_base * base_from_camera_;
    const auto add = [&](const Detection& detection, const Lamp& lamp, const Lens::Ray& ray,
                         double sigma_px) {
      const Eigen::Vector3d direction = level_from_camera * ray.direction;
      if (!(direction.z() > 0)) return FixStatus::lamp_below_camera;
      const Eigen::Matrix<double, 3, 2> d_direction = level_from_camera * ray.d_direction_d_pixel;
      const Eigen::Vector2d z = direction.head<2>() / direction.z();
      const Eigen::Matrix2d d_z_d_pixel =
          (d_direction.topRows<2>() - z * d_direction.row(2)) / direction.z();
      frame.sightings[frame.size] = {lamp.position_m, z, lens_.focal_px().asDiagonal(), sigma_px};
      if (detection.sigma_px) {
        frame.sightings[frame.size].d_pixel_d_z = d_z_d_pixel.inverse();
      } else {
        frame.is_weighed_by_noise = false;
      }
      return FixStatus::ok;
    };
    return match_detections_to_map(detections, frame, add);
  }

  FixStatus make_body_observations(std::span<const Detection> detections, double time_s,
                                   BodyObservations& frame) const {
    const auto add = [&](const Detection& detection, const Lamp& lamp, const Lens::Ray& ray,
                         double sigma_px) {
      const Eigen::Vector3d direction = body_from_camera_ * ray.direction;
      const auto whitened = compute_whitened_pixel_jacobian_wrt_ray(
          direction, body_from_camera_ * ray.d_direction_d_pixel, sigma_px);
      if (!whitened) return FixStatus::outside_lens;
      const double read_s =
          row_clock_ ? row_clock_->compute_pixel_readout_time_s(detection.pixel) : 0;
      frame.sightings[frame.size] = {lamp.position_m, direction.normalized(), *whitened, sigma_px,
                                     time_s + read_s};
      return FixStatus::ok;
    };
    return match_detections_to_map(detections, frame, add);
  }

  /// Returns std::nullopt if the frame has fewer than two lamps of the map.
  std::optional<Fix> compute_body_fix(std::span<const Detection> detections, const Sensors& sensors,
                                      std::span<const EarlierFrame> earlier) const {
    const KnownMotion motion = sensors.motion.value_or(KnownMotion());
    if (may_camera_move_during_readout(motion) && !row_clock_)
      return make_fix_without_pose(FixStatus::row_time_unknown, 0);
    BodyPrior prior{{motion.velocity_m_per_s, motion.yaw_rate_rad_per_s,
                     sensors.inclination.value_or(Inclination{0, 0})},
                    motion.velocity_sd_m_per_s,
                    motion.yaw_rate_sd_rad_per_s,
                    sensors.inclination_sigma_rad,
                    sensors.height};
    if (prior.height) prior.height->z_m -= origin_m_.z();
    Fix fix;
    BodyObservations frame;
    const FixStatus seen = make_body_observations(detections, 0, frame);
    fix.unknown_lamps = frame.unknown_lamps;
    if (seen != FixStatus::ok) return make_fix_without_pose(seen, fix.unknown_lamps);
    frame.num_current = frame.size;
    for (const EarlierFrame& before : earlier) {
      const FixStatus status = make_body_observations(before.detections, -before.before_s, frame);
      if (status != FixStatus::ok) return make_fix_without_pose(status, fix.unknown_lamps);
    }
    if (frame.num_current < 2) return std::nullopt;
    // If common errors are known, the noise alone must not reject lamps.
    if (common_.are_lens_zenith_and_lamp_errors_known()) frame.noise_is_stated = false;
    const Eigen::Vector3d& arm_m = mount_.position_in_robot_m;
    const auto [status, solution] =
        estimate_body_state_robust(frame, arm_m, prior, max_residual_fraction_);
    if (status != FixStatus::ok) return make_fix_without_pose(status, fix.unknown_lamps);
    fix.status = status;
    fix.redundancy = solution.redundancy;
    fix.chi_squared = solution.pixels_chi_squared;
    fix.body = rotate_estimate_to_world(solution,
                                        common_.are_any_errors_known()
                                            ? compute_common_covariance(frame, arm_m, solution, fix)
                                            : BodyCovariance(BodyCovariance::Zero()));
    fix.noise_covariance = fix.body->noise_covariance.topLeftCorner<4, 4>();
    fix.estimate = {solution.state.pose, fix.body->covariance.topLeftCorner<4, 4>()};
    fix.estimate.pose.position_m += origin_m_;
    fix.residual_px = solution.residual_px;
    fix.lamps = static_cast<int>(frame.num_current);
    fix.sightings = static_cast<int>(frame.size);
    set_rejected_lamps(frame, fix);
    fix.time_s = sensors.time_s;
    return fix;
  }

  /// Replaces covariance and redundancy for equal noise in the undistorted image, by which the fix
  /// weighs its sightings, by those for equal noise in the image:
  ///   A = N^-1 J' W,   cov = A V A',   redundancy = tr(W V) - tr(N cov),   N = J' W J.
  void convert_covariance_to_image_noise(const FrameObservations& frame,
                                         const Eigen::Matrix3d& level_from_base, Fix& fix) const {
    const LevelPose pose(fix.estimate.pose);
    const Eigen::Matrix3d camera_from_level = (level_from_base * base_from_camera_).transpose();
    const Matrix4 by_weights = fix.estimate.covariance;
    Matrix4 covariance = Matrix4::Zero();
    double expected_squares = 0;
    for (const Sighting& sighting : frame.observations_span()) {
      const auto seen =
          lens_.project_point_with_jacobians(camera_from_level * sighting.z.homogeneous());
      Eigen::Matrix2d d_pixel_d_z = sighting.d_pixel_d_z;
      if (seen) d_pixel_d_z = seen->d_pixel_d_point * camera_from_level.leftCols<2>();
      const Eigen::Matrix2d z_by_noise = sighting.sigma_px * d_pixel_d_z.inverse();
      const Eigen::Matrix2d whitening = sighting.d_pixel_d_z / sighting.sigma_px;
      const Eigen::Matrix2d residual_by_noise = whitening * z_by_noise;
      const Eigen::Matrix<double, 4, 2> fix_by_noise =
          by_weights * project_lamp_with_jacobian(pose, sighting.lamp_m).d_z_d_state.transpose() *
          whitening.transpose() * residual_by_noise;
      covariance += fix_by_noise * fix_by_noise.transpose();
      expected_squares += residual_by_noise.squaredNorm();
    }
    if (fix.redundancy > 0) {
      fix.redundancy = expected_squares - (by_weights.inverse() * covariance).trace();
    }
    fix.estimate.covariance = covariance;
  }

  /// Adds the covariances of a fix of lamps, and transfers it to the robot if there is a mount.
  void add_covariances(const FrameObservations& frame, const InclinationRotation& lean,
                       const InclinationJacobian& d_pose_d_inclination, const Sensors& sensors,
                       const Matrix4& height_and_yaw_covariance, Fix& fix) const {
    const double sigma_rad = sensors.inclination_sigma_rad;
    const Matrix4 common = common_.are_any_errors_known()
                               ? compute_common_covariance(frame, lean.level_from_base, fix)
                               : Matrix4(Matrix4::Zero());
    if (!frame.is_weighed_by_noise)
      convert_covariance_to_image_noise(frame, lean.level_from_base, fix);
    fix.estimate.covariance += height_and_yaw_covariance;
    // The error of the inclination is independent between frames, too.
    PoseEstimate whole = fix.estimate;
    whole.covariance += common;
    fix.noise_covariance = compute_robot_pose_from_camera_pose(fix.estimate, d_pose_d_inclination,
                                                               sigma_rad, mount_, lean)
                               .covariance;
    fix.estimate =
        compute_robot_pose_from_camera_pose(whole, d_pose_d_inclination, sigma_rad, mount_, lean);
  }

  /// Returns the motion of the camera when a lamp is read, or std::nullopt if it moves and the row
  /// time is not known.
  std::optional<MotionAtReadout> motion_at_readout(std::span<const Detection> detections, int lamp,
                                                   const Sensors& sensors) const {
    MotionAtReadout readout;
    if (!sensors.motion || !may_camera_move_during_readout(*sensors.motion)) return readout;
    if (!row_clock_) return std::nullopt;
    const auto detection = std::find_if(detections.begin(), detections.end(),
                                        [&](const Detection& one) { return one.lamp == lamp; });
    readout.motion = *sensors.motion;
    readout.time_s = row_clock_->compute_pixel_readout_time_s(detection->pixel);
    const Eigen::Rotation2Dd camera_from_robot(-mount_.yaw_in_robot_rad);
    readout.motion.velocity_m_per_s = camera_from_robot * sensors.motion->velocity_m_per_s;
    readout.arm_m = camera_from_robot * mount_.position_in_robot_m.head<2>();
    return readout;
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
  double unstated_sigma_px_;
  bool computes_common_chi_squared_;
  /// std::nullopt if the calibration lacks row time or readout direction.
  std::optional<RowClock> row_clock_;
};

Positioner::Positioner(const LampMap& map, const Calibration& calibration,
                       const PositionerOptions& options)
    : impl_(std::make_shared<const Impl>(map, calibration, options)) {}

Fix Positioner::compute_position_fix(std::span<const Detection> detections,
                                     const Sensors& sensors) const noexcept {
  const bool below = impl_->are_lamps_below_camera();
  return turn_over_if(below, impl_->compute_position_fix(detections, turn_over_if(below, sensors)));
}

Fix Positioner::compute_position_fix(std::span<const Detection> detections, const Sensors& sensors,
                                     std::span<const EarlierFrame> earlier) const noexcept {
  const bool below = impl_->are_lamps_below_camera();
  return turn_over_if(
      below, impl_->compute_position_fix(detections, turn_over_if(below, sensors), earlier));
}

int Positioner::num_lamps_moved_since_calibration() const noexcept {
  return impl_->num_lamps_moved_since_calibration();
}

}  // namespace vlp
