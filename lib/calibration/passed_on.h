// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "geometry/types.h"

/// What a step in a row makes of the errors of the steps before it, which it takes as exact: what
/// by_intrinsics, by_zenith and the like of RotationCenter and Dispersion say.
namespace vlp {

/// The numbers that are solved for, when what the solve takes as exact is off by `error`; nothing
/// when it finds none.
using SolvedWith = std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd& error)>;

/// d solved / d error, a column for each error. From one solve for each column of the lower
/// Cholesky factor L of the errors' covariance,
///   J = (f(L_1) - f(0), f(L_2) - f(0), ...) L^-1,
/// so that errors are tried as large as they are, and those that are known only together, as
/// coefficients of a lens are, move together. A column that has no solution is tried once more at a
/// sixteenth of its size: a solve may select other data at a larger error (the noise of the solve
/// counts 16 times there, and is far smaller). Returns std::nullopt if
/// that has none either, or if the covariance is not positive definite.
///
/// @param exact  f(0)
std::optional<MatrixX> jacobian_of(const SolvedWith& solved, const Eigen::VectorXd& exact,
                                   const MatrixX& covariance);

}  // namespace vlp
