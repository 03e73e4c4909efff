// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/rotation_axis.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <memory>

#include "calibration/rotation/fit_parts.h"
#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/rotation_residual.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"

namespace vlp {
namespace {

/// Residual of fit_rotation_axis(). Parameter blocks, in the world except for the first two:
///   zenith    normalized point in the camera (2)
///   lever arm (2)
///   lamp      horizontal position (2)
///   axis      horizontal position, and height of the camera (3)
///   yaw       (1)
struct AxisResidual {
  RotationResidual in_image;
  double lamp_z_m;

  template <typename T>
  bool operator()(const T* zenith, const T* lever_arm_m, const T* lamp_m, const T* axis_m,
                  const T* yaw_rad, T* residual) const {
    using std::cos, std::sin, std::sqrt;
    const T x = lamp_m[0] - axis_m[0], y = lamp_m[1] - axis_m[1];
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> in_level(c * x + s * y - lever_arm_m[0],
                                          c * y - s * x - lever_arm_m[1], lamp_z_m - axis_m[2]);
    // camera_from_level: the transpose of level_from_zenith(), the smallest turn of n to +Z.
    const T nz = 1.0 / sqrt(1.0 + zenith[0] * zenith[0] + zenith[1] * zenith[1]);
    const Eigen::Matrix<T, 3, 1> n(zenith[0] * nz, zenith[1] * nz, nz);
    const T across = (n[0] * in_level[0] + n[1] * in_level[1]) / (1.0 + nz);
    const T lift = in_level[2] - across;
    const Eigen::Matrix<T, 3, 1> in_camera(in_level[0] + n[0] * lift, in_level[1] + n[1] * lift,
                                           nz * in_level[2] - across * (1.0 + nz));
    in_image(in_camera, residual);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const RotationObservation& observation,
                                                     double lamp_z_m) {
    return std::make_unique<ceres::AutoDiffCostFunction<AxisResidual, 2, 2, 2, 2, 3, 1>>(
        new AxisResidual{RotationResidual(observation), lamp_z_m});
  }
};

/// Unknowns of the fit, in the world.
struct State {
  Eigen::Vector2d zenith;
  Eigen::Vector2d lever_arm_m;
  std::vector<Eigen::Vector2d> lamps_m;
  std::vector<Eigen::Vector3d> axes_m;
  std::vector<double> yaws_rad;
};

State initialize_state(const RotationCaptures& rotation) {
  State state{rotation.zenith_in_camera.hnormalized(),
              rotation.lever_arm_m,
              {},
              {},
              collect_yaws(rotation)};
  for (const Lamp& lamp : rotation.lamps) state.lamps_m.emplace_back(lamp.position_m.head<2>());
  for (const RotationHeight& height : rotation.heights) {
    state.axes_m.emplace_back(height.axis_m.x(), height.axis_m.y(), height.z_m);
  }
  return state;
}

void add_residuals(RobustFit& fit, const RotationCaptures& rotation, bool lever_arm, State& state) {
  for (const RotationObservation& observation : rotation.observations) {
    const std::size_t height = rotation.captures[observation.capture].height;
    fit.add(AxisResidual::create(observation, rotation.lamps[observation.lamp].position_m.z()),
            {state.zenith.data(), state.lever_arm_m.data(), state.lamps_m[observation.lamp].data(),
             state.axes_m[height].data(), &state.yaws_rad[observation.capture]});
  }
  // Residuals do not determine position and yaw of the world, nor its scale if all lamps have one
  // height.
  fit.fix_parameter(state.axes_m.front().data());
  fit.fix_one_of(pointers_to(state.yaws_rad));
  if (!lever_arm) fit.fix_parameter(state.lever_arm_m.data());
}

/// Scales the state to the size of the map. Returns true if the scale was already equal.
bool scale_to_map(const RotationCaptures& rotation, State& state) {
  const auto similarity = fit_similarity(
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
struct MapEffect {
  /// Covariance of (zenith, lever arm).
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  /// Fraction of the squared residuals that is not from the map.
  double noise_fraction = 1;
};

/// Derivatives of the fit with respect to the heights of the lamps and, in the last column, to z_1.
/// The height z_1 of the first axis is fixed in the fit. For the unknowns x,
///   dx = -(J'J)^-1 J' (r_Z dZ + r_z1 dz_1)
struct HeightDerivatives {
  /// Row of each estimated parameter in `jacobian_wrt_heights`.
  std::map<const double*, Eigen::Index> rows;
  Eigen::MatrixXd jacobian_wrt_heights;
  /// Quadratic form: the sum of the squared residuals grows by d' squares d.
  Eigen::MatrixXd squares;
  double squared_residuals = 0;

  Eigen::MatrixXd rows_for(const double* point) const {
    return jacobian_wrt_heights.middleRows<2>(rows.at(point));
  }
};

HeightDerivatives differentiate_by_heights(const RobustFit& fit, const RotationCaptures& rotation) {
  HeightDerivatives result;
  const auto fixed_parameters = fit.fixed_parameters();
  const auto all = fit.jacobians();
  Eigen::Index unknowns = 0;
  for (const auto& at : all) {
    for (std::size_t k = 0; k < at.parameters.size(); ++k) {
      const double* parameter = at.parameters[k];
      if (std::find(fixed_parameters.begin(), fixed_parameters.end(), parameter) !=
          fixed_parameters.end())
        continue;
      if (result.rows.emplace(parameter, unknowns).second)
        unknowns += at.d_residual_d_parameter[k].cols();
    }
  }
  const auto z_1 = static_cast<Eigen::Index>(rotation.lamps.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, z_1 + 1);
  result.squares = Eigen::MatrixXd::Zero(z_1 + 1, z_1 + 1);
  for (const auto& at : all) {
    const RotationObservation& observation = rotation.observations[at.residual];
    constexpr std::size_t axis = 3;  // in the order of AxisResidual
    // The residual depends on the height of the lamp minus that of the axis.
    Eigen::MatrixXd jacobian_wrt_heights = Eigen::MatrixXd::Zero(2, z_1 + 1);
    jacobian_wrt_heights.col(static_cast<Eigen::Index>(observation.lamp)) =
        -at.d_residual_d_parameter[axis].col(2);
    if (rotation.captures[observation.capture].height == 0) {
      jacobian_wrt_heights.col(z_1) = at.d_residual_d_parameter[axis].col(2);
    }
    result.squares += jacobian_wrt_heights.transpose() * jacobian_wrt_heights;
    result.squared_residuals += std::pow(fit.lengths()[at.residual], 2);
    for (std::size_t j = 0; j < at.parameters.size(); ++j) {
      const auto row = result.rows.find(at.parameters[j]);
      if (row == result.rows.end()) continue;
      const Eigen::MatrixXd transposed = at.d_residual_d_parameter[j].transpose();
      right.middleRows(row->second, transposed.rows()) -= transposed * jacobian_wrt_heights;
      for (std::size_t k = 0; k < at.parameters.size(); ++k) {
        const auto column = result.rows.find(at.parameters[k]);
        if (column == result.rows.end()) continue;
        normal.block(row->second, column->second, transposed.rows(),
                     at.d_residual_d_parameter[k].cols()) +=
            transposed * at.d_residual_d_parameter[k];
      }
    }
  }
  result.jacobian_wrt_heights = solve_symmetric(normal, right);
  result.squares -= right.transpose() * result.jacobian_wrt_heights;
  return result;
}

/// Propagates the errors of the map. scale_to_map() chooses z_1 such that sum q . dp = sum q . dP
/// for errors dP of the map, where q are the positions of the lamps relative to their mean.
MapEffect propagate_map(const RobustFit& fit, const RotationCaptures& rotation,
                        const State& state) {
  const HeightDerivatives at = differentiate_by_heights(fit, rotation);
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) middle_m += lamp_m;
  middle_m /= static_cast<double>(state.lamps_m.size());
  Eigen::RowVectorXd size = Eigen::RowVectorXd::Zero(at.jacobian_wrt_heights.cols());
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) {
    if (!at.rows.contains(lamp_m.data())) continue;
    size += (lamp_m - middle_m).transpose() * at.rows_for(lamp_m.data());
  }
  Eigen::MatrixXd jacobian_wrt_heights(4, at.jacobian_wrt_heights.cols());
  jacobian_wrt_heights << at.rows_for(state.zenith.data()), at.rows_for(state.lever_arm_m.data());
  // Errors of (heights, z_1) that one lamp causes by its error in height and along the ceiling.
  MapEffect effect;
  double of_map = 0;
  const Eigen::Index z_1 = size.size() - 1;
  for (std::size_t i = 0; i < rotation.lamps.size(); ++i) {
    const auto lamp = static_cast<Eigen::Index>(i);
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(size.size(), 2);
    errors(lamp, 0) = 1;
    errors(z_1, 0) = -size[lamp] / size[z_1];
    errors(z_1, 1) = (state.lamps_m[i] - middle_m).norm() / size[z_1];
    errors *= rotation.lamps[i].sd_m.value_or(0);
    const Eigen::MatrixXd changes = jacobian_wrt_heights * errors;
    effect.covariance += changes * changes.transpose();
    of_map += errors.cwiseProduct(at.squares * errors).sum();
  }
  if (at.squared_residuals > 0) {
    effect.noise_fraction = std::max(0.0, 1 - of_map / at.squared_residuals);
  }
  return effect;
}

/// Fits the axis with an estimated lever arm, or with a lever arm of zero.
RotationFit fit_axis(const RotationCaptures& rotation, const Camera& camera, bool lever_arm) {
  State state = initialize_state(rotation);
  if (!lever_arm) state.lever_arm_m.setZero();
  RobustFit fit(rotation.median_sigma_px.has_value());
  add_residuals(fit, rotation, lever_arm, state);
  RotationFit result;
  constexpr int max_iterations = 10;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    result.converged = iteration == 0 ? fit.solve() : fit.refine();
    if (!result.converged) return result;
    if (!lever_arm || scale_to_map(rotation, state)) break;
  }
  auto zenith_covariance = fit.covariance(state.zenith.data());
  const bool map_is_exact =
      std::all_of(rotation.lamps.begin(), rotation.lamps.end(),
                  [](const Lamp& lamp) { return !(lamp.sd_m.value_or(0) > 0); });
  // Without a lever arm, any height of a lamp explains its observations.
  const MapEffect map = lever_arm && zenith_covariance && !map_is_exact
                            ? propagate_map(fit, rotation, state)
                            : MapEffect();
  if (zenith_covariance) {
    *zenith_covariance =
        map.noise_fraction * *zenith_covariance + map.covariance.topLeftCorner<2, 2>();
  }
  result.center =
      make_rotation_center(state.zenith, RotationModel::tilt, camera, zenith_covariance);
  if (lever_arm) {
    result.center.lever_arm_m = state.lever_arm_m;
    result.center.lever_arm_covariance = fit.covariance(state.lever_arm_m.data());
    const auto with_zenith = fit.covariance(state.lever_arm_m.data(), state.zenith.data());
    if (auto& covariance = result.center.lever_arm_covariance) {
      *covariance = map.noise_fraction * *covariance + map.covariance.bottomRightCorner<2, 2>();
    }
    if (zenith_covariance && with_zenith) {
      result.center.lever_arm_by_zenith =
          (map.noise_fraction * *with_zenith + map.covariance.bottomLeftCorner<2, 2>()) *
          zenith_covariance->inverse();
    }
  }
  set_statistics(result, fit, rotation);
  result.yaws_rad = std::move(state.yaws_rad);
  return result;
}

}  // namespace

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
