// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "calibration/levelling/lamp_bundle.h"

/// The normal equations of a LampBundle, capture by capture.
namespace vlp {

/// Of a capture: (S, g), then, as far as they are not known, the velocity and the yaw rate.
using OwnVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, 7, 1>;
using OwnMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 7, 7>;

Eigen::Index own_unknowns(const LampBundle::Capture& capture);

/// Velocity and yaw rate less what is known of them, in standard deviations; none for those that
/// are known.
OwnVector motion_deviations(const LampBundle::Capture& capture);
/// One over those standard deviations.
OwnVector motion_weights(const LampBundle::Capture& capture);

/// The capture with its own unknowns moved.
LampBundle::Capture moved(const LampBundle::Capture& capture, const OwnVector& step);

/// x of a lamp in the level frame of a capture, when it is read.
Eigen::Vector3d x_in_level(const LampBundle::Capture& capture, const LampBundle::Observation& seen,
                           const Eigen::Vector3d& lamp_m);

/// Of one capture: its own unknowns x and the shared ones s that it touches,
///   own dx + mixed ds = own_gradient.
struct OwnEquations {
  Eigen::LLT<OwnMatrix> own;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, 7> mixed;
  OwnVector own_gradient;
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
