// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "positioning/closed_form.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/similarity.h"

namespace vlp {

namespace {

/// Computes the real roots of a x^2 + 2 b x + c, a > 0, without cancellation.
struct Roots {
  int count = 0;
  std::array<double, 2> values{};
};

Roots solve_quadratic(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return {};
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  if (discriminant == 0) return {1, {q / a}};
  return {2, {q / a, c / q}};
}

}  // namespace

TwoLampPoses compute_two_lamp_poses(const Sighting& first, const Sighting& second) {
  const Eigen::Vector2d d = (second.lamp_m - first.lamp_m).head<2>();
  const Eigen::Vector2d difference = second.z - first.z;
  const double h = second.lamp_m.z() - first.lamp_m.z();
  TwoLampPoses fix;
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  const double a = difference.squaredNorm();
  if (!(a > rounding * rounding * (first.z.squaredNorm() + second.z.squaredNorm()))) return fix;

  const Roots heights = solve_quadratic(a, h * difference.dot(second.z),
                                        h * h * second.z.squaredNorm() - d.squaredNorm());
  for (int i = 0; i < heights.count; ++i) {
    const double height_m = heights.values[static_cast<std::size_t>(i)];
    if (!(height_m > 0) || !(height_m + h > 0)) {
      fix.lamp_below_camera = true;
      continue;
    }
    const Eigen::Vector2d level_d = height_m * difference + h * second.z;
    const Eigen::Vector2d turn = conjugate_product(level_d, d);
    const double length = turn.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector2d heading = turn / length;
    const Eigen::Vector2d s = first.lamp_m.head<2>() - height_m * complex_product(heading, first.z);
    fix.poses[static_cast<std::size_t>(fix.count++)] =
        LevelPose({s.x(), s.y(), first.lamp_m.z() - height_m}, heading).convert_to_yaw_pose();
  }
  fix.lamp_below_camera = fix.lamp_below_camera && fix.count == 0;
  return fix;
}

namespace {

constexpr double kSameHeight_m = 1e-6;

bool are_at_one_height(std::span<const Sighting> sightings) {
  return std::all_of(sightings.begin(), sightings.end(), [&](const Sighting& sighting) {
    return std::abs(sighting.lamp_m.z() - sightings.front().lamp_m.z()) <= kSameHeight_m;
  });
}

const Sighting& find_farthest_from(const Sighting& from, std::span<const Sighting> sightings) {
  return *std::max_element(sightings.begin(), sightings.end(),
                           [&](const Sighting& a, const Sighting& b) {
                             return (a.z - from.z).squaredNorm() < (b.z - from.z).squaredNorm();
                           });
}

/// Returns the sum of the squared residuals in z. A lamp that is not above the pose adds 1e6.
double compute_disagreement(const Pose& pose, std::span<const Sighting> sightings) {
  const LevelPose camera(pose);
  double sum = 0;
  for (const Sighting& sighting : sightings) {
    sum +=
        lamp_height_above_camera_m(camera, sighting.lamp_m) > 0
            ? (sighting.z - project_lamp_to_normalized_point(camera, sighting.lamp_m)).squaredNorm()
            : 1e6;
  }
  return sum;
}

}  // namespace

InitialPose compute_initial_pose(std::span<const Sighting> sightings) {
  if (sightings.size() > 2 && are_at_one_height(sightings)) {
    const auto pose = compute_pose_from_coplanar_lamps(sightings);
    if (!pose) return {FixStatus::degenerate, {}};
    return {FixStatus::ok, *pose};
  }
  const Sighting& first = find_farthest_from(sightings.front(), sightings);
  const TwoLampPoses pair = compute_two_lamp_poses(first, find_farthest_from(first, sightings));
  if (pair.count == 0) {
    return {pair.lamp_below_camera ? FixStatus::lamp_below_camera : FixStatus::degenerate, {}};
  }
  if (pair.count == 1) return {FixStatus::ok, pair.poses[0]};
  if (sightings.size() == 2) return {FixStatus::ambiguous, {}};
  const bool second = compute_disagreement(pair.poses[1], sightings) <
                      compute_disagreement(pair.poses[0], sightings);
  return {FixStatus::ok, pair.poses[second ? 1 : 0]};
}

std::optional<Pose> compute_pose_from_coplanar_lamps(std::span<const Sighting> sightings) {
  const auto similarity = fit_similarity_transform(
      sightings.size(), [&](std::size_t i) { return sightings[i].z; },
      [&](std::size_t i) -> Eigen::Vector2d { return sightings[i].lamp_m.head<2>(); });
  if (!similarity) return std::nullopt;
  double ceiling_m = 0;
  for (const Sighting& sighting : sightings) ceiling_m += sighting.lamp_m.z();
  ceiling_m /= static_cast<double>(sightings.size());
  const Eigen::Vector2d& c = similarity->factor;
  return Pose{{similarity->offset.x(), similarity->offset.y(), ceiling_m - c.norm()},
              std::atan2(c.y(), c.x())};
}

namespace {

/// Returns the lamp relative to the center of rotation at the readout time of its row, along the
/// axes of the camera in the middle of the image.
Eigen::Vector2d compute_lamp_from_center_m(const Sighting& sighting, double height_m,
                                           const MotionAtReadout& readout) {
  const double turn_rad = readout.motion.yaw_rate_rad_per_s * readout.time_s;
  return Eigen::Rotation2Dd(turn_rad) * (height_m * sighting.z + readout.arm_m);
}

}  // namespace

std::optional<Pose> compute_pose_at_known_height_and_yaw(const Sighting& sighting,
                                                         const HeightAndYaw& known,
                                                         const MotionAtReadout& readout) {
  const double height_m = sighting.lamp_m.z() - known.z_m;
  if (!(height_m > 0)) return std::nullopt;
  const Eigen::Vector2d lamp_from_camera_m =
      compute_lamp_from_center_m(sighting, height_m, readout) - readout.arm_m +
      readout.motion.velocity_m_per_s * readout.time_s;
  const Eigen::Vector2d s =
      sighting.lamp_m.head<2>() - Eigen::Rotation2Dd(known.yaw_rad) * lamp_from_camera_m;
  return Pose{{s.x(), s.y(), known.z_m}, known.yaw_rad};
}

Matrix4 compute_one_lamp_fix_covariance_from_pixel_noise(const Sighting& sighting,
                                                         const Pose& pose) {
  const Eigen::Matrix2d d_pixel_d_xy =
      sighting.d_pixel_d_z *
      project_lamp_with_jacobian(LevelPose(pose), sighting.lamp_m).d_z_d_state.leftCols<2>();
  const Eigen::Matrix2d d_xy_d_pixel = d_pixel_d_xy.inverse();
  Matrix4 covariance = Matrix4::Zero();
  covariance.topLeftCorner<2, 2>() =
      sighting.sigma_px * sighting.sigma_px * d_xy_d_pixel * d_xy_d_pixel.transpose();
  return covariance;
}

Matrix4 compute_one_lamp_fix_covariance_from_sensors(const Sighting& sighting, const Pose& pose,
                                                     const HeightAndYaw& known,
                                                     const MotionAtReadout& readout) {
  const double height_m = sighting.lamp_m.z() - pose.position_m.z();
  const double time_s = readout.time_s;
  const Eigen::Rotation2Dd world_from_level(pose.yaw_rad);
  const Eigen::Vector2d read_m = compute_lamp_from_center_m(sighting, height_m, readout);
  const Eigen::Vector2d lamp_m = (sighting.lamp_m - pose.position_m).head<2>();
  const auto quarter_turn = [](const Eigen::Vector2d& v) { return Eigen::Vector2d(-v.y(), v.x()); };
  // One column each: height, yaw, velocity along x and y, yaw rate.
  Eigen::Matrix<double, 4, 5> effect = Eigen::Matrix<double, 4, 5>::Zero();
  effect.col(0) << world_from_level *
                       (Eigen::Rotation2Dd(readout.motion.yaw_rate_rad_per_s * time_s) *
                        sighting.z),
      1, 0;
  effect.col(1) << -quarter_turn(lamp_m), 0, 1;
  effect.block<2, 2>(0, 2) = -time_s * world_from_level.toRotationMatrix();
  effect.block<2, 1>(0, 4) = -time_s * (world_from_level * quarter_turn(read_m));
  Eigen::Matrix<double, 5, 1> sd;
  sd << known.z_sd_m, known.yaw_sd_rad, readout.motion.velocity_sd_m_per_s,
      readout.motion.velocity_sd_m_per_s, readout.motion.yaw_rate_sd_rad_per_s;
  const Eigen::Matrix<double, 4, 5> by_sd = effect * sd.asDiagonal();
  return by_sd * by_sd.transpose();
}

Eigen::Matrix<double, 4, 3> compute_one_lamp_fix_jacobian_wrt_level_rotation(
    const Sighting& sighting, const Pose& pose) {
  Eigen::Matrix<double, 2, 3> d_z;
  d_z << compute_normalized_point_jacobian_wrt_tilt(sighting.z),
      Eigen::Vector2d(-sighting.z.y(), sighting.z.x());
  const LevelPose camera(pose);
  Eigen::Matrix<double, 4, 3> effect = Eigen::Matrix<double, 4, 3>::Zero();
  effect.topRows<2>() = -lamp_height_above_camera_m(camera, sighting.lamp_m) *
                        complex_product_matrix(camera.heading) * d_z;
  return effect;
}

}  // namespace vlp
