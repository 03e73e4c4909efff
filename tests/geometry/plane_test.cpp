// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "geometry/plane.h"

#include <gtest/gtest.h>

#include <complex>

#include "support/matchers.h"
#include "support/random.h"

namespace vlp {
namespace {

using Complex = std::complex<double>;

Complex to_complex(const Eigen::Vector2d& a) { return {a.x(), a.y()}; }
Eigen::Vector2d to_vector(const Complex& a) { return {a.real(), a.imag()}; }

struct Pair {
  Eigen::Vector2d a, b;
};

Pair random_pair(Random& random) {
  const auto coordinate = [&random] { return random.uniform(-3, 3); };
  const double ax = coordinate(), ay = coordinate(), bx = coordinate(), by = coordinate();
  return {{ax, ay}, {bx, by}};
}

// Products of numbers up to 3 differ by the rounding of 18 at most.
constexpr double kRounding = 4e-15;

TEST(ComplexProduct, MatchesStdComplex) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const auto [a, b] = random_pair(random);
    const Complex expected = to_complex(a) * to_complex(b);
    EXPECT_THAT(complex_product(a, b), IsNear(to_vector(expected), kRounding));
  }
}

TEST(ConjugateProduct, ConjugatesFirstFactor) {
  Random random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const auto [a, b] = random_pair(random);
    const Complex expected = std::conj(to_complex(a)) * to_complex(b);
    EXPECT_THAT(conjugate_product(a, b), IsNear(to_vector(expected), kRounding));
  }
}

TEST(ConjugateProduct, ReturnsDotAndCrossProduct) {
  EXPECT_EQ(conjugate_product({1, 2}, {3, 5}), Eigen::Vector2d(1 * 3 + 2 * 5, 1 * 5 - 2 * 3));
}

TEST(ComplexProductMatrix, MatchesComplexProduct) {
  Random random(3);
  for (int trial = 0; trial < 100; ++trial) {
    const auto [a, b] = random_pair(random);
    EXPECT_THAT(complex_product_matrix(a) * b, IsNear(complex_product(a, b), kRounding));
  }
}

}  // namespace
}  // namespace vlp
