// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_difference.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "calibration/intrinsics/synthetic_views.h"
#include "support/random.h"

namespace vlp {
namespace {

TEST(MakeRegularPixelGrid, CoversImageIncludingItsEdges) {
  const auto grid = make_regular_pixel_grid({401, 301}, 9);
  ASSERT_EQ(grid.size(), 9U * 7U);
  EXPECT_EQ(grid[0], Eigen::Vector2d(0, 0));
  EXPECT_EQ(grid[1], Eigen::Vector2d(50, 0));
  EXPECT_EQ(grid[9], Eigen::Vector2d(0, 50));
  EXPECT_EQ(grid.back(), Eigen::Vector2d(400, 300));
  EXPECT_EQ(make_regular_pixel_grid({300, 400}, 3).size(), 3U * 4U);
  EXPECT_EQ(make_regular_pixel_grid({1000, 10}, 4).size(), 4U * 2U) << "two rows at least";
}

TEST(ComputeProjectionDifference, ReturnsZeroForIdenticalLenses) {
  const Lens lens = synthetic_lens();
  EXPECT_LT(compute_projection_difference(lens, lens, {800, 600}, even).value().worst_px, 1e-6);
}

// A displaced center is equivalent to a rotation, except for terms of second order in the angle.
TEST(ComputeProjectionDifference, IgnoresPrincipalPointShiftEquivalentToRotation) {
  const std::array near{3000.0, 3000.0, 400.0, 300.0}, shifted{3000.0, 3000.0, 403.0, 300.0};
  const auto difference = compute_projection_difference(
      Lens(LensModel::pinhole, near), Lens(LensModel::pinhole, shifted), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_LT(difference->worst_px, 0.1);
}

TEST(ComputeProjectionDifference, WorstPixelMatchesFocalLengthDifferenceAtImageCorner) {
  const std::array one{500.0, 500.0, 399.5, 299.5}, other{501.0, 501.0, 399.5, 299.5};
  const auto difference = compute_projection_difference(
      Lens(LensModel::pinhole, one), Lens(LensModel::pinhole, other), {800, 600}, even);
  ASSERT_TRUE(difference);
  EXPECT_NEAR(difference->worst_px, 500.0 / 500, 0.01);  // the corner, 500 px from the center
}

Lens pinhole_lens(double fx, double fy, double cx, double cy) {
  return Lens(LensModel::pinhole, std::array{fx, fy, cx, cy});
}

/// Fisheye around (400, 300) that ends 122 px from its center.
Lens narrow_fisheye() {
  return Lens(LensModel::fisheye, std::array{100.0, 100.0, 400.0, 300.0, -0.1, 0.0, 0.0, 0.0});
}

Eigen::Vector3d unit_ray(const Lens& lens, const Eigen::Vector2d& pixel) {
  return lens.unproject_pixel(pixel).value().direction.normalized();
}

/// Rotation of rays of `a` to those of `b` by quaternions (Horn, 1987).
Eigen::Matrix3d compute_rotation_by_quaternions(
    const Lens& a, const Lens& b, const std::vector<Eigen::Vector2d>& pixels,
    const std::function<double(const Eigen::Vector2d&)>& weight) {
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
  for (const auto& pixel : pixels) {
    s += weight(pixel) * unit_ray(a, pixel) * unit_ray(b, pixel).transpose();
  }
  const Eigen::Vector3d axis(s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0));
  Eigen::Matrix4d n;
  n(0, 0) = s.trace();
  n.block<3, 1>(1, 0) = axis;
  n.block<1, 3>(0, 1) = axis.transpose();
  n.block<3, 3>(1, 1) = s + s.transpose() - s.trace() * Eigen::Matrix3d::Identity();
  const Eigen::Vector4d q =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(n).eigenvectors().rightCols<1>();
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

TEST(FitRotationBetweenLenses, MatchesRotationByQuaternions) {
  const Lens a = pinhole_lens(500, 520, 380, 310), b = pinhole_lens(530, 510, 430, 250);
  const std::vector<Eigen::Vector2d> pixels{{20, 40}, {700, 90}, {650, 580}, {90, 500}, {300, 200}};
  const auto rotation = fit_rotation_between_lenses(a, b, pixels);
  ASSERT_TRUE(rotation);
  const auto same = [](const auto&) { return 1.0; };
  EXPECT_LT((*rotation - compute_rotation_by_quaternions(a, b, pixels, same)).norm(), 1e-9);
  EXPECT_GT((*rotation - Eigen::Matrix3d::Identity()).norm(), 0.05);
}

TEST(FitRotationBetweenLenses, NeedsThreePixelsWithRaysOfBothLenses) {
  const Lens wide = pinhole_lens(500, 500, 400, 300), narrow = narrow_fisheye();
  ASSERT_TRUE(narrow.unproject_pixel({420, 310}));
  ASSERT_FALSE(narrow.unproject_pixel({600, 300}));
  const std::vector<Eigen::Vector2d> pixels{{420, 310}, {380, 350}, {390, 260}};
  EXPECT_TRUE(fit_rotation_between_lenses(wide, narrow, pixels));
  EXPECT_FALSE(fit_rotation_between_lenses(wide, narrow, std::span(pixels).first(2)));
  const std::vector<Eigen::Vector2d> two_common{{420, 310}, {380, 350}, {600, 300}};
  EXPECT_FALSE(fit_rotation_between_lenses(wide, narrow, two_common));
  EXPECT_FALSE(fit_rotation_between_lenses(narrow, wide, two_common));
}

/// Rays of pixels on a line lie in a plane: a reflection would fit equally well.
TEST(FitRotationBetweenLenses, IsProperRotationForPixelsOnLine) {
  const Lens a = pinhole_lens(500, 500, 400, 300), b = pinhole_lens(540, 500, 370, 330);
  for (const Eigen::Vector2d& direction :
       {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(1, 1), Eigen::Vector2d(2, -1),
        Eigen::Vector2d(-1, 3)}) {
    std::vector<Eigen::Vector2d> pixels;
    for (const double along : {-80.0, -30.0, 10.0, 70.0}) {
      pixels.emplace_back(Eigen::Vector2d(350, 280) + along * direction);
    }
    const auto rotation = fit_rotation_between_lenses(a, b, pixels);
    ASSERT_TRUE(rotation);
    EXPECT_NEAR(rotation->determinant(), 1, 1e-9);
    EXPECT_LT((*rotation * rotation->transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

// Lenses with the same center in the middle of the image have no rotation between them. Pixels move
// by the relative difference of the focal lengths.
TEST(ComputeProjectionDifference, MatchesStatisticsOfScaledPixels) {
  const auto difference = compute_projection_difference(
      pinhole_lens(500, 400, 399.5, 249.5), pinhole_lens(501, 403, 399.5, 249.5), {800, 500}, even);
  ASSERT_TRUE(difference);
  double sum = 0, squares = 0, worst = 0;
  const auto pixels = make_regular_pixel_grid({800, 500});
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

TEST(ComputeProjectionDifference, SkipsPixelsWithoutPositiveFiniteSigma) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const double skipped : {0.0, -1.0, inf, std::nan("")}) {
    // Pixels up to 200 px left and right of the middle, and 100 px above and below.
    const auto difference = compute_projection_difference(
        pinhole_lens(500, 500, 400, 300), pinhole_lens(501, 502, 400, 300), {801, 601},
        [&](const Eigen::Vector2d& pixel) {
          const Eigen::Vector2d from_middle = (pixel - Eigen::Vector2d(400, 300)).cwiseAbs();
          return from_middle.x() < 201 && from_middle.y() < 101 ? 0.5 : skipped;
        });
    ASSERT_TRUE(difference);
    EXPECT_NEAR(difference->worst_px, std::hypot(200 * 1 / 500.0, 100 * 2 / 500.0), 1e-9);
  }
}

TEST(ComputeProjectionDifference, NeedsThreePixelsOfBothLenses) {
  const Lens lens = pinhole_lens(500, 500, 400, 300);
  for (const int count : {2, 3}) {
    int seen = 0;
    const auto difference =
        compute_projection_difference(lens, lens, {801, 601}, [&](const Eigen::Vector2d&) {
          return ++seen <= count ? 1.0 : std::numeric_limits<double>::infinity();
        });
    EXPECT_EQ(difference.has_value(), count == 3);
  }
  // Only pixels near the middle have rays of the fisheye.
  const auto common = compute_projection_difference(narrow_fisheye(), lens, {801, 601}, even);
  ASSERT_TRUE(common);
  EXPECT_FALSE(compute_projection_difference(
      narrow_fisheye(), lens, {801, 601}, [](const Eigen::Vector2d& pixel) {
        return pixel.x() > 600 ? 1.0 : std::numeric_limits<double>::infinity();
      }));
  EXPECT_FALSE(compute_projection_difference(
      lens, narrow_fisheye(), {801, 601}, [](const Eigen::Vector2d& pixel) {
        return pixel.x() > 600 ? 1.0 : std::numeric_limits<double>::infinity();
      }));
}

TEST(ComputeProjectionDifference, WeightsRotationByInverseSquareOfSigma) {
  const Lens a = pinhole_lens(500, 510, 380, 310), b = pinhole_lens(505, 512, 430, 250);
  const auto sigma_px = [](const Eigen::Vector2d& pixel) {
    return 0.2 + pixel.x() / 200 + pixel.y() / 500;
  };
  const auto difference = compute_projection_difference(a, b, {801, 601}, sigma_px);
  ASSERT_TRUE(difference);
  const auto pixels = make_regular_pixel_grid({801, 601});
  const Eigen::Matrix3d rotation = compute_rotation_by_quaternions(
      a, b, pixels, [&](const Eigen::Vector2d& pixel) { return std::pow(sigma_px(pixel), -2); });
  double sum = 0, squares = 0, worst = 0;
  for (const auto& pixel : pixels) {
    const Eigen::Vector3d ray = rotation * unit_ray(a, pixel);
    const Eigen::Vector2d in_b(505 * ray.x() / ray.z() + 430, 512 * ray.y() / ray.z() + 250);
    const double distance = (in_b - pixel).norm();
    sum += distance;
    squares += distance * distance;
    worst = std::max(worst, distance);
  }
  const auto count = static_cast<double>(pixels.size());
  EXPECT_NEAR(difference->mean_px, sum / count, 1e-8);
  EXPECT_NEAR(difference->rms_px, std::sqrt(squares / count / 2), 1e-8);
  EXPECT_NEAR(difference->worst_px, worst, 1e-8);
}

constexpr std::array kExpectedImager_px{800, 600};
constexpr double kDerivativeStep = 1e-6;

/// Derivatives of the pixels of a region, stacked, with respect to the parameters of a lens. The
/// rotation that removes most of each change is removed. By difference quotients and QR.
Eigen::MatrixXd compute_aligned_derivatives(LensModel model, const std::vector<double>& parameters,
                                            const ImageRegion& rectangle) {
  const Lens lens(model, parameters);
  std::vector<Eigen::Vector3d> rays;
  for (const auto& pixel : make_regular_pixel_grid(kExpectedImager_px)) {
    if (!rectangle.empty() &&
        ((pixel - rectangle[0]).minCoeff() < 0 || (rectangle[2] - pixel).minCoeff() < 0)) {
      continue;
    }
    if (const auto ray = lens.unproject_pixel(pixel)) rays.push_back(ray->direction);
  }
  const auto project_all = [&](const Lens& by, const Eigen::Matrix3d& rotation) {
    Eigen::VectorXd pixels(2 * std::ssize(rays));
    for (std::size_t i = 0; i < rays.size(); ++i) {
      pixels.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          by.project_point(rotation * rays[i]).value();
    }
    return pixels;
  };
  const Eigen::Matrix3d none = Eigen::Matrix3d::Identity();
  Eigen::MatrixXd d_rotation(2 * std::ssize(rays), 3);
  for (int axis = 0; axis < 3; ++axis) {
    const auto turn = [&](double angle) {
      return Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
    };
    d_rotation.col(axis) =
        (project_all(lens, turn(kDerivativeStep)) - project_all(lens, turn(-kDerivativeStep))) /
        (2 * kDerivativeStep);
  }
  Eigen::MatrixXd d_parameters(2 * std::ssize(rays), std::ssize(parameters));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    auto more = parameters, less = parameters;
    const double step = k < 4 ? 1e-3 : kDerivativeStep;
    more[k] += step;
    less[k] -= step;
    d_parameters.col(static_cast<Eigen::Index>(k)) =
        (project_all(Lens(model, more), none) - project_all(Lens(model, less), none)) / (2 * step);
  }
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

TEST(ComputeExpectedProjectionDifference, MatchesDifferenceQuotients) {
  Eigen::VectorXd sds(8);
  sds << 0.5, 0.6, 0.4, 0.3, 1e-3, 2e-3, 1e-4, 2e-4;
  const Eigen::MatrixXd covariance = make_correlated_covariance(sds);
  const Lens lens(LensModel::opencv4, kRadialLens);
  for (const ImageRegion& region :
       {ImageRegion(), ImageRegion{{110, 55}, {610, 55}, {610, 405}, {110, 405}}}) {
    const Eigen::MatrixXd changes =
        compute_aligned_derivatives(LensModel::opencv4, kRadialLens, region);
    ASSERT_EQ(changes.rows(), region.empty() ? 2 * 41 * 31 : 2 * 25 * 18);
    const Eigen::MatrixXd root = covariance.llt().matrixL();
    const Eigen::MatrixXd uncorrelated = changes * root / std::sqrt(changes.rows());
    const auto expected =
        compute_expected_projection_difference(lens, kExpectedImager_px, covariance, region);
    const double mean = uncorrelated.squaredNorm();
    EXPECT_NEAR(expected.rms_px, std::sqrt(mean), 1e-5 * std::sqrt(mean));
    const double degrees_of_freedom =
        mean * mean / (uncorrelated.transpose() * uncorrelated).squaredNorm();
    EXPECT_NEAR(expected.degrees_of_freedom, degrees_of_freedom, 1e-5 * degrees_of_freedom);
    EXPECT_GT(degrees_of_freedom, 1.2);
  }
}

TEST(ComputeExpectedProjectionDifference, CountsPixelsWithRaysOnly) {
  const std::vector<double> parameters{100, 100, 400, 300, -0.1, 0, 0, 0};
  const Lens lens(LensModel::fisheye, parameters);
  const Eigen::MatrixXd covariance =
      Eigen::Vector<double, 8>(0.04, 0.01, 0, 0, 0, 0, 0, 0).asDiagonal();
  // A region within the image circle, so that difference quotients exist.
  const ImageRegion region{{335, 215}, {465, 215}, {465, 385}, {335, 385}};
  const Eigen::MatrixXd changes =
      compute_aligned_derivatives(LensModel::fisheye, parameters, region);
  const double mean =
      (changes * covariance * changes.transpose()).trace() / static_cast<double>(changes.rows());
  const auto inside =
      compute_expected_projection_difference(lens, kExpectedImager_px, covariance, region);
  EXPECT_NEAR(inside.rms_px, std::sqrt(mean), 1e-5 * std::sqrt(mean));
  const auto everywhere =
      compute_expected_projection_difference(lens, kExpectedImager_px, covariance);
  EXPECT_TRUE(std::isfinite(everywhere.rms_px));
  EXPECT_GT(everywhere.rms_px, inside.rms_px);
}

TEST(ComputeExpectedProjectionDifference, IsInfiniteForUnknownCovariance) {
  const Lens lens(LensModel::opencv4, kRadialLens);
  const Eigen::MatrixXd unknown =
      Eigen::MatrixXd::Constant(8, 8, std::numeric_limits<double>::infinity());
  const auto expected = compute_expected_projection_difference(lens, kExpectedImager_px, unknown);
  EXPECT_TRUE(std::isinf(expected.rms_px));
  EXPECT_EQ(expected.degrees_of_freedom, 1);
  EXPECT_TRUE(std::isinf(
      estimate_expected_max_projection_difference_px(lens, kExpectedImager_px, unknown)));
}

double compute_largest_pixel_change(const Eigen::VectorXd& stacked) {
  return std::sqrt(stacked.reshaped(2, stacked.size() / 2).colwise().squaredNorm().maxCoeff());
}

// With a single unknown, all pixels change by the same random factor, with a mean square of 1. The
// mean square of 200 draws has a standard deviation of 10 %.
TEST(EstimateExpectedMaxProjectionDifference, MatchesLargestChangeForSingleUnknown) {
  const Lens lens(LensModel::opencv4, kRadialLens);
  const ImageRegion region{{110, 55}, {610, 55}, {610, 405}, {110, 405}};
  Eigen::VectorXd first = Eigen::VectorXd::Zero(8), all(8);
  first[0] = 0.7;
  all << 0.5, -0.6, 0.4, 0.3, 1e-3, -2e-3, 1e-4, 2e-4;
  std::vector<double> ratios;
  for (const Eigen::VectorXd& direction : {first, all}) {
    for (const ImageRegion& part : {ImageRegion(), region}) {
      const double largest_px = compute_largest_pixel_change(
          compute_aligned_derivatives(LensModel::opencv4, kRadialLens, part) * direction);
      ratios.push_back(estimate_expected_max_projection_difference_px(
                           lens, kExpectedImager_px, direction * direction.transpose(), part) /
                       largest_px);
    }
  }
  EXPECT_NEAR(ratios[0], 1, 0.13);
  for (const double ratio : ratios) EXPECT_NEAR(ratio, ratios[0], 1e-5);
}

TEST(EstimateExpectedMaxProjectionDifference, MatchesRandomDrawsForSeveralUnknowns) {
  const Lens lens(LensModel::opencv4, kRadialLens);
  Eigen::VectorXd sds(8);
  sds << 0.5, 0.6, 0.4, 0.3, 2e-3, 2e-3, 4e-4, 5e-4;
  const Eigen::MatrixXd covariance = make_correlated_covariance(sds);
  const ImageRegion region{{110, 55}, {210, 55}, {210, 155}, {110, 155}};
  const Eigen::MatrixXd changes =
      compute_aligned_derivatives(LensModel::opencv4, kRadialLens, region);
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
      estimate_expected_max_projection_difference_px(lens, kExpectedImager_px, covariance, region) /
          std::sqrt(squares),
      1, 0.15);
}

}  // namespace
}  // namespace vlp
