// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "geometry/types.h"

/// Propagation of errors from earlier calibration steps, which a step assumes to be exact, to its
/// result (JointCovariance).
namespace vlp {

/// Function that solves for a vector of unknowns with the errors `error` added to the assumed
/// inputs, in the units of the inputs. Returns the solution; std::nullopt if there is none.
using PerturbedSolve = std::function<std::optional<Eigen::VectorXd>(const Eigen::VectorXd& error)>;

/// Estimates the derivative of a solution with respect to errors of its inputs, one column per
/// error.
///
/// @param nominal       solution without errors, f(0)
/// @param covariance  covariance of the errors
/// @return            d solution / d error; std::nullopt if a solve fails or the covariance is not
///     positive definite
///
/// Solves once for each column of the lower Cholesky factor L of the covariance:
///   J = (f(L_1) - f(0), f(L_2) - f(0), ...) L^-1
/// The trial errors so have their actual size. Correlated errors, such as those of lens
/// coefficients, change together. If a column has no solution, it is tried once more at 1/16 of its
/// size. Reason: a solve may select other data at a larger error. Noise of the solve is then
/// amplified 16 times, which is still far below the result.
std::optional<MatrixX> differentiate_solution(const PerturbedSolve& solve,
                                              const Eigen::VectorXd& nominal,
                                              const MatrixX& covariance);

}  // namespace vlp
