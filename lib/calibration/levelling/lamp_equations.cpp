// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/lamp_equations.h"

#include <cmath>

#include "geometry/plane.h"

namespace vlp {
namespace {

using Capture = LampBundle::Capture;
using Observation = LampBundle::Observation;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// Back by the angle of that unit number.
Eigen::Vector3d turned_back(const Eigen::Vector2d& turn, const Eigen::Vector3d& x) {
  Eigen::Vector3d back;
  back << conj_product(turn, x.head<2>()), x.z();
  return back;
}

/// A lamp in the level frame at the image's middle; and when it is read, by how much the frame has
/// turned since.
struct InLevel {
  Eigen::Vector3d still, read;
  Eigen::Vector2d turn;
};

InLevel in_level(const Capture& capture, const Observation& seen, const Eigen::Vector3d& lamp_m) {
  InLevel x;
  x.still = turned_back(capture.camera.heading, lamp_m - capture.camera.position_m);
  const double angle_rad = capture.yaw_rate_rad_per_s * seen.time_s;
  x.turn = {std::cos(angle_rad), std::sin(angle_rad)};
  x.read = x.still;
  x.read.head<2>() -= capture.velocity_m_per_s * seen.time_s;
  x.read = turned_back(x.turn, x.read);
  return x;
}

struct Linearized {
  Eigen::Vector2d residual;
  /// By the capture's own unknowns, (tilt about x and y), P.
  Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 7> by_own;
  Eigen::Matrix2d by_tilt;
  Matrix23 by_lamp;
};

Linearized linearize(const LampBundle& bundle, const Capture& capture, const Observation& seen) {
  const InLevel in = in_level(capture, seen, bundle.lamps_m[seen.lamp]);
  const Eigen::Vector3d& level = in.read;
  const Eigen::Vector3d x = bundle.level_from_camera.transpose() * level;
  const Eigen::Vector2d z = x.head<2>() / x.z();
  Matrix23 d_z;
  d_z << 1 / x.z(), 0, -z.x() / x.z(), 0, 1 / x.z(), -z.y() / x.z();
  const Matrix23 by_level = seen.whitening * d_z * bundle.level_from_camera.transpose();
  const Eigen::Vector2d& h = capture.camera.heading;
  const Eigen::Vector2d& w = in.turn;
  Eigen::Matrix3d level_from_world, read_from_still;
  level_from_world << h.x(), h.y(), 0, -h.y(), h.x(), 0, 0, 0, 1;
  read_from_still << w.x(), w.y(), 0, -w.y(), w.x(), 0, 0, 0, 1;
  const Matrix23 by_still = by_level * read_from_still;
  Linearized at;
  at.residual = seen.whitening * (seen.z_in_camera - z);
  at.by_lamp = by_still * level_from_world;
  at.by_own.resize(2, own_unknowns(capture));
  at.by_own.leftCols<3>() = -at.by_lamp;
  at.by_own.col(3) = by_still * Eigen::Vector3d(in.still.y(), -in.still.x(), 0);
  Eigen::Index next = 4;
  if (capture.known.velocity_sd_m_per_s > 0) {
    at.by_own.middleCols<2>(next) = -seen.time_s * by_still.leftCols<2>();
    next += 2;
  }
  if (capture.known.yaw_rate_sd_rad_per_s > 0) {
    at.by_own.col(next) = seen.time_s * (by_level * Eigen::Vector3d(level.y(), -level.x(), 0));
  }
  at.by_tilt << by_level * Eigen::Vector3d(0, level.z(), -level.y()),
      by_level * Eigen::Vector3d(-level.z(), 0, level.x());
  return at;
}

}  // namespace

Eigen::Index own_unknowns(const Capture& capture) {
  return 4 + (capture.known.velocity_sd_m_per_s > 0 ? 2 : 0) +
         (capture.known.yaw_rate_sd_rad_per_s > 0 ? 1 : 0);
}

OwnVector motion_weights(const Capture& capture) {
  OwnVector weights(own_unknowns(capture) - 4);
  const KnownMotion& known = capture.known;
  if (known.velocity_sd_m_per_s > 0) weights.head(2).setConstant(1 / known.velocity_sd_m_per_s);
  if (known.yaw_rate_sd_rad_per_s > 0) weights.tail(1)[0] = 1 / known.yaw_rate_sd_rad_per_s;
  return weights;
}

OwnVector motion_deviations(const Capture& capture) {
  OwnVector deviations = motion_weights(capture);
  const KnownMotion& known = capture.known;
  if (known.velocity_sd_m_per_s > 0) {
    deviations.head(2).array() *= (capture.velocity_m_per_s - known.velocity_m_per_s).array();
  }
  if (known.yaw_rate_sd_rad_per_s > 0) {
    deviations.tail(1)[0] *= capture.yaw_rate_rad_per_s - known.yaw_rate_rad_per_s;
  }
  return deviations;
}

Capture moved(const Capture& capture, const OwnVector& step) {
  Capture next = capture;
  next.camera = LevelPose(capture.camera.position_m + step.head<3>(),
                          complex_product(capture.camera.heading, {1, step[3]}).normalized());
  if (capture.known.velocity_sd_m_per_s > 0) next.velocity_m_per_s += step.segment<2>(4);
  if (capture.known.yaw_rate_sd_rad_per_s > 0) next.yaw_rate_rad_per_s += step.tail(1)[0];
  return next;
}

Eigen::Vector3d x_in_level(const Capture& capture, const Observation& seen,
                           const Eigen::Vector3d& lamp_m) {
  return in_level(capture, seen, lamp_m).read;
}

std::vector<Eigen::Index> shared_of(const Capture& capture) {
  std::vector<Eigen::Index> indices{0, 1};
  for (const Observation& seen : capture.seen) {
    const auto first = static_cast<Eigen::Index>(2 + 3 * seen.lamp);
    indices.insert(indices.end(), {first, first + 1, first + 2});
  }
  return indices;
}

OwnEquations eliminate(const LampBundle& bundle, const Capture& capture, SharedEquations& shared) {
  const auto indices = shared_of(capture);
  const auto size = static_cast<Eigen::Index>(indices.size());
  const Eigen::Index own_size = own_unknowns(capture);
  OwnMatrix own = OwnMatrix::Zero(own_size, own_size);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  OwnEquations equations{{}, Eigen::MatrixXd::Zero(own_size, size), OwnVector::Zero(own_size)};
  Eigen::Matrix<double, 2, 5> by_shared;
  for (std::size_t i = 0; i < capture.seen.size(); ++i) {
    const Linearized at = linearize(bundle, capture, capture.seen[i]);
    const auto lamp = static_cast<Eigen::Index>(2 + 3 * i);
    by_shared << at.by_tilt, at.by_lamp;
    own += at.by_own.transpose() * at.by_own;
    equations.own_gradient += at.by_own.transpose() * at.residual;
    equations.mixed.leftCols<2>() += at.by_own.transpose() * at.by_tilt;
    equations.mixed.middleCols<3>(lamp) += at.by_own.transpose() * at.by_lamp;
    const Eigen::Matrix<double, 5, 5> product = by_shared.transpose() * by_shared;
    information.topLeftCorner<2, 2>() += product.topLeftCorner<2, 2>();
    information.block<2, 3>(0, lamp) += product.topRightCorner<2, 3>();
    information.block<3, 2>(lamp, 0) += product.bottomLeftCorner<3, 2>();
    information.block<3, 3>(lamp, lamp) += product.bottomRightCorner<3, 3>();
    gradient.head<2>() += at.by_tilt.transpose() * at.residual;
    gradient.segment<3>(lamp) += at.by_lamp.transpose() * at.residual;
  }
  const OwnVector weights = motion_weights(capture), deviations = motion_deviations(capture);
  own.diagonal().tail(weights.size()) += weights.cwiseAbs2();
  equations.own_gradient.tail(weights.size()) -= weights.cwiseProduct(deviations);
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
