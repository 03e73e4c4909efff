// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/turning_axis.h"

#include <cassert>

#include "calibration/axis_residual.h"
#include "calibration/fit_parts.h"
#include "calibration/robust_fit.h"

namespace vlp {

RotationFit fit_turning_axis(const SpotCaptures& spot, const Camera& camera) {
  assert(spot.status == SpotStatus::ok);
  Eigen::Vector2d zenith = spot.zenith_in_camera.hnormalized(), lever_arm_m = spot.lever_arm_m;
  std::vector<Eigen::Vector2d> lamps_m;
  for (const Lamp& lamp : spot.lamps) lamps_m.emplace_back(lamp.position_m.head<2>());
  std::vector<Eigen::Vector3d> axes_m;
  for (const SpotHeight& height : spot.heights) {
    axes_m.emplace_back(height.axis_m.x(), height.axis_m.y(), height.z_m);
  }
  std::vector<double> yaws_rad = yaws_of(spot);

  RobustFit fit;
  for (const SpotSighting& sighting : spot.sightings) {
    const std::size_t height = spot.captures[sighting.capture].height;
    fit.add(AxisResidual::create(sighting, spot.lamps[sighting.lamp].position_m.z()),
            {zenith.data(), lever_arm_m.data(), lamps_m[sighting.lamp].data(),
             axes_m[height].data(), &yaws_rad[sighting.capture]});
  }
  // World: the lamps may be turned about the first height's axis, moved with it, or be another
  // size.
  fit.hold(axes_m.front().data());
  fit.hold_one_of(pointers_to(yaws_rad));
  const bool lever_arm = spot.heights.size() > 1;
  if (!lever_arm) fit.hold(lever_arm_m.data());
  RotationFit result;
  result.converged = fit.solve();
  if (!result.converged) return result;
  result.center =
      rotation_center_at(zenith, RotationModel::tilt, camera, fit.covariance(zenith.data()));
  if (lever_arm) {
    result.center.lever_arm_m = lever_arm_m;
    result.center.lever_arm_covariance = fit.covariance(lever_arm_m.data());
  }
  describe(result, fit, spot);
  result.yaws_rad = std::move(yaws_rad);
  return result;
}

}  // namespace vlp
