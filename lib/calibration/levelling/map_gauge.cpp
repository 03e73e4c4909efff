// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/levelling/map_gauge.h"

#include <Eigen/QR>

namespace vlp {

Eigen::MatrixXd map_directions(const std::vector<Eigen::Vector3d>& lamps_m,
                               const std::vector<bool>& seen) {
  std::vector<std::size_t> indices;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < lamps_m.size(); ++i) {
    if (!seen[i]) continue;
    indices.push_back(i);
    mean_m += lamps_m[i];
  }
  mean_m /= static_cast<double>(indices.size());
  constexpr Eigen::Index held = 5;
  const auto rows = static_cast<Eigen::Index>(3 * indices.size());
  Eigen::MatrixXd gauge(rows, held);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Eigen::Vector3d p = lamps_m[indices[i]] - mean_m;
    auto of_lamp = gauge.middleRows<3>(static_cast<Eigen::Index>(3 * i));
    of_lamp.leftCols<3>().setIdentity();
    of_lamp.col(3) = Eigen::Vector3d(-p.y(), p.x(), 0);
    of_lamp.col(4) = p;
  }
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(gauge);
  const Eigen::MatrixXd all = qr.householderQ();
  Eigen::MatrixXd directions =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * lamps_m.size()), rows - held);
  for (std::size_t i = 0; i < indices.size(); ++i) {
    directions.middleRows<3>(static_cast<Eigen::Index>(3 * indices[i])) =
        all.block(static_cast<Eigen::Index>(3 * i), held, 3, rows - held);
  }
  return directions;
}

}  // namespace vlp
