// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/turning_axis.h"

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
#include "calibration/rotation/spot_residual.h"
#include "geometry/similarity.h"
#include "geometry/symmetric.h"

namespace vlp {
namespace {

/// Residual of fit_turning_axis(). Parameter blocks, in the world except for the first two:
///   zenith    normalized point in the camera (2)
///   lever arm (2)
///   lamp      horizontal position (2)
///   axis      horizontal position, and height of the camera (3)
///   yaw       (1)
struct AxisResidual {
  SpotResidual in_image;
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

  static std::unique_ptr<ceres::CostFunction> create(const SpotObservation& sighting,
                                                     double lamp_z_m) {
    return std::make_unique<ceres::AutoDiffCostFunction<AxisResidual, 2, 2, 2, 2, 3, 1>>(
        new AxisResidual{SpotResidual(sighting), lamp_z_m});
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

State start_from(const SpotCaptures& spot) {
  State state{spot.zenith_in_camera.hnormalized(), spot.lever_arm_m, {}, {}, yaws_of(spot)};
  for (const Lamp& lamp : spot.lamps) state.lamps_m.emplace_back(lamp.position_m.head<2>());
  for (const SpotHeight& height : spot.heights) {
    state.axes_m.emplace_back(height.axis_m.x(), height.axis_m.y(), height.z_m);
  }
  return state;
}

void add_residuals(RobustFit& fit, const SpotCaptures& spot, bool lever_arm, State& state) {
  for (const SpotObservation& sighting : spot.sightings) {
    const std::size_t height = spot.captures[sighting.capture].height;
    fit.add(AxisResidual::create(sighting, spot.lamps[sighting.lamp].position_m.z()),
            {state.zenith.data(), state.lever_arm_m.data(), state.lamps_m[sighting.lamp].data(),
             state.axes_m[height].data(), &state.yaws_rad[sighting.capture]});
  }
  // Residuals do not determine position and yaw of the world, nor its scale if all lamps have one
  // height.
  fit.hold(state.axes_m.front().data());
  fit.hold_one_of(pointers_to(state.yaws_rad));
  if (!lever_arm) fit.hold(state.lever_arm_m.data());
}

/// Scales the state to the size of the map. Returns true if the scale was already equal.
bool scale_to_map(const SpotCaptures& spot, State& state) {
  const auto similarity = fit_similarity(
      spot.lamps.size(), [&](std::size_t i) { return state.lamps_m[i]; },
      [&](std::size_t i) { return Eigen::Vector2d(spot.lamps[i].position_m.head<2>()); });
  if (!similarity) return true;
  double lamps_z_m = 0;
  for (const Lamp& lamp : spot.lamps) lamps_z_m += lamp.position_m.z();
  lamps_z_m /= static_cast<double>(spot.lamps.size());
  const double scale = similarity->factor.norm();
  const Eigen::Vector3d fixed(state.axes_m[0].x(), state.axes_m[0].y(), lamps_z_m);
  for (Eigen::Vector3d& axis_m : state.axes_m) axis_m = fixed + scale * (axis_m - fixed);
  for (Eigen::Vector2d& lamp_m : state.lamps_m) {
    lamp_m = fixed.head<2>() + scale * (lamp_m - fixed.head<2>());
  }
  state.lever_arm_m *= scale;
  constexpr double same = 1e-9;
  return std::abs(scale - 1) < same;
}

bool lamps_at_several_heights(const SpotCaptures& spot) {
  const auto [lowest, highest] = std::minmax_element(
      spot.lamps.begin(), spot.lamps.end(),
      [](const Lamp& a, const Lamp& b) { return a.position_m.z() < b.position_m.z(); });
  const double height_m = highest->position_m.z() - spot.heights.front().z_m;
  return highest->position_m.z() - lowest->position_m.z() > kLeastGap * height_m;
}

bool tells_lever_arm(const RotationCenter& center, const SpotCaptures& spot) {
  if (!center.covariance || !center.lever_arm_covariance) return false;
  const double height_m = spot.lamps.front().position_m.z() - spot.heights.front().z_m;
  return std::sqrt(center.lever_arm_covariance->diagonal().maxCoeff()) <= kLooseLeverArm * height_m;
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
  /// Row of each estimated parameter in `by_heights`.
  std::map<const double*, Eigen::Index> rows;
  Eigen::MatrixXd by_heights;
  /// Quadratic form: the sum of the squared residuals grows by d' squares d.
  Eigen::MatrixXd squares;
  double squared_residuals = 0;

  Eigen::MatrixXd of(const double* point) const { return by_heights.middleRows<2>(rows.at(point)); }
};

HeightDerivatives differentiate_by_heights(const RobustFit& fit, const SpotCaptures& spot) {
  HeightDerivatives result;
  const auto held = fit.held();
  const auto all = fit.jacobians();
  Eigen::Index unknowns = 0;
  for (const auto& at : all) {
    for (std::size_t k = 0; k < at.parameters.size(); ++k) {
      const double* parameter = at.parameters[k];
      if (std::find(held.begin(), held.end(), parameter) != held.end()) continue;
      if (result.rows.emplace(parameter, unknowns).second) unknowns += at.by_parameter[k].cols();
    }
  }
  const auto z_1 = static_cast<Eigen::Index>(spot.lamps.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(unknowns, z_1 + 1);
  result.squares = Eigen::MatrixXd::Zero(z_1 + 1, z_1 + 1);
  for (const auto& at : all) {
    const SpotObservation& sighting = spot.sightings[at.residual];
    constexpr std::size_t axis = 3;  // in the order of AxisResidual
    // The residual depends on the height of the lamp minus that of the axis.
    Eigen::MatrixXd by_heights = Eigen::MatrixXd::Zero(2, z_1 + 1);
    by_heights.col(static_cast<Eigen::Index>(sighting.lamp)) = -at.by_parameter[axis].col(2);
    if (spot.captures[sighting.capture].height == 0) {
      by_heights.col(z_1) = at.by_parameter[axis].col(2);
    }
    result.squares += by_heights.transpose() * by_heights;
    result.squared_residuals += std::pow(fit.lengths()[at.residual], 2);
    for (std::size_t j = 0; j < at.parameters.size(); ++j) {
      const auto row = result.rows.find(at.parameters[j]);
      if (row == result.rows.end()) continue;
      const Eigen::MatrixXd transposed = at.by_parameter[j].transpose();
      right.middleRows(row->second, transposed.rows()) -= transposed * by_heights;
      for (std::size_t k = 0; k < at.parameters.size(); ++k) {
        const auto column = result.rows.find(at.parameters[k]);
        if (column == result.rows.end()) continue;
        normal.block(row->second, column->second, transposed.rows(), at.by_parameter[k].cols()) +=
            transposed * at.by_parameter[k];
      }
    }
  }
  result.by_heights = solve_symmetric(normal, right);
  result.squares -= right.transpose() * result.by_heights;
  return result;
}

/// Propagates the errors of the map. scale_to_map() chooses z_1 such that sum q . dp = sum q . dP
/// for errors dP of the map, where q are the positions of the lamps relative to their mean.
MapEffect propagate_map(const RobustFit& fit, const SpotCaptures& spot, const State& state) {
  const HeightDerivatives at = differentiate_by_heights(fit, spot);
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) middle_m += lamp_m;
  middle_m /= static_cast<double>(state.lamps_m.size());
  Eigen::RowVectorXd size = Eigen::RowVectorXd::Zero(at.by_heights.cols());
  for (const Eigen::Vector2d& lamp_m : state.lamps_m) {
    if (!at.rows.contains(lamp_m.data())) continue;
    size += (lamp_m - middle_m).transpose() * at.of(lamp_m.data());
  }
  Eigen::MatrixXd by_heights(4, at.by_heights.cols());
  by_heights << at.of(state.zenith.data()), at.of(state.lever_arm_m.data());
  // Errors of (heights, z_1) that one lamp causes by its error in height and along the ceiling.
  MapEffect effect;
  double of_map = 0;
  const Eigen::Index z_1 = size.size() - 1;
  for (std::size_t i = 0; i < spot.lamps.size(); ++i) {
    const auto lamp = static_cast<Eigen::Index>(i);
    Eigen::MatrixXd errors = Eigen::MatrixXd::Zero(size.size(), 2);
    errors(lamp, 0) = 1;
    errors(z_1, 0) = -size[lamp] / size[z_1];
    errors(z_1, 1) = (state.lamps_m[i] - middle_m).norm() / size[z_1];
    errors *= spot.lamps[i].sd_m.value_or(0);
    const Eigen::MatrixXd moved = by_heights * errors;
    effect.covariance += moved * moved.transpose();
    of_map += errors.cwiseProduct(at.squares * errors).sum();
  }
  if (at.squared_residuals > 0) {
    effect.noise_fraction = std::max(0.0, 1 - of_map / at.squared_residuals);
  }
  return effect;
}

/// Fits the axis with an estimated lever arm, or with a lever arm of zero.
RotationFit fit_axis(const SpotCaptures& spot, const Camera& camera, bool lever_arm) {
  State state = start_from(spot);
  if (!lever_arm) state.lever_arm_m.setZero();
  RobustFit fit(spot.stated_px.has_value());
  add_residuals(fit, spot, lever_arm, state);
  RotationFit result;
  constexpr int rounds = 10;
  for (int round = 0; round < rounds; ++round) {
    result.converged = round == 0 ? fit.solve() : fit.refine();
    if (!result.converged) return result;
    if (!lever_arm || scale_to_map(spot, state)) break;
  }
  auto zenith_covariance = fit.covariance(state.zenith.data());
  const bool map_is_exact = std::all_of(spot.lamps.begin(), spot.lamps.end(), [](const Lamp& lamp) {
    return !(lamp.sd_m.value_or(0) > 0);
  });
  // Without a lever arm, any height of a lamp explains its observations.
  const MapEffect map = lever_arm && zenith_covariance && !map_is_exact
                            ? propagate_map(fit, spot, state)
                            : MapEffect();
  if (zenith_covariance) {
    *zenith_covariance =
        map.noise_fraction * *zenith_covariance + map.covariance.topLeftCorner<2, 2>();
  }
  result.center = rotation_center_at(state.zenith, RotationModel::tilt, camera, zenith_covariance);
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
  describe(result, fit, spot);
  result.yaws_rad = std::move(state.yaws_rad);
  return result;
}

}  // namespace

RotationFit fit_turning_axis(const SpotCaptures& spot, const Camera& camera) {
  assert(spot.status == SpotStatus::ok);
  RotationFit result;
  if (spot.heights.size() > 1) {
    result = fit_axis(spot, camera, true);
  } else {
    if (lamps_at_several_heights(spot)) result = fit_axis(spot, camera, true);
    if (!tells_lever_arm(result.center, spot)) result = fit_axis(spot, camera, false);
  }
  if (!result.converged) return result;
  // The model is exact. Large residuals mean that the captures are no rotation about one axis.
  constexpr double most_share = 0.007, most_times = 4;
  const double most_px =
      std::max(most_share * camera.focal_px().x(), most_times * spot.stated_px.value_or(0));
  return result.residual_px > most_px ? RotationFit() : result;
}

}  // namespace vlp
