// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/homography.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "geometry/symmetric.h"

namespace vlp {
namespace {

/// Returns the transform of one side of the pairs to points with mean 0 and RMS radius 1.
Eigen::Matrix3d make_normalization(std::span<const PlanePair> pairs,
                                   Eigen::Vector2d PlanePair::*side) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const PlanePair& pair : pairs) mean += pair.*side / double(pairs.size());
  double mean_square = 0;
  for (const PlanePair& pair : pairs) {
    mean_square += (pair.*side - mean).squaredNorm() / double(pairs.size());
  }
  const double scale = mean_square > 0 ? 1 / std::sqrt(mean_square) : 1;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Identity();
  normal.topLeftCorner<2, 2>() *= scale;
  normal.topRightCorner<2, 1>() = -scale * mean;
  return normal;
}

}  // namespace

Eigen::Matrix3d estimate_homography(std::span<const PlanePair> pairs) {
  const Eigen::Matrix3d from_normal = make_normalization(pairs, &PlanePair::from);
  const Eigen::Matrix3d to_normal = make_normalization(pairs, &PlanePair::to);
  Eigen::Matrix<double, 9, 9> squares = Eigen::Matrix<double, 9, 9>::Zero();
  for (const PlanePair& pair : pairs) {
    const Eigen::Vector3d from = from_normal * pair.from.homogeneous();
    const Eigen::Vector3d to = to_normal * pair.to.homogeneous();
    Eigen::Matrix<double, 2, 9> rows;
    rows << from.transpose(), Eigen::RowVector3d::Zero(), -to.x() * from.transpose(),
        Eigen::RowVector3d::Zero(), from.transpose(), -to.y() * from.transpose();
    squares += rows.transpose() * rows;
  }
  const Eigen::Matrix<double, 9, 1> smallest =
      eigendecompose(Eigen::MatrixXd(squares)).vectors.col(0);
  const Eigen::Matrix3d fitted =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(smallest.data());
  return to_normal.inverse() * fitted * from_normal;
}

}  // namespace vlp
