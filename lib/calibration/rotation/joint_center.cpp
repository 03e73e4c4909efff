// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/joint_center.h"

#include <cassert>
#include <memory>

#include "calibration/rotation/fit_parts.h"
#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/rotation_residual.h"

namespace vlp {
namespace {

/// Residual of fit_joint_center(). Parameters: the center (2), the position of the lamp about it at
/// yaw 0 (2), the yaw (1).
struct JointResidual {
  RotationResidual in_image;

  template <typename T>
  bool operator()(const T* center, const T* place, const T* yaw_rad, T* residual) const {
    using std::cos, std::sin;
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> seen(center[0] + c * place[0] + s * place[1],
                                      center[1] + c * place[1] - s * place[0], T(1));
    in_image(seen, residual);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const RotationObservation& observation) {
    return std::make_unique<ceres::AutoDiffCostFunction<JointResidual, 2, 2, 2, 1>>(
        new JointResidual{RotationResidual(observation)});
  }
};

}  // namespace

RotationFit fit_joint_center(const RotationCaptures& rotation, const Camera& camera) {
  assert(rotation.status == RotationStatus::ok);
  Eigen::Vector2d center = rotation.zenith_in_camera.hnormalized();
  std::vector<std::vector<Eigen::Vector2d>> places(rotation.heights.size());
  for (std::size_t height = 0; height < places.size(); ++height) {
    const auto& [z_m, axis_m, arc_rad, captures] = rotation.heights[height];
    for (const Lamp& lamp : rotation.lamps) {
      places[height].emplace_back((lamp.position_m.head<2>() - axis_m) /
                                  (lamp.position_m.z() - z_m));
    }
  }
  std::vector<double> yaws_rad = collect_yaws(rotation);

  RobustFit fit(rotation.median_sigma_px.has_value());
  std::vector<std::vector<const double*>> yaws_at(rotation.heights.size());
  for (std::size_t i = 0; i < yaws_rad.size(); ++i) {
    yaws_at[rotation.captures[i].height].push_back(&yaws_rad[i]);
  }
  for (const RotationObservation& observation : rotation.observations) {
    const std::size_t height = rotation.captures[observation.capture].height;
    fit.add(
        JointResidual::create(observation),
        {center.data(), places[height][observation.lamp].data(), &yaws_rad[observation.capture]});
  }
  for (auto& yaws : yaws_at) fit.fix_one_of(std::move(yaws));
  RotationFit result;
  result.converged = fit.solve();
  if (!result.converged) return result;
  result.center =
      make_rotation_center(center, RotationModel::shift, camera, fit.covariance(center.data()));
  set_statistics(result, fit, rotation);
  result.yaws_rad = std::move(yaws_rad);
  return result;
}

}  // namespace vlp
