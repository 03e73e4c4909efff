// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace vlp {

/// Matrices of public structs. Eigen aligns its own 2x2 and 4x4 matrices by the widest
/// vector unit the compiler may use, so a program built with -march=native would lay them out
/// differently from the installed library. These are laid out alike everywhere.
using Matrix2 = Eigen::Matrix<double, 2, 2, Eigen::DontAlign>;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
/// Of any size: its memory, too, is got and given back alike everywhere.
using MatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::DontAlign>;

}  // namespace vlp
