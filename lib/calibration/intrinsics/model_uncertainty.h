// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/intrinsics/lens_choice.h"
#include "calibration/intrinsics/valid_region.h"

namespace vlp {

/// Part of the uncertainty of a lens that comes from the choice of its model, as one standard
/// deviation (compute_model_uncertainty()).
struct ModelUncertainty {
  /// Model whose fit differs most.
  LensModel model;
  /// Change of each intrinsic, in the order of the lens model.
  Eigen::VectorXd intrinsics;
  /// Change of projections over the region where the lens is known, mean and maximum, px.
  double mean_px, worst_px;
};

/// Computes the uncertainty of a lens from the choice of its model: its difference to the fits of
/// the other models that cross-validation does not reject. If it rejects the model of the lens, all
/// models that fit better count, too. With the solution c, another model m,
/// and pixels v of the region,
///   d_m(v)  pixel of m on the ray of v through c, minus v; after the rotation that aligns the rays
///   s       larger one of the expected largest errors of c and of m from noise, px
///   a_m     sqrt(max(0, 1 - s^2 / max |d_m|^2))
/// the result is a_m d_m of the model with the largest a_m max |d_m|. Its intrinsics are the change
/// that causes it, by least squares over v, with a rotation free. Its mean and maximum are those
/// from c to m or from m to c, the larger ones: they differ if one lens compresses the rim.
///
/// The factor a_m removes what noise explains. The larger one of two models that both describe the
/// lens differs from the other by its own noise, which its covariance states: m of the covariance
/// by views, c of the report. Of such models with good views, a_m is 0. Fits that noise does not
/// explain cannot both be right.
///
/// All models that are not rejected count alike, and as a whole. Weights exp(elpd) would take
/// millions of corners with common errors for independent and prefer one model for a hundredth of
/// the residuals. The stated error then covers the difference to each of these models.
///
/// @param comparison  compare_lens_models() of the solution
/// @param region      CalibrationReport::region
/// @param noise_px    CalibrationReport::uncertainty_worst_px
/// @return std::nullopt if noise explains all differences
std::optional<ModelUncertainty> compute_model_uncertainty(const IntrinsicsSolution& solution,
                                                          const LensChoice& comparison,
                                                          const ImageRegion& region,
                                                          double noise_px);

}  // namespace vlp
