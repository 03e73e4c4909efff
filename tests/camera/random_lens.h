// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "support/mrcal_oracle.h"
#include "support/random.h"

namespace vlp {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// For GoogleTest, which looks for it next to the type.
inline void PrintTo(LensModel model, std::ostream* out) { *out << name_of(model); }

inline constexpr LensModel kMrcalModels[] = {LensModel::pinhole, LensModel::stereographic,
                                             LensModel::opencv4, LensModel::opencv5,
                                             LensModel::opencv8, LensModel::opencv12};
inline constexpr LensModel kEveryModel[] = {
    LensModel::pinhole, LensModel::stereographic, LensModel::opencv4, LensModel::opencv5,
    LensModel::opencv8, LensModel::opencv12,      LensModel::fisheye};
inline constexpr LensModel kOpencvModels[] = {LensModel::opencv4, LensModel::opencv5,
                                              LensModel::opencv8, LensModel::opencv12};

/// A random plausible lens that is one to one up to 60 degrees off axis and a little more; the
/// rest is for its tangential and prism terms, which valid_radius() leaves out.
std::vector<double> random_parameters(LensModel model, Random& random);

/// A random point one to ten units away, up to 60 degrees off axis.
Eigen::Vector3d random_point(Random& random);

inline MrcalOracle oracle_of(LensModel model, const std::vector<double>& parameters) {
  return {std::string(name_of(model)), parameters};
}

/// A lens of 520 px focal length for an imager of 800 x 600 with these distortions.
std::vector<double> parameters_with(LensModel model, const std::vector<double>& distortion);

/// Without distortion.
inline Lens plain_lens(LensModel model) { return {model, parameters_with(model, {})}; }

/// The angle between two directions of any length; exact for small ones too.
double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace vlp
