// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "calibration/levelling/lamp_bundle.h"

/// The normal equations of a LampBundle, capture by capture.
namespace vlp {

/// x of a lamp in the level frame of a capture.
Eigen::Vector3d x_in_level(const LevelPose& camera, const Eigen::Vector3d& lamp_m);

/// Of one capture: its own unknowns x and the shared ones s that it touches,
///   own dx + mixed ds = own_gradient.
struct OwnEquations {
  Eigen::LLT<Eigen::Matrix4d> own;
  Eigen::Matrix<double, 4, Eigen::Dynamic> mixed;
  Eigen::Vector4d own_gradient;
};

/// What is left for the shared unknowns, and what it would be if the poses were known.
struct SharedEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  Eigen::VectorXd undiminished;
};

/// Indices of the shared unknowns that a capture touches: tilt, and each of its lamps.
std::vector<Eigen::Index> shared_of(const LampBundle::Capture& capture);

/// Adds to `shared` what a capture tells of it once its own unknowns are eliminated.
OwnEquations eliminate(const LampBundle& bundle, const LampBundle::Capture& capture,
                       SharedEquations& shared);

}  // namespace vlp
