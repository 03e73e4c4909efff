// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calibration.h"

/// Errors of the parts of a calibration: their joint covariance, and changes of the parts for
/// numeric derivatives. The units are those of JointCovariance.
namespace vlp {

/// Returns the number of intrinsics, counted from fx, whose errors later steps propagate. It is the
/// number of all intrinsics, but 4 (fx, fy, cx, cy) for splined lenses, since few corners determine
/// each control point. Errors of the control points are only included in
/// IntrinsicsReport::expected_max_error_px.
Eigen::Index count_intrinsics(const Camera& camera);

/// Returns the normalized point (x/z, y/z) of the zenith in the camera frame.
Eigen::Vector2d compute_zenith_point(const RotationCenter& center);

/// Returns the names of the intrinsics whose errors are propagated, in their order
/// (count_intrinsics()): fx, fy, cx, cy, k1 ...
std::vector<std::string> list_intrinsics_names(const Camera& camera);

/// Returns the names of the coordinates of a lamp's position: lamp_ID_x_m, lamp_ID_y_m,
/// lamp_ID_z_m.
std::array<std::string, 3> list_lamp_parameters(int id);

/// Returns the names of a pair of parameters, ..x.. and ..y..
std::array<std::string, 2> list_pair_names(std::string_view first);

/// Returns a joint covariance with the errors of the lens if they are known.
JointCovariance make_lens_covariance(const Calibration& calibration);

/// Returns the joint covariance of lens, zenith, lever arm and lamps with this matrix; without the
/// lens if the matrix has no rows for it.
JointCovariance make_covariance(const Camera& camera,
                                std::vector<JointCovariance::LampPosition> lamps,
                                const MatrixX& matrix);

/// Appends parameters with the errors jacobian e + e_own, where e are the errors of the parameters
/// before and e_own independent of them: J C on the side, J C J' + own on the diagonal.
void append_parameters(JointCovariance& joint, std::span<const std::string> names,
                       const MatrixX& jacobian, const MatrixX& own);

/// Returns the covariance of a parameter with name ..x.. and the next one, ..y..; std::nullopt if
/// it is unknown or lacks the known errors of the lens.
std::optional<Matrix2> find_parameter_covariance(const Calibration& calibration,
                                                 std::string_view first_parameter);

/// Computes the covariance of RotationCenter::center_px, px^2, with the errors of the lens;
/// std::nullopt as find_parameter_covariance().
std::optional<Matrix2> compute_center_covariance(const Calibration& calibration);

/// Computes the covariance of Dispersion::offset_px, px^2; std::nullopt as
/// find_parameter_covariance().
std::optional<Matrix2> compute_offset_covariance(const Calibration& calibration);

/// Returns the calibration with `error` added to its first count_intrinsics()
/// intrinsics. Zenith and lever arm do not change; center_px is updated.
Calibration add_intrinsics_error(Calibration calibration, const Eigen::VectorXd& error);

/// Returns the calibration with `error` added to the zenith's normalized point (x/z, y/z).
/// center_px is updated.
/// @pre there is a rotation center
Calibration add_zenith_error(Calibration calibration, const Eigen::Vector2d& error);

/// Returns the calibration with `error` added to offset_px / f, the dispersion offset in focal
/// lengths.
/// @pre there is a dispersion
Calibration add_offset_error(Calibration calibration, const Eigen::Vector2d& error);

}  // namespace vlp
