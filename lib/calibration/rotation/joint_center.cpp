// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/rotation/joint_center.h"

#include <cassert>
#include <memory>

#include "calibration/rotation/fit_parts.h"
#include "calibration/rotation/robust_fit.h"
#include "calibration/rotation/spot_residual.h"

namespace vlp {
namespace {

/// Residual of fit_joint_center(). Parameters: the center (2), the position of the lamp about it at
/// yaw 0 (2), the yaw (1).
struct JointResidual {
  SpotResidual in_image;

  template <typename T>
  bool operator()(const T* center, const T* place, const T* yaw_rad, T* residual) const {
    using std::cos, std::sin;
    const T c = cos(*yaw_rad), s = sin(*yaw_rad);
    const Eigen::Matrix<T, 3, 1> seen(center[0] + c * place[0] + s * place[1],
                                      center[1] + c * place[1] - s * place[0], T(1));
    in_image(seen, residual);
    return true;
  }

  static std::unique_ptr<ceres::CostFunction> create(const SpotObservation& sighting) {
    return std::make_unique<ceres::AutoDiffCostFunction<JointResidual, 2, 2, 2, 1>>(
        new JointResidual{SpotResidual(sighting)});
  }
};

}  // namespace

RotationFit fit_joint_center(const SpotCaptures& spot, const Camera& camera) {
  assert(spot.status == SpotStatus::ok);
  Eigen::Vector2d center = spot.zenith_in_camera.hnormalized();
  std::vector<std::vector<Eigen::Vector2d>> places(spot.heights.size());
  for (std::size_t height = 0; height < places.size(); ++height) {
    const auto& [z_m, axis_m, arc_rad, captures] = spot.heights[height];
    for (const Lamp& lamp : spot.lamps) {
      places[height].emplace_back((lamp.position_m.head<2>() - axis_m) /
                                  (lamp.position_m.z() - z_m));
    }
  }
  std::vector<double> yaws_rad = yaws_of(spot);

  RobustFit fit(spot.stated_px.has_value());
  std::vector<std::vector<const double*>> yaws_at(spot.heights.size());
  for (std::size_t i = 0; i < yaws_rad.size(); ++i) {
    yaws_at[spot.captures[i].height].push_back(&yaws_rad[i]);
  }
  for (const SpotObservation& sighting : spot.sightings) {
    const std::size_t height = spot.captures[sighting.capture].height;
    fit.add(JointResidual::create(sighting),
            {center.data(), places[height][sighting.lamp].data(), &yaws_rad[sighting.capture]});
  }
  for (auto& yaws : yaws_at) fit.hold_one_of(std::move(yaws));
  RotationFit result;
  result.converged = fit.solve();
  if (!result.converged) return result;
  result.center =
      rotation_center_at(center, RotationModel::shift, camera, fit.covariance(center.data()));
  describe(result, fit, spot);
  result.yaws_rad = std::move(yaws_rad);
  return result;
}

}  // namespace vlp
