// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/intrinsics/rotation_vector.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/least_squares_oracle.h"
#include "support/random.h"

namespace vlp {
namespace {

TEST(MakePixelGrid, CoversImageIncludingItsEdges) {
  const auto grid = make_pixel_grid({401, 301}, 9);
  ASSERT_EQ(grid.size(), 9U * 7U);
  EXPECT_EQ(grid[0], Eigen::Vector2d(0, 0));
  EXPECT_EQ(grid[1], Eigen::Vector2d(50, 0));
  EXPECT_EQ(grid[9], Eigen::Vector2d(0, 50));
  EXPECT_EQ(grid.back(), Eigen::Vector2d(400, 300));
  EXPECT_EQ(make_pixel_grid({300, 400}, 3).size(), 3U * 4U);
  EXPECT_EQ(make_pixel_grid({1000, 10}, 4).size(), 4U * 2U) << "two rows at least";
}

TEST(CompareProjections, ReturnsZeroForIdenticalLenses) {
  const Lens lens = synthetic_lens();
  EXPECT_LT(compare_projections(lens, lens, {800, 600}, even).value().worst_px, 1e-6);
}

// A displaced center is equivalent to a rotation, except for terms of second order in the angle.
TEST(CompareProjections, IgnoresPrincipalPointShiftEquivalentToRotation) {
  const std::array near{3000.0, 3000.0, 400.0, 300.0}, shifted{3000.0, 3000.0, 403.0, 300.0};
  const auto difference = compare_projections(Lens(LensModel::pinhole, near),
                                              Lens(LensModel::pinhole, shifted), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->worst_px, 0.1);
}

TEST(CompareProjections, WorstPixelMatchesFocalLengthDifferenceAtImageCorner) {
  const std::array one{500.0, 500.0, 399.5, 299.5}, other{501.0, 501.0, 399.5, 299.5};
  const auto difference = compare_projections(Lens(LensModel::pinhole, one),
                                              Lens(LensModel::pinhole, other), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_NEAR(difference->worst_px, 500.0 / 500, 0.01);  // the corner, 500 px from the center
}

Lens pinhole_lens(double fx, double fy, double cx, double cy) {
  return Lens(LensModel::pinhole, std::array{fx, fy, cx, cy});
}

// Lenses with the same center in the middle of the image have no rotation between them. Pixels move
// by the relative difference of the focal lengths.
TEST(CompareProjections, MatchesStatisticsOfScaledPixels) {
  const auto difference = compare_projections(
      pinhole_lens(500, 400, 399.5, 249.5), pinhole_lens(501, 403, 399.5, 249.5), {800, 500}, even);
  ASSERT_TRUE(difference);
  double sum = 0, squares = 0, worst = 0;
  const auto pixels = make_pixel_grid({800, 500});
  ASSERT_EQ(pixels.size(), 41U * 26U);
  for (const auto& pixel : pixels) {
    const double distance =
        std::hypot((pixel.x() - 399.5) * 1 / 500, (pixel.y() - 249.5) * 3 / 400);
    sum += distance;
    squares += distance * distance;
    worst = std::max(worst, distance);
  }
  EXPECT_NEAR(difference->mean_px, sum / 1066, 1e-9);
  EXPECT_NEAR(difference->rms_px, std::sqrt(squares / (2 * 1066)), 1e-9);
  EXPECT_NEAR(difference->worst_px, worst, 1e-9);
}

constexpr std::array kExpectedImager_px{800, 600};
/// Derivatives of the pixels of a region, stacked, with respect to the parameters of a lens. The
/// rotation that removes most of each change is removed.
Eigen::MatrixXd align_derivatives(LensModel model, const std::vector<double>& parameters,
                                  const ImageRegion& rectangle) {
  std::vector<Eigen::Vector3d> rays;
  for (const auto& pixel : make_pixel_grid(kExpectedImager_px)) {
    if (!rectangle.empty() &&
        ((pixel - rectangle[0]).minCoeff() < 0 || (rectangle[2] - pixel).minCoeff() < 0)) {
      continue;
    }
    if (const auto ray = Lens(model, parameters).unproject_pixel(pixel))
      rays.push_back(ray->direction);
  }
  Eigen::VectorXd at = Eigen::VectorXd::Zero(std::ssize(parameters) + 3);
  at.tail(std::ssize(parameters)) =
      Eigen::Map<const Eigen::VectorXd>(parameters.data(), std::ssize(parameters));
  const Eigen::MatrixXd jacobian = differentiate_numerically(
      [&](const Eigen::VectorXd& x) {
        const Lens lens(model, std::vector<double>(x.begin() + 3, x.end()));
        const Eigen::Matrix3d rotation = rotation_from_vector(x.head<3>());
        Eigen::VectorXd pixels(2 * std::ssize(rays));
        for (std::size_t i = 0; i < rays.size(); ++i) {
          pixels.segment<2>(2 * static_cast<Eigen::Index>(i)) =
              lens.project_point(rotation * rays[i]).value();
        }
        return pixels;
      },
      at);
  const Eigen::MatrixXd d_rotation = jacobian.leftCols<3>(),
                        d_parameters = jacobian.rightCols(std::ssize(parameters));
  return d_parameters - d_rotation * d_rotation.colPivHouseholderQr().solve(d_parameters);
}

/// Covariance with correlations, with standard deviations in the ratio of `sds`.
Eigen::MatrixXd make_correlated_covariance(const Eigen::VectorXd& sds) {
  Eigen::MatrixXd factor = Eigen::MatrixXd::Identity(sds.size(), sds.size());
  for (Eigen::Index i = 1; i < sds.size(); ++i) factor(i, i - 1) = 0.6;
  factor = sds.asDiagonal() * factor;
  return factor * factor.transpose();
}

const std::vector<double> kRadialLens{500, 520, 390, 310, -0.1, 0.03, 0.001, -0.002};

TEST(PredictDifference, MatchesDifferenceQuotients) {
  Eigen::VectorXd sds(8);
  sds << 0.5, 0.6, 0.4, 0.3, 1e-3, 2e-3, 1e-4, 2e-4;
  const Eigen::MatrixXd covariance = make_correlated_covariance(sds);
  const Lens lens(LensModel::opencv4, kRadialLens);
  for (const ImageRegion& region :
       {ImageRegion(), ImageRegion{{110, 55}, {610, 55}, {610, 405}, {110, 405}}}) {
    const Eigen::MatrixXd changes = align_derivatives(LensModel::opencv4, kRadialLens, region);
    ASSERT_EQ(changes.rows(), region.empty() ? 2 * 41 * 31 : 2 * 25 * 18);
    const Eigen::MatrixXd root = covariance.llt().matrixL();
    const Eigen::MatrixXd uncorrelated = changes * root / std::sqrt(changes.rows());
    const auto expected = predict_difference(lens, kExpectedImager_px, covariance, region);
    const double mean = uncorrelated.squaredNorm();
    EXPECT_NEAR(expected.rms_px, std::sqrt(mean), 1e-5 * std::sqrt(mean));
    const double degrees_of_freedom =
        mean * mean / (uncorrelated.transpose() * uncorrelated).squaredNorm();
    EXPECT_NEAR(expected.degrees_of_freedom, degrees_of_freedom, 1e-5 * degrees_of_freedom);
    EXPECT_GT(degrees_of_freedom, 1.2);
  }
}

double compute_largest_pixel_change(const Eigen::VectorXd& stacked) {
  return std::sqrt(stacked.reshaped(2, stacked.size() / 2).colwise().squaredNorm().maxCoeff());
}

TEST(PredictMaxDifference, MatchesRandomDrawsForSeveralUnknowns) {
  const Lens lens(LensModel::opencv4, kRadialLens);
  Eigen::VectorXd sds(8);
  sds << 0.5, 0.6, 0.4, 0.3, 2e-3, 2e-3, 4e-4, 5e-4;
  const Eigen::MatrixXd covariance = make_correlated_covariance(sds);
  const ImageRegion region{{110, 55}, {210, 55}, {210, 155}, {110, 155}};
  const Eigen::MatrixXd changes = align_derivatives(LensModel::opencv4, kRadialLens, region);
  const Eigen::MatrixXd root = covariance.llt().matrixL();
  Random random(4);
  double squares = 0;
  constexpr int draws = 2000;
  for (int draw = 0; draw < draws; ++draw) {
    Eigen::VectorXd normal(8);
    for (double& value : normal) value = random.normal();
    squares += std::pow(compute_largest_pixel_change(changes * (root * normal)), 2) / draws;
  }
  EXPECT_NEAR(
      predict_max_difference_px(lens, kExpectedImager_px, covariance, region) / std::sqrt(squares),
      1, 0.15);
}

}  // namespace
}  // namespace vlp
