// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/mirror.h"

namespace vlp {
namespace {

Eigen::Vector3d compute_normal(const Panel& pane) {
  return pane.edge_a_m.cross(pane.edge_b_m).normalized();
}

}  // namespace

Eigen::Isometry3d reflection_about(const Panel& pane) {
  const Eigen::Vector3d normal = compute_normal(pane);
  Eigen::Isometry3d reflection;
  reflection.linear() = Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose();
  reflection.translation() = 2 * normal.dot(pane.corner_m) * normal;
  return reflection;
}

bool is_before(const Mirror& mirror, const Eigen::Vector3d& light_m, const Eigen::Vector3d& eye_m) {
  const Eigen::Vector3d normal = compute_normal(mirror.pane);
  return normal.dot(light_m - mirror.pane.corner_m) * normal.dot(eye_m - mirror.pane.corner_m) > 0;
}

}  // namespace vlp
