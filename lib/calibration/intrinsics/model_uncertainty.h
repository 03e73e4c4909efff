// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "calibration/intrinsics/lens_choice.h"
#include "calibration/intrinsics/valid_region.h"

namespace vlp {

/// Part of the uncertainty of a lens that comes from the choice of its model
/// (combine_model_fits()).
struct ModelUncertainty {
  /// Model m with the largest D_m^2 - s_m^2, see combine_model_fits().
  LensModel model;
  /// Covariance of the intrinsics, in the order of the lens model. Its rank is at most the number
  /// of the other models.
  Eigen::MatrixXd intrinsics_covariance;
  /// Standard deviation of projections over the region where the lens is known, mean and maximum,
  /// px.
  double mean_px, worst_px;
};

/// Returns the fits of the other models that may describe the lens of a solution: those that
/// cross-validation does not reject. If it rejects the model of the lens, all models that fit
/// better count, too.
/// @param comparison  compare_lens_models() of the solution
std::vector<IntrinsicsSolution> list_plausible_model_fits(const IntrinsicsSolution& solution,
                                                          const LensChoice& comparison);

/// Computes the uncertainty of a lens from the choice of its model: its differences to the fits of
/// the other models. With the solution c, another model m, and pixels v of the region,
///   r_c(v), r_m(v)  unit rays of v through both lenses, rotated so that they agree best
///   d_m(v)   displacement from c to m, to first order: (d pixel / d ray of m) (r_c - r_m)
///   D_m      maximum of l_m(v); the directions differ where one lens compresses the rim
///   s_m      larger one of the expected largest errors of c and of m from noise, px
///   b_m      d_m of all pixels in one vector, scaled to the length D_m
///   w_m      max(0, 1 - 1 / (b_m' (s_m^2 1 + sum of w_k b_k b_k')^-1 b_m)), with the sum over the
///            models k with larger D_k^2 - s_k^2
/// the variance at v is the sum of w_m l_m(v)^2, where l_m(v) is the larger length of the
/// displacements from c to m and from m to c. The covariance of the intrinsics is the sum of
/// w_m i_m i_m'. The change i_m of the intrinsics causes d_m by least squares over v, with a free
/// rotation.
///
/// The weight w_m is the smallest one with which noise and models together cover the difference to
/// m as one standard deviation. For the first model it is 1 - s_m^2 / D_m^2, which removes what
/// noise explains. The larger one of two models that both describe the lens differs from the other
/// by its own noise, which its covariance states; of such models with good views, w_m is 0. A
/// difference parallel to a larger one has the weight 0, one in another direction adds to the
/// covariance.
///
/// All models that are not rejected count alike. Weights exp(elpd) would take millions of corners
/// with common errors for independent and prefer one model for a hundredth of the residual.
///
/// @param others    list_plausible_model_fits()
/// @param region    CalibrationReport::region, where each of these lenses has rays
/// @param noise_px  CalibrationReport::uncertainty_worst_px
/// @return std::nullopt if noise explains all differences
std::optional<ModelUncertainty> combine_model_fits(const IntrinsicsSolution& solution,
                                                   std::span<const IntrinsicsSolution> others,
                                                   const ImageRegion& region, double noise_px);

}  // namespace vlp
