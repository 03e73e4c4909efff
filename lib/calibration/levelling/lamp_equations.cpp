// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/lamp_equations.h"

#include "geometry/plane.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Seen = LampBundle::Seen;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

struct Linearized {
  Eigen::Vector2d residual;
  /// By (S, g), (tilt about x and y), P.
  Eigen::Matrix<double, 2, 4> by_pose;
  Eigen::Matrix2d by_tilt;
  Matrix23 by_lamp;
};

Linearized linearize(const LampBundle& bundle, const Capture& capture, const Seen& seen) {
  const Eigen::Vector3d level = x_in_level(capture.camera, bundle.lamps_m[seen.lamp]);
  const Eigen::Vector3d x = bundle.level_from_camera.transpose() * level;
  const Eigen::Vector2d z = x.head<2>() / x.z();
  Matrix23 d_z;
  d_z << 1 / x.z(), 0, -z.x() / x.z(), 0, 1 / x.z(), -z.y() / x.z();
  const Matrix23 by_level = seen.whitening * d_z * bundle.level_from_camera.transpose();
  Linearized at;
  at.residual = seen.whitening * (seen.z_in_camera - z);
  const Eigen::Vector2d& h = capture.camera.heading;
  Eigen::Matrix3d level_from_world;
  level_from_world << h.x(), h.y(), 0, -h.y(), h.x(), 0, 0, 0, 1;
  at.by_lamp = by_level * level_from_world;
  at.by_pose << -at.by_lamp, by_level * Eigen::Vector3d(level.y(), -level.x(), 0);
  at.by_tilt << by_level * Eigen::Vector3d(0, level.z(), -level.y()),
      by_level * Eigen::Vector3d(-level.z(), 0, level.x());
  return at;
}

}  // namespace

Eigen::Vector3d x_in_level(const LevelPose& camera, const Eigen::Vector3d& lamp_m) {
  const Eigen::Vector3d offset = lamp_m - camera.position_m;
  Eigen::Vector3d x;
  x << conj_times(camera.heading, offset.head<2>()), offset.z();
  return x;
}

std::vector<Eigen::Index> shared_of(const Capture& capture) {
  std::vector<Eigen::Index> indices{0, 1};
  for (const Seen& seen : capture.seen) {
    const auto first = static_cast<Eigen::Index>(2 + 3 * seen.lamp);
    indices.insert(indices.end(), {first, first + 1, first + 2});
  }
  return indices;
}

OwnEquations eliminate(const LampBundle& bundle, const Capture& capture, SharedEquations& shared) {
  const auto indices = shared_of(capture);
  const auto size = static_cast<Eigen::Index>(indices.size());
  Eigen::Matrix4d own = Eigen::Matrix4d::Zero();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  OwnEquations equations{{}, Eigen::MatrixXd::Zero(4, size), Eigen::Vector4d::Zero()};
  Eigen::Matrix<double, 2, 5> by_shared;
  for (std::size_t i = 0; i < capture.seen.size(); ++i) {
    const Linearized at = linearize(bundle, capture, capture.seen[i]);
    const auto lamp = static_cast<Eigen::Index>(2 + 3 * i);
    by_shared << at.by_tilt, at.by_lamp;
    own += at.by_pose.transpose() * at.by_pose;
    equations.own_gradient += at.by_pose.transpose() * at.residual;
    equations.mixed.leftCols<2>() += at.by_pose.transpose() * at.by_tilt;
    equations.mixed.middleCols<3>(lamp) += at.by_pose.transpose() * at.by_lamp;
    const Eigen::Matrix<double, 5, 5> product = by_shared.transpose() * by_shared;
    information.topLeftCorner<2, 2>() += product.topLeftCorner<2, 2>();
    information.block<2, 3>(0, lamp) += product.topRightCorner<2, 3>();
    information.block<3, 2>(lamp, 0) += product.bottomLeftCorner<3, 2>();
    information.block<3, 3>(lamp, lamp) += product.bottomRightCorner<3, 3>();
    gradient.head<2>() += at.by_tilt.transpose() * at.residual;
    gradient.segment<3>(lamp) += at.by_lamp.transpose() * at.residual;
  }
  equations.own.compute(own);
  const Eigen::VectorXd undiminished = information.diagonal();
  information -= equations.mixed.transpose() * equations.own.solve(equations.mixed);
  gradient -= equations.mixed.transpose() * equations.own.solve(equations.own_gradient);
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto row = indices[static_cast<std::size_t>(i)];
    shared.gradient[row] += gradient[i];
    shared.undiminished[row] += undiminished[i];
    for (Eigen::Index k = 0; k < size; ++k) {
      shared.information(row, indices[static_cast<std::size_t>(k)]) += information(i, k);
    }
  }
  return equations;
}

}  // namespace vlp
