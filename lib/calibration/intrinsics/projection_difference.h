// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calibration/intrinsics/valid_region.h"
#include "camera/lens.h"

namespace vlp {

/// Returns a regular grid of pixels (u, v) over the image including its edges, row by row. It has
/// `cols` columns, and rows about equally far apart.
std::vector<Eigen::Vector2d> make_pixel_grid(const std::array<int, 2>& imager_px, int cols = 41);

/// Fits the rotation R from the camera frame of `a` to that of `b`: unit rays of the same pixels
/// satisfy ray_b = R ray_a. Least squares over the pixels for which both lenses have a ray.
/// @return std::nullopt for fewer than three such pixels
std::optional<Eigen::Matrix3d> fit_lens_rotation(const Lens& a, const Lens& b,
                                                 std::span<const Eigen::Vector2d> pixels);

/// Difference between the projections of two lenses over the image.
struct ProjectionDifference {
  /// Mean and maximum distance between the projections, px.
  double mean_px, worst_px;
  /// RMS per axis, px: root of the mean squared distance divided by sqrt(2).
  double rms_px;
};

/// Compares the projections of two lenses over the image. Every pixel of make_pixel_grid()
/// is unprojected by `a`, rotated by the best-fitting rotation of the rays and projected by `b`.
/// The rotation is removed because the frame of a lens is a convention (mrcal, "Projection
/// differences").
///
/// @param sigma_px  standard deviation at a pixel, for the weights of the rotation; pixels with an
///     infinite one are skipped
/// @return std::nullopt if the lenses have fewer than three such pixels in common
std::optional<ProjectionDifference> compare_projections(
    const Lens& a, const Lens& b, const std::array<int, 2>& imager_px,
    const std::function<double(const Eigen::Vector2d&)>& sigma_px);

/// Expected difference between the projections of an estimated lens and the true one
/// (compare_projections()).
struct ExpectedDifference {
  /// Expected RMS distance between the projections of the two lenses over the image, per axis, px.
  double rms_px;
  /// Effective number of independent terms of similar size in the mean square, whose relative
  /// standard deviation is sqrt(2 / degrees_of_freedom).
  double degrees_of_freedom;
};

/// Computes the expected difference from the covariance of the intrinsics, to first order. Weights
/// are uniform over the image, or over `region` if it is not empty.
///
/// The difference is smaller than the projection uncertainty, which includes rotations of the
/// camera relative to the boards. Aligning two lenses removes such rotations. Infinite if the
/// covariance is not finite.
ExpectedDifference predict_difference(const Lens& lens, const std::array<int, 2>& imager_px,
                                      const Eigen::MatrixXd& covariance,
                                      const ImageRegion& region = {});

/// Estimates the root of the expected square of the largest difference over the same pixels, px,
/// from 200 random draws with a fixed seed.
///
/// It exceeds the largest standard deviation of a single pixel, because the maximum is over many
/// pixels. Infinite if the covariance is not finite.
double predict_max_difference_px(const Lens& lens, const std::array<int, 2>& imager_px,
                                 const Eigen::MatrixXd& covariance, const ImageRegion& region = {});

}  // namespace vlp
