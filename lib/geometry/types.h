// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace vlp {

/// Matrices of public structs, with the same memory layout for all compiler options. Eigen aligns
/// 2x2 and 4x4 matrices to the widest vector unit that the compiler may use. A program built with
/// -march=native would lay them out differently from the installed library.
using Matrix2 = Eigen::Matrix<double, 2, 2, Eigen::DontAlign>;
using Matrix4 = Eigen::Matrix<double, 4, 4, Eigen::DontAlign>;
/// Matrix of doubles of any size. Unlike with Eigen::MatrixXd, its memory is allocated and freed in
/// the same way for all compiler options, so that programs and library can exchange it.
using MatrixX = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::DontAlign>;

}  // namespace vlp
