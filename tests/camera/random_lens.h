// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <ostream>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "camera/spline_surface.h"
#include "support/mrcal_oracle.h"
#include "support/random.h"

namespace vlp {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// For GoogleTest, which looks for it next to the type; names of tests have no equals sign.
inline void PrintTo(LensModel model, std::ostream* out) {
  for (const char letter : lens_model_name(model)) {
    if (letter != '=') *out << letter;
  }
}

inline constexpr LensModel kCubic = splined_lens_model({3, 16, 14, 190}),
                           kQuadratic = splined_lens_model({2, 12, 11, 160});
inline constexpr LensModel kMrcalModels[] = {LensModel::pinhole,
                                             LensModel::stereographic,
                                             LensModel::opencv4,
                                             LensModel::opencv5,
                                             LensModel::opencv8,
                                             LensModel::opencv12,
                                             kCubic,
                                             kQuadratic};
inline constexpr LensModel kEveryModel[] = {
    LensModel::pinhole, LensModel::stereographic, LensModel::opencv4, LensModel::opencv5,
    LensModel::opencv8, LensModel::opencv12,      LensModel::fisheye, kCubic,
    kQuadratic};
inline constexpr LensModel kOpencvModels[] = {LensModel::opencv4, LensModel::opencv5,
                                              LensModel::opencv8, LensModel::opencv12};

/// Splined lens: equidistant, d(a) = a, with independent errors at each control point.
std::vector<double> splined_parameters(const SplineGrid& grid, double error, Random& random);

/// A random plausible lens that is one to one up to 60 degrees off axis and a little more; the
/// rest is for its tangential and prism terms, which compute_max_radius() leaves
/// out.
std::vector<double> random_parameters(LensModel model, Random& random);

/// A random point one to ten units away, up to 60 degrees off axis.
Eigen::Vector3d random_point(Random& random);

inline MrcalOracle make_oracle(LensModel model, const std::vector<double>& parameters) {
  return {std::string(lens_model_name(model)), parameters};
}

/// A lens of 520 px focal length for an imager of 800 x 600 with these distortions.
std::vector<double> parameters_with(LensModel model, const std::vector<double>& distortion);

/// Without distortion.
inline Lens plain_lens(LensModel model) { return {model, parameters_with(model, {})}; }

/// d pixel / d parameters, a column for each. Precondition: the lens projects the point.
Eigen::Matrix2Xd parameter_jacobian(const Lens& lens, const Eigen::Vector3d& x_in_camera);

/// The angle between two directions of any length; exact for small ones too.
double angle_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace vlp
