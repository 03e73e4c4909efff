// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/symmetric.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <limits>

#include "support/matchers.h"

namespace vlp {
namespace {

TEST(Eigendecompose, AscendingEigenvaluesAndVectorsReconstructMatrix) {
  Eigen::Matrix2d two;
  two << 5, 2, 2, 3;
  Eigen::MatrixXd four(4, 4);
  four << 4, 1, 0, -1, 1, 3, 2, 0, 0, 2, 5, 1, -1, 0, 1, 2;
  const auto expect_same = [](const auto& eigen, const auto& matrix) {
    for (Eigen::Index i = 1; i < eigen.values.size(); ++i) {
      EXPECT_LT(eigen.values[i - 1], eigen.values[i]);
    }
    EXPECT_THAT(
        Eigen::MatrixXd(eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose()),
        IsNear(Eigen::MatrixXd(matrix), 1e-14));
  };
  expect_same(eigendecompose(two), two);
  expect_same(eigendecompose(four), four);
}

TEST(Eigendecompose, ReturnsNanForNanMatrix) {
  const Eigen::MatrixXd none =
      Eigen::MatrixXd::Constant(3, 3, std::numeric_limits<double>::quiet_NaN());
  const auto eigen = eigendecompose(none);
  EXPECT_FALSE(eigen.values.minCoeff() > 0);
  ASSERT_EQ(eigen.values.size(), 3);
  ASSERT_EQ(eigen.vectors.rows(), 3);
  ASSERT_EQ(eigen.vectors.cols(), 3);
  EXPECT_TRUE(eigen.values.array().isNaN().all());
  EXPECT_TRUE(eigen.vectors.array().isNaN().all());
}

TEST(InvertPositiveDefinite, ReturnsInverseOrNulloptIfNotPositiveDefinite) {
  Eigen::Matrix4d positive;
  positive << 4, 1, 0, -1, 1, 3, 2, 0, 0, 2, 5, 1, -1, 0, 1, 2;
  const auto inverse = invert_positive_definite(positive);
  ASSERT_TRUE(inverse);
  EXPECT_THAT(Eigen::Matrix4d(*inverse * positive),
              IsNear(Eigen::Matrix4d(Eigen::Matrix4d::Identity()), 1e-14));

  Eigen::Matrix4d indefinite = positive;
  indefinite(2, 2) = -1;
  EXPECT_FALSE(invert_positive_definite(indefinite));
  EXPECT_FALSE(invert_positive_definite(Eigen::Matrix4d::Zero()));
  EXPECT_FALSE(invert_positive_definite(1e-310 * Eigen::Matrix4d::Identity()));  // 1 / it overflows
}

}  // namespace
}  // namespace vlp
