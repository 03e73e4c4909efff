// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

namespace vlp {

/// The directions in which the lamps may be corrected from captures with free poses: orthonormal
/// columns, three rows a lamp, at right angles to moving all lamps that are `seen`, turning them
/// about the vertical and scaling them about their mean. Rows of the other lamps are zero.
/// Precondition: two lamps or more are seen.
Eigen::MatrixXd map_directions(const std::vector<Eigen::Vector3d>& lamps_m,
                               const std::vector<bool>& seen);

}  // namespace vlp
