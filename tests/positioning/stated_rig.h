// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string_view>

#include "rig/calibration_error.h"
#include "support/synthetic_rig.h"

namespace vlp {

/// A tilted camera under eight lamps at several heights, with reported uncertainties.
struct StatedRig : SyntheticRig {
  StatedRig()
      : SyntheticRig{
            synthetic_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {{0.1, -0.05, 0}, 0.4}, {}} {
    for (std::size_t i = 0; i < 8; ++i) {
      map.lamps[i].position_m.z() += 0.02 * static_cast<double>(i % 3);
    }
    calibration.rotation_center = tilted_by(calibration.camera, 0.03, 1);
  }

  /// Returns a covariance in which all quantities are correlated.
  static MatrixX mixed(const Eigen::VectorXd& scale, Random& random) {
    Eigen::MatrixXd root(scale.size(), scale.size());
    for (double& one : root.reshaped()) one = 0.3 * random.normal();
    root.diagonal().array() += 1;
    return scale.asDiagonal() * root * root.transpose() * scale.asDiagonal();
  }

  /// Returns a covariance of the intrinsics.
  static Eigen::VectorXd lens_scale(double size) {
    Eigen::VectorXd scale = Eigen::VectorXd::Constant(12, 1e-4 * size);
    scale.head<4>().setConstant(0.1 * size);
    return scale;
  }

  /// Sets an adjustment with errors of lens, zenith, lever arm and lamps.
  void adjust(double size) {
    Eigen::VectorXd scale(12 + 4 + 24);
    scale << lens_scale(size), Eigen::VectorXd::Constant(4, 1e-4 * size),
        Eigen::VectorXd::Constant(24, 1e-3 * size);
    Random random(7);
    set_adjusted(mixed(scale, random));
  }

  /// Sets an adjustment with this joint covariance.
  void set_adjusted(const MatrixX& covariance) {
    std::vector<JointCovariance::LampPosition> lamps;
    for (const Lamp& lamp : map.lamps) lamps.push_back({lamp.id, lamp.position_m});
    calibration.adjustment = Adjustment{{}, 1, 1, 0.1};
    calibration.covariance = make_covariance(calibration.camera, lamps, covariance);
  }

  /// Sets the covariances of sequential steps, which depend on earlier ones, and a survey; `errors`
  /// states which of lens, zenith, offset and lamps have errors of their own.
  void calibrate_in_a_row(std::array<double, 4> errors = {1, 1, 1, 1}) {
    Random random(8);
    IntrinsicsReport& report = calibration.intrinsics_report.emplace();
    report.covariance = errors[0] * mixed(lens_scale(1), random);
    JointCovariance joint = make_lens_covariance(calibration);
    const auto append = [&](std::string_view name, double size_px, double sd_px) {
      MatrixX effect(2, joint.matrix.rows());
      for (double& one : effect.reshaped()) one = random.normal();
      effect.leftCols<4>() *= 1e-3;
      const Eigen::Vector2d scale = sd_px * calibration.camera.focal_px().cwiseInverse();
      append_parameters(joint, list_pair_names(name), effect, size_px * mixed(scale, random));
    };
    append(kZenithParameter, errors[1], 0.05);
    append(kOffsetParameter, errors[2], 0.03);
    calibration.covariance = joint;
    calibration.dispersion = {{0.4, -0.3}, 0.001, {0, 0}, 12};
    for (Lamp& lamp : map.lamps) lamp.sd_m = 0.0005 * errors[3];
  }
};

}  // namespace vlp
