// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_fit.h"

#include <ceres/ceres.h>

#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <memory>
#include <utility>

#include "calibration/rotation/robust_fit.h"
#include "geometry/similarity.h"

namespace vlp {
namespace {

/// Residual of a lamp observation in the image, divided by sigma_px. Parameter blocks, in the world
/// except for the first two:
///   zenith    normalized point in the camera (2)
///   lever arm (2)
///   lamp      horizontal position (2)
///   axis      horizontal position, and height of the camera (3)
///   yaw       (1)
///
/// For a lamp at point p in the camera frame, observed along the unit ray v, to first order in the
/// distance and without evaluating the lens:
///   residual = J p / (p . v) / sigma
/// J is the derivative of the pixel at v, with J v = 0.
struct RotationResidual {
  Eigen::Vector3d ray;
  Eigen::Matrix<double, 2, 3> weighted;
  double lamp_z_m;

  template <typename T>
  bool operator()(const T* zenith, const T* lever_arm_m, const T* lamp_m, const T* axis_m,
                  const T* yaw_rad, T* residual) const {
    using std::cos, std::sin, std::sqrt;
    const T x = lamp_m[0] - axis_m[0], y = lamp_m[1] - axis_m[1];
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> in_level(c * x + s * y - lever_arm_m[0],
                                          c * y - s * x - lever_arm_m[1], lamp_z_m - axis_m[2]);
    // camera_from_level: the transpose of level_rotation_from_zenith(), the smallest turn of n to
    // +Z.
    const T nz = 1.0 / sqrt(1.0 + zenith[0] * zenith[0] + zenith[1] * zenith[1]);
    const Eigen::Matrix<T, 3, 1> n(zenith[0] * nz, zenith[1] * nz, nz);
    const T across = (n[0] * in_level[0] + n[1] * in_level[1]) / (1.0 + nz);
    const T lift = in_level[2] - across;
    const Eigen::Matrix<T, 3, 1> in_camera(in_level[0] + n[0] * lift, in_level[1] + n[1] * lift,
                                           nz * in_level[2] - across * (1.0 + nz));
    // Keeps the residual finite for points to the side or behind the camera.
    constexpr double min_cosine = 0.1;
    const T along = in_camera.dot(ray.cast<T>()), min_along = in_camera.norm() * T(min_cosine);
    Eigen::Map<Eigen::Matrix<T, 2, 1>> at(residual);
    at = weighted.cast<T>() * in_camera / (along > min_along ? along : min_along);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const RotationObservation& observation,
                                                     double lamp_z_m) {
    return std::make_unique<ceres::AutoDiffCostFunction<RotationResidual, 2, 2, 2, 2, 3, 1>>(
        new RotationResidual{observation.ray, observation.d_pixel_d_ray / observation.sigma_px,
                             lamp_z_m});
  }
};
/// Index of the axis among the parameter blocks.
constexpr Eigen::Index kAxisBegin = 6;

/// Unknowns of a fit, in the world.
struct State {
  Eigen::Vector2d zenith;
  Eigen::Vector2d lever_arm_m;
  std::vector<Eigen::Vector2d> lamps_m;
  std::vector<Eigen::Vector3d> axes_m;
  std::vector<double> yaws_rad;
};

State initialize_axis_state(const RotationCaptures& rotation) {
  State state{rotation.zenith_in_camera.hnormalized(),
              rotation.lever_arm_m,
              {},
              {},
              collect_capture_yaws_rad(rotation)};
  for (const Lamp& lamp : rotation.lamps) state.lamps_m.emplace_back(lamp.position_m.head<2>());
  for (const RotationHeight& height : rotation.heights) {
    state.axes_m.emplace_back(height.axis_m.x(), height.axis_m.y(), height.z_m);
  }
  return state;
}

void add_residual_blocks(RobustFit& fit, const RotationCaptures& rotation, bool lever_arm,
                         State& state) {
  for (const RotationObservation& observation : rotation.observations) {
    const std::size_t height = rotation.captures[observation.capture].height;
    fit.add_residual_block(
        RotationResidual::create(observation, rotation.lamps[observation.lamp].position_m.z()),
        {state.zenith.data(), state.lever_arm_m.data(), state.lamps_m[observation.lamp].data(),
         state.axes_m[height].data(), &state.yaws_rad[observation.capture]});
  }
  // Residuals do not determine position and yaw of the world, nor its scale if all lamps have one
  // height.
  fit.set_parameter_constant(state.axes_m.front().data());
  std::vector<const double*> yaws;
  for (const double& yaw_rad : state.yaws_rad) yaws.push_back(&yaw_rad);
  fit.set_first_used_parameter_constant(std::move(yaws));
  if (!lever_arm) fit.set_parameter_constant(state.lever_arm_m.data());
}

/// Scales the state to the size of the map. Returns true if the scale was already equal.
bool scale_state_to_map(const RotationCaptures& rotation, State& state) {
  const auto similarity = fit_similarity_transform(
      rotation.lamps.size(), [&](std::size_t i) { return state.lamps_m[i]; },
      [&](std::size_t i) { return Eigen::Vector2d(rotation.lamps[i].position_m.head<2>()); });
  if (!similarity) return true;
  double lamps_z_m = 0;
  for (const Lamp& lamp : rotation.lamps) lamps_z_m += lamp.position_m.z();
  lamps_z_m /= static_cast<double>(rotation.lamps.size());
  const double scale = similarity->factor.norm();
  const Eigen::Vector3d fixed(state.axes_m[0].x(), state.axes_m[0].y(), lamps_z_m);
  for (Eigen::Vector3d& axis_m : state.axes_m) axis_m = fixed + scale * (axis_m - fixed);
  for (Eigen::Vector2d& lamp_m : state.lamps_m) {
    lamp_m = fixed.head<2>() + scale * (lamp_m - fixed.head<2>());
  }
  state.lever_arm_m *= scale;
  constexpr double tolerance = 1e-9;
  return std::abs(scale - 1) < tolerance;
}

bool has_lamps_at_several_heights(const RotationCaptures& rotation) {
  const auto [lowest, highest] = std::minmax_element(
      rotation.lamps.begin(), rotation.lamps.end(),
      [](const Lamp& a, const Lamp& b) { return a.position_m.z() < b.position_m.z(); });
  const double height_m = highest->position_m.z() - rotation.heights.front().z_m;
  return highest->position_m.z() - lowest->position_m.z() > kMinHeightGapFraction * height_m;
}

bool determines_lever_arm(const RotationCenter& center, const RotationCaptures& rotation) {
  if (!center.covariance || !center.lever_arm_covariance) return false;
  const double height_m = rotation.lamps.front().position_m.z() - rotation.heights.front().z_m;
  return std::sqrt(center.lever_arm_covariance->diagonal().maxCoeff()) <=
         kMaxLeverArmSdFraction * height_m;
}

/// Effect of errors of the map, by its sd_m, on the fit: errors of the lamps' heights, and of the
/// size of the lamp pattern along the ceiling.
struct MapErrorPropagation {
  /// Covariance of (zenith, lever arm).
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Fraction of the squared residuals that is not from the map.
  double noise_fraction = 1;
};

/// Propagates the errors of the map to the unknowns x of the fit. For errors dZ of the heights of
/// the lamps and dz_1 of the height of the first axis, which is fixed in the fit,
///   dx = -(J'J)^-1 J' (r_Z dZ + r_z1 dz_1)
/// scale_state_to_map() chooses z_1 such that sum q . dp = sum q . dP for errors dP of the map,
/// where q are the positions of the lamps relative to their mean.
MapErrorPropagation propagate_map_errors(const RobustFit& fit, const RobustFit::Linearization& at,
                                         const RotationCaptures& rotation, const State& state) {
  const auto z_1 = static_cast<Eigen::Index>(rotation.lamps.size());
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(at.inverse.rows(), z_1 + 1);
  // Quadratic form: the sum of the squared residuals grows by d' squares d.
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(z_1 + 1, z_1 + 1);
  for (const auto& [index, unknowns, jacobian] : at.residuals) {
    const RotationObservation& observation = rotation.observations[index];
    // The residual depends on the height of the lamp minus that of the axis.
    const Eigen::Vector2d by_axis_z = jacobian.col(kAxisBegin + 2);
    Eigen::Matrix2Xd by_heights = Eigen::Matrix2Xd::Zero(2, z_1 + 1);
    by_heights.col(static_cast<Eigen::Index>(observation.lamp)) = -by_axis_z;
    if (rotation.captures[observation.capture].height == 0) by_heights.col(z_1) = by_axis_z;
    squares += by_heights.transpose() * by_heights;
    gradient(unknowns, Eigen::all) += jacobian.transpose() * by_heights;
  }
  const Eigen::MatrixXd by_heights = -at.inverse * gradient;
  squares += gradient.transpose() * by_heights;
  const auto rows_of = [&](const Eigen::Vector2d& point) {
    return by_heights.middleRows<2>(at.first_unknown.at(point.data()));
  };
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) middle_m += lamp_m;
  middle_m /= static_cast<double>(state.lamps_m.size());
  Eigen::RowVectorXd size = Eigen::RowVectorXd::Zero(z_1 + 1);
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) {
    if (!at.first_unknown.contains(lamp_m.data())) continue;
    size += (lamp_m - middle_m).transpose() * rows_of(lamp_m);
  }
  Eigen::MatrixXd center_by_heights(4, z_1 + 1);
  center_by_heights << rows_of(state.zenith), rows_of(state.lever_arm_m);
  // Errors of (heights, z_1) that one lamp causes by its error in height and along the ceiling.
  MapErrorPropagation effect;
  double of_map = 0;
  for (std::size_t i = 0; i < rotation.lamps.size(); ++i) {
    const double sd_m = rotation.lamps[i].sd_m.value_or(0);
    if (sd_m == 0) continue;
    const auto lamp = static_cast<Eigen::Index>(i);
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(size.size(), 2);
    errors(lamp, 0) = 1;
    errors(z_1, 0) = -size[lamp] / size[z_1];
    errors(z_1, 1) = (state.lamps_m[i] - middle_m).norm() / size[z_1];
    errors *= sd_m;
    const Eigen::MatrixXd changes = center_by_heights * errors;
    effect.covariance += changes * changes.transpose();
    of_map += errors.cwiseProduct(squares * errors).sum();
  }
  const double squared_residuals = at.variance * fit.degrees_of_freedom();
  if (squared_residuals > 0) effect.noise_fraction = std::max(0.0, 1 - of_map / squared_residuals);
  return effect;
}

/// Sets residual_px, outliers and used_observations of `result` from a fit.
/// @pre the residuals of `fit` are the observations of `rotation`, in the same order
void set_residual_statistics(RotationFit& result, const RobustFit& fit,
                             const RotationCaptures& rotation) {
  double squares_px2 = 0;
  for (std::size_t i = 0; i < rotation.observations.size(); ++i) {
    const double distance_px = fit.residual_norms()[i] * rotation.observations[i].sigma_px;
    if (fit.residual_inlier_flags()[i]) {
      result.used_observations.push_back(i);
      squares_px2 += distance_px * distance_px;
    } else {
      result.outliers.push_back({i, distance_px});
    }
  }
  const int freedom = fit.degrees_of_freedom();
  result.residual_px = freedom > 0 ? std::sqrt(squares_px2 / freedom) : 0;
}

/// Fits the axis with an estimated lever arm, or with a lever arm of zero.
RotationFit fit_axis(const RotationCaptures& rotation, const Camera& camera, bool lever_arm) {
  State state = initialize_axis_state(rotation);
  if (!lever_arm) state.lever_arm_m.setZero();
  RobustFit fit(rotation.median_sigma_px.has_value());
  add_residual_blocks(fit, rotation, lever_arm, state);
  RotationFit result;
  constexpr int max_iterations = 10;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    result.converged = iteration == 0 ? fit.solve_robust_fit() : fit.refine_fit_without_outliers();
    if (!result.converged) return result;
    if (!lever_arm || scale_state_to_map(rotation, state)) break;
  }
  std::optional<Matrix2> zenith_covariance, arm_covariance, arm_by_zenith;
  if (const auto at = fit.linearize_used_residuals()) {
    // Without a lever arm, any height of a lamp explains its observations.
    const MapErrorPropagation map =
        lever_arm ? propagate_map_errors(fit, *at, rotation, state) : MapErrorPropagation();
    const double *const zenith = state.zenith.data(), *const arm = state.lever_arm_m.data();
    zenith_covariance =
        map.noise_fraction * at->covariance(zenith, zenith) + map.covariance.topLeftCorner<2, 2>();
    if (lever_arm) {
      arm_covariance =
          map.noise_fraction * at->covariance(arm, arm) + map.covariance.bottomRightCorner<2, 2>();
      arm_by_zenith = (map.noise_fraction * at->covariance(arm, zenith) +
                       map.covariance.bottomLeftCorner<2, 2>()) *
                      zenith_covariance->inverse();
    }
  }
  result.center = make_rotation_center_from_axis_point(state.zenith, RotationModel::tilt, camera,
                                                       zenith_covariance);
  if (lever_arm) result.center.lever_arm_m = state.lever_arm_m;
  result.center.lever_arm_covariance = arm_covariance;
  result.center.lever_arm_jacobian_wrt_zenith = arm_by_zenith;
  set_residual_statistics(result, fit, rotation);
  result.yaws_rad = std::move(state.yaws_rad);
  return result;
}

}  // namespace

Tilt compute_tilt_from_rotation_center(const RotationCenter& center) {
  const Eigen::Vector3d& up = center.zenith_in_camera;
  return {std::atan2(up.head<2>().norm(), up.z()), std::atan2(up.y(), up.x())};
}

std::optional<double> compute_rotation_axis_sd_rad(const RotationCenter& center,
                                                   const Camera& camera) {
  if (!center.covariance) return std::nullopt;
  const Eigen::Vector2d focal_px = camera.focal_px();
  const Eigen::Vector2d variances =
      center.covariance->diagonal().cwiseQuotient(focal_px.cwiseAbs2());
  return std::sqrt(variances.mean());
}

Eigen::Vector2d undistorted_pixel_from_normalized_point(const Camera& camera,
                                                        const Eigen::Vector2d& z) {
  const Eigen::Vector2d focal_px = camera.focal_px();
  return focal_px.cwiseProduct(z) + camera.principal_point_px();
}

RotationCenter make_rotation_center_from_axis_point(const Eigen::Vector2d& z, RotationModel model,
                                                    const Camera& camera,
                                                    const std::optional<Matrix2>& covariance) {
  const Eigen::Vector2d focal_px = camera.focal_px();
  RotationCenter center;
  center.model = model;
  center.center_px = undistorted_pixel_from_normalized_point(camera, z);
  center.zenith_in_camera = z.homogeneous().normalized();
  if (covariance) {
    center.covariance = covariance->cwiseProduct((focal_px * focal_px.transpose()).eval());
  }
  return center;
}

std::vector<double> collect_capture_yaws_rad(const RotationCaptures& rotation) {
  std::vector<double> yaws_rad;
  yaws_rad.reserve(rotation.captures.size());
  for (const RotationCapture& capture : rotation.captures) yaws_rad.push_back(capture.yaw_rad);
  return yaws_rad;
}

RotationFit fit_rotation_center_to_all_lamps(const RotationCaptures& rotation,
                                             const Camera& camera) {
  assert(rotation.status == RotationStatus::ok);
  // The model of the axis fit, with an exactly level camera, the axis at the origin, lamps at
  // height 1, and the center as minus the lever arm. Each height has its own lamps.
  State state{{0, 0},
              -rotation.zenith_in_camera.hnormalized(),
              {},
              {{0, 0, 0}},
              collect_capture_yaws_rad(rotation)};
  for (const RotationHeight& height : rotation.heights) {
    for (const Lamp& lamp : rotation.lamps) {
      state.lamps_m.emplace_back((lamp.position_m.head<2>() - height.axis_m) /
                                 (lamp.position_m.z() - height.z_m));
    }
  }
  RobustFit fit(rotation.median_sigma_px.has_value());
  std::vector<std::vector<const double*>> yaws_at(rotation.heights.size());
  for (std::size_t i = 0; i < state.yaws_rad.size(); ++i) {
    yaws_at[rotation.captures[i].height].push_back(&state.yaws_rad[i]);
  }
  for (const RotationObservation& observation : rotation.observations) {
    const std::size_t height = rotation.captures[observation.capture].height;
    const std::size_t lamp = height * rotation.lamps.size() + observation.lamp;
    fit.add_residual_block(
        RotationResidual::create(observation, 1),
        {state.zenith.data(), state.lever_arm_m.data(), state.lamps_m[lamp].data(),
         state.axes_m.front().data(), &state.yaws_rad[observation.capture]});
  }
  fit.set_parameter_constant(state.zenith.data());
  fit.set_parameter_constant(state.axes_m.front().data());
  for (auto& yaws : yaws_at) fit.set_first_used_parameter_constant(std::move(yaws));
  RotationFit result;
  result.converged = fit.solve_robust_fit();
  if (!result.converged) return result;
  std::optional<Matrix2> covariance;
  if (const auto at = fit.linearize_used_residuals()) {
    covariance = at->covariance(state.lever_arm_m.data(), state.lever_arm_m.data());
  }
  result.center = make_rotation_center_from_axis_point(-state.lever_arm_m, RotationModel::shift,
                                                       camera, covariance);
  set_residual_statistics(result, fit, rotation);
  result.yaws_rad = std::move(state.yaws_rad);
  return result;
}

RotationFit fit_rotation_axis(const RotationCaptures& rotation, const Camera& camera) {
  assert(rotation.status == RotationStatus::ok);
  RotationFit result;
  if (rotation.heights.size() > 1) {
    result = fit_axis(rotation, camera, true);
  } else {
    if (has_lamps_at_several_heights(rotation)) result = fit_axis(rotation, camera, true);
    if (!determines_lever_arm(result.center, rotation)) result = fit_axis(rotation, camera, false);
  }
  if (!result.converged) return result;
  // The model is exact. Large residuals mean that the captures are no rotation about one axis.
  constexpr double max_residual_fraction = 0.007, max_noise_ratio = 4;
  const double max_px = std::max(max_residual_fraction * camera.focal_px().x(),
                                 max_noise_ratio * rotation.median_sigma_px.value_or(0));
  return result.residual_px > max_px ? RotationFit() : result;
}

}  // namespace vlp
