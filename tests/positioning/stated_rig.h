// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

  /// Sets an adjustment.
  void adjust(double size) {
    Adjustment adjustment{{}, {}, {}, 1, 1, 0.1};
    for (const Lamp& lamp : map.lamps) adjustment.lamps.push_back({lamp.id, lamp.position_m});
    Eigen::VectorXd scale(12 + 4 + 24);
    scale << lens_scale(size), Eigen::VectorXd::Constant(4, 1e-4 * size),
        Eigen::VectorXd::Constant(24, 1e-3 * size);
    Random random(7);
    adjustment.covariance = mixed(scale, random);
    calibration.adjustment = adjustment;
  }

  /// Sets the covariances of sequential steps, with derivatives by earlier steps, and a survey.
  void calibrate_in_a_row() {
    Random random(8);
    IntrinsicsReport& report = calibration.intrinsics_report.emplace();
    report.covariance = mixed(lens_scale(1), random);
    RotationCenter& center = *calibration.rotation_center;
    const auto jacobian_wrt_intrinsics = [&] {
      MatrixX effect(2, 12);
      for (double& one : effect.reshaped()) one = random.normal();
      effect.leftCols<4>() *= 1e-3;
      return effect;
    };
    center.covariance = mixed(Eigen::Vector2d(0.05, 0.05), random);
    center.jacobian_wrt_intrinsics = jacobian_wrt_intrinsics();
    Dispersion& dispersion = calibration.dispersion.emplace();
    dispersion = {{0.4, -0.3}, 0.001, {0, 0}, 12};
    dispersion.covariance = mixed(Eigen::Vector2d(0.03, 0.03), random);
    dispersion.jacobian_wrt_intrinsics = jacobian_wrt_intrinsics();
    dispersion.jacobian_wrt_zenith = -0.9 * Eigen::Matrix2d::Identity();
    for (Lamp& lamp : map.lamps) lamp.sd_m = 0.0005;
  }
};

}  // namespace vlp
