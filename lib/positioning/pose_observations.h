// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <cstddef>
#include <optional>
#include <span>

#include "../geometry/types.h"

namespace vlp {

/// Maximum number of observations in a frame.
inline constexpr std::size_t kMaxSightings = 256;

/// Observation of a lamp of the map by the camera, in the frame of its base ("body" in
/// pose_estimation.h).
struct LampObservation {
  /// Position P of the lamp in the world, m.
  Eigen::Vector3d lamp_m;
  /// Direction to the lamp along the axes of the body, unit length.
  Eigen::Vector3d ray;
  /// M: the residual is -M q / (a . q), in standard deviations. M ray = 0.
  Eigen::Matrix<double, 2, 3, Eigen::DontAlign> whitened_pixel_from_ray;
  double sigma_px;
  /// Readout time of the lamp's center, s, relative to time 0 of the body.
  double time_s;
  /// Axis a along which depths are measured: the ray, or the vertical for weights in the level
  /// plane.
  Eigen::Vector3d depth_axis;

  LampObservation() = default;
  LampObservation(const Eigen::Vector3d& lamp, const Eigen::Vector3d& unit_ray,
                  const Eigen::Matrix<double, 2, 3>& whitened, double sigma, double time)
      : lamp_m(lamp),
        ray(unit_ray),
        whitened_pixel_from_ray(whitened),
        sigma_px(sigma),
        time_s(time),
        depth_axis(unit_ray) {}
};

/// Computes M of a pixel from its standard deviation and the derivative of its ray, which may have
/// any length. Returns std::nullopt if the lens is not invertible there.
std::optional<Eigen::Matrix<double, 2, 3>> whiten_ray_jacobian(
    const Eigen::Vector3d& ray, const Eigen::Matrix<double, 3, 2>& d_ray_d_pixel, double sigma_px);

/// Makes the observation of a normalized point z = (x/z, y/z) by a level camera. `d_pixel_d_z`
/// weights the residuals of z.
LampObservation make_level_observation(const Eigen::Vector3d& lamp_m, const Eigen::Vector2d& z,
                                       const Eigen::Matrix2d& d_pixel_d_z, double sigma_px);

/// Lamps observed in one frame, or in several consecutive frames. The arrays have a fixed size, so
/// that no memory is allocated.
struct FrameObservations {
  std::array<LampObservation, kMaxSightings> sightings;
  std::array<int, kMaxSightings> ids;
  /// Horizontal distance from each lamp to the nearest other lamp of the map, m.
  std::array<double, kMaxSightings> nearest_m;
  std::size_t size = 0;
  /// Number of observations from the frame of the fix; they are at the start of the arrays. All
  /// other observations are from earlier frames.
  std::size_t num_current = 0;
  /// Covariance of each residual from noise of its pixel, unless `is_weighted_by_noise`: then it is
  /// the identity.
  std::array<Matrix2, kMaxSightings> noise;
  bool is_weighted_by_noise = true;
  /// True if every detection has a sigma_px.
  bool noise_is_stated = true;
  int unknown_lamps = 0;
  /// Number of rejected lamps, and their ids at the beginning of the array.
  int rejected_lamps = 0;
  std::array<int, kMaxSightings> rejected_ids;

  FrameObservations() {}

  std::span<const LampObservation> observations_span() const { return {sightings.data(), size}; }

  /// Adds an observation of the current frame.
  void add_current_observation(const LampObservation& observation, int id, double nearest_lamp_m) {
    sightings[size] = observation;
    ids[size] = id;
    nearest_m[size] = nearest_lamp_m;
    num_current = ++size;
  }

  /// Removes all observations except those in `kept`. The removed ones of the current frame count
  /// as rejected.
  void keep_observations(const std::bitset<kMaxSightings>& kept) {
    std::size_t next = 0, next_current = 0;
    for (std::size_t i = 0; i < size; ++i) {
      if (kept[i]) {
        sightings[next] = sightings[i];
        ids[next] = ids[i];
        if (!is_weighted_by_noise) noise[next] = noise[i];
        nearest_m[next++] = nearest_m[i];
        next_current += i < num_current;
      } else if (i < num_current) {
        rejected_ids[static_cast<std::size_t>(rejected_lamps++)] = ids[i];
      }
    }
    size = next;
    num_current = next_current;
  }
};

}  // namespace vlp
