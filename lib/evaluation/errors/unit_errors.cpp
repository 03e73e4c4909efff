// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/unit_errors.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "positioning/correction.h"
#include "positioning/error_budget.h"

namespace vlp {

std::vector<std::size_t> list_visible_lamps(const LampMap& map, const Lens& lens,
                                            const std::array<int, 2>& imager_px,
                                            const Eigen::Matrix3d& camera_from_level,
                                            const Pose& level) {
  const auto in_image = [&](const Eigen::Vector3d& x_in_world) {
    const auto pixel =
        lens.project_point(camera_from_level * level_point_from_world(level, x_in_world));
    return pixel && pixel->minCoeff() >= -0.5 && pixel->x() <= imager_px[0] - 0.5 &&
           pixel->y() <= imager_px[1] - 0.5;
  };
  const auto seen_whole = [&](const Lamp& lamp) {
    if (lamp.position_m.z() <= level.position_m.z()) return false;
    if (!in_image(lamp.position_m)) return false;
    const auto outline_m = compute_lamp_outline_points(lamp.shape, lamp.position_m);
    return std::all_of(outline_m.begin(), outline_m.end(), in_image);
  };
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    if (seen_whole(map.lamps[i])) seen.push_back(i);
  }
  return seen;
}

UnitErrors::UnitErrors(const LampMap& map, const Calibration& calibration)
    : map_(map),
      camera_(calibration.camera),
      lens_(camera_.lens_model, camera_.intrinsics),
      camera_from_level_(compute_level_from_camera_matrix(calibration, Correction::all).inverse()),
      whole_(map_.lamps, calibration, Correction::all),
      parts_{whole_.isolate_error_source(CommonErrorSource::lens),
             whole_.isolate_error_source(CommonErrorSource::zenith),
             whole_.isolate_error_source(CommonErrorSource::offset),
             whole_.isolate_error_source(CommonErrorSource::lamps)},
      has_offset_(calibration.dispersion.has_value()) {}

std::vector<std::size_t> UnitErrors::list_visible_lamps(const Pose& level) const {
  return vlp::list_visible_lamps(map_, lens_, camera_.imager_px, camera_from_level_, level);
}

std::optional<UnitBudget> UnitErrors::compute_budget(const Pose& level,
                                                     std::span<const std::size_t> lamps,
                                                     double noise_px,
                                                     const BodyPrior& prior) const {
  std::vector<Eigen::Vector3d> lamps_m;
  lamps_m.reserve(lamps.size());
  for (const std::size_t lamp : lamps) lamps_m.push_back(map_.lamps[lamp].position_m);
  const auto limit = compute_pose_crlb(lamps_m, lens_, camera_from_level_, level, noise_px, prior,
                                       make_readout_clock(camera_));
  if (!limit) return std::nullopt;
  const Eigen::Matrix3d body_from_base = Eigen::Matrix3d::Identity();
  const Eigen::Vector3d no_arm_m = Eigen::Vector3d::Zero();
  const auto gain = whole_.differentiate_fix<4>(
      {limit->frame.observations_span(), lamps, lens_, body_from_base, no_arm_m}, limit->fix);
  const auto part = [&](CommonErrorSource of) {
    return parts_[static_cast<std::size_t>(of)].propagate(gain);
  };
  return UnitBudget{limit->noise,
                    part(CommonErrorSource::lens),
                    part(CommonErrorSource::zenith),
                    part(CommonErrorSource::offset),
                    part(CommonErrorSource::lamps),
                    limit->motion,
                    limit->roll_pitch};
}

}  // namespace vlp
