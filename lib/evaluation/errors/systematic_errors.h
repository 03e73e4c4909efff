// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "evaluation/errors/fix_errors.h"

namespace vlp {

/// Describes mistakes in a ground truth or in a lamp map that explain almost all errors of the
/// fixes, one line each without a full stop:
///   positions  truth of the previous or the next row; a common offset; or the similarity
///                fix = s R truth + t  or  fix = s R mirror(truth) + t,  mirror(x, y) = (x, -y),
///              of least squares, with a scale s, a rotation R and an offset t; in complex numbers
///              relative to the means: s R = sum(conj(truth) fix) / sum(|truth|^2), Umeyama 1991
///   heights    a common offset
///   yaw        a common offset, or the opposite sense of rotation and an offset
/// Almost all: the 80 % quantile of the errors is at least 5 mm (heights 10 mm, yaw 1 degree) and
/// falls to less than a twentieth; with a similarity also to less than a twentieth of the spread of
/// the fixes. Returns none for fewer than six fixes.
std::vector<std::string> describe_systematic_errors(const FileRows<FixRow>& fixes,
                                                    const FileRows<TruthRow>& truth,
                                                    const std::vector<FixError>& errors);

}  // namespace vlp
