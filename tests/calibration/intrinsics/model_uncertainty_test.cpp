// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/model_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/lens_estimate.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "geometry/polygon.h"

namespace vlp {
namespace {

constexpr std::array kImager{800, 600};

/// Returns a solution of nearly exact views through a lens without tangential distortion.
IntrinsicsSolution solve_exact_views(LensModel model, double focal_px, double k1 = -0.2) {
  const SyntheticViews views{
      synthetic_board(false),
      Lens(LensModel::opencv4, std::array{focal_px, focal_px, 402., 297., k1, 0.05, 0., 0.})};
  Random random(61);
  IntrinsicsInput input = make_views_without_edge_shifts(views, 10, random, 0.001);
  input.lens_model = model;
  return solve_intrinsics(input);
}

const ImageRegion kRegion{{100, 100}, {700, 100}, {700, 500}, {100, 500}};

/// Compares OPENCV4, 520 px, with fits of OPENCV5.
class CombineModelFits : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(solution.has_succeeded());
    ASSERT_TRUE(longer.has_succeeded());
  }

  const IntrinsicsSolution solution = solve_exact_views(LensModel::opencv4, 520);
  const IntrinsicsSolution longer = solve_exact_views(LensModel::opencv5, 522);

  std::optional<ModelUncertainty> compute(const std::vector<IntrinsicsSolution>& others,
                                          double noise_px = 0.001) const {
    return combine_model_fits(solution, others, kRegion, noise_px);
  }
};

TEST_F(CombineModelFits, CovarianceIsThatOfDifferenceToOtherModel) {
  const auto found = compute({longer});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->model, LensModel::opencv5);
  ASSERT_EQ(found->intrinsics_covariance.rows(), 8);
  ASSERT_EQ(found->intrinsics_covariance.cols(), 8);
  const Eigen::VectorXd sds = found->intrinsics_covariance.diagonal().cwiseSqrt();
  EXPECT_NEAR(sds[0], 2, 0.05);
  EXPECT_NEAR(sds[1], 2, 0.05);
  EXPECT_NEAR(found->intrinsics_covariance(0, 1), sds[0] * sds[1], 1e-6);
  EXPECT_LT(sds.segment(2, 2).norm(), 0.1);
  EXPECT_LT(sds.tail(4).norm(), 1e-3);
  // The pixel (100, 100) moves by 2 / f of its distance from the center; there is no rotation.
  EXPECT_NEAR(found->worst_px,
              2. / 520 * (Eigen::Vector2d(100, 100) - Eigen::Vector2d(402, 297)).norm(), 0.1);
  EXPECT_GT(found->mean_px, 0.3 * found->worst_px);
  EXPECT_LT(found->mean_px, 0.7 * found->worst_px);
}

/// The covariances of differences in other directions add up if noise explains none of them.
TEST_F(CombineModelFits, CovariancesOfDifferencesInDifferentDirectionsAdd) {
  const IntrinsicsSolution bent = solve_exact_views(LensModel::opencv5, 520, -0.22);
  const auto first = compute({longer}), second = compute({bent}), both = compute({bent, longer});
  ASSERT_TRUE(first && second && both);
  const auto largest_eigenvalues = [](const ModelUncertainty& model) {
    const Eigen::VectorXd scale{{1, 1, 1, 1, 1e-2, 1e-2, 1e-2, 1e-2}};
    const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * model.intrinsics_covariance *
                                   scale.cwiseInverse().asDiagonal();
    return Eigen::VectorXd(
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues().tail<2>());
  };
  EXPECT_LT(largest_eigenvalues(*first)[0], 1e-6);
  EXPECT_GT(largest_eigenvalues(*both)[0], 0.1);
  const Eigen::MatrixXd sum = first->intrinsics_covariance + second->intrinsics_covariance;
  EXPECT_LT((both->intrinsics_covariance - sum).norm(), 0.01 * sum.norm());
  EXPECT_GT(both->worst_px, std::max(first->worst_px, second->worst_px));
  EXPECT_LE(both->worst_px, std::hypot(first->worst_px, second->worst_px) + 1e-9);
}

/// Returns views of nearly the same tilt around the middle of the image.
LensViews make_weak_views(const Lens& lens, std::uint64_t seed) {
  constexpr int count = 15;
  constexpr double noise_px = 0.05;
  const SyntheticViews synthetic{synthetic_board(true), lens};
  Random random(seed);
  LensViews input{{}, synthetic.board};
  const double fill_m =
      lens.focal_px().x() * compute_tag_field_size_m(synthetic.board).x() / kImager[0];
  const BoardLattice lattice(synthetic.board);
  while (std::ssize(input.views) < count) {
    const double tilt_rad = random.uniform(0.1, 0.3), roll_rad = random.uniform(-0.3, 0.3),
                 z_m = fill_m * random.uniform(1.2, 1.6);
    const double v = random.uniform(-0.15, 0.15), u = random.uniform(-0.15, 0.15);
    const Eigen::Matrix3d rotation =
        Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d(1, 0.3, 0).normalized()) *
        Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const Eigen::Vector3d middle(u * kImager[0], v * kImager[1], lens.focal_px().x());
    const BoardDetection seen =
        synthetic.view(rotation, middle * (z_m / middle.z()), random, noise_px);
    if (!lattice.can_determine_pose(seen)) continue;
    input.views.push_back({std::to_string(input.views.size()), synthetic.imager_px, seen});
  }
  return input;
}

/// Lenses of three models, each calibrated with the other models and with the selected one.
TEST(EstimateLens, ReportedUncertaintyCoversErrorOfWrongModelForFewViews) {
  const std::array lenses{
      Lens(LensModel::opencv4, std::array{420., 421., 402., 297., -0.28, 0.07, 2e-4, 1e-4}),
      Lens(LensModel::fisheye, std::array{420., 421., 402., 297., 0.03, -0.012, 0.004, -0.0006}),
      Lens(LensModel::opencv8,
           std::array{420., 421., 402., 297., 0.9, 0.25, 2e-4, -1e-4, 0.01, 1.25, 0.5, 0.06})};
  int count = 0;
  double squares = 0, max_ratio = 0, max_focal = 0;
  for (std::size_t truth = 0; truth < lenses.size(); ++truth) {
    for (const LensModel model : {LensModel::fisheye, LensModel::opencv8}) {
      for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
        LensViews input = make_weak_views(lenses[truth], seed);
        input.lens_model = model;
        input.choose_lens_model = seed == 4;
        const LensEstimate result = estimate_lens(input);
        ASSERT_TRUE(result.has_succeeded()) << result.problem;
        EXPECT_TRUE(result.are_models_compared);
        const Lens lens = result.solution.fitted_lens();
        const auto difference =
            compare_projections(lenses[truth], lens, kImager, [&](const Eigen::Vector2d& pixel) {
              return polygon_contains(result.report.region, pixel) ? 1.0 : INFINITY;
            });
        ASSERT_TRUE(difference && result.intrinsics_covariance);
        const double ratio = difference->worst_px / result.report.uncertainty_worst_px;
        squares += ratio * ratio;
        ++count;
        max_ratio = std::max(max_ratio, ratio);
        max_focal =
            std::max(max_focal, std::abs(lens.focal_px().x() - lenses[truth].focal_px().x()) /
                                    std::sqrt((*result.intrinsics_covariance)(0, 0)));
      }
    }
  }
  ASSERT_EQ(count, 24);
  const double rms = std::sqrt(squares / count);
  std::printf("error over stated: rms %.2f, largest %.2f; focal length largest %.2f sd\n", rms,
              max_ratio, max_focal);
  EXPECT_GT(rms, 0.4);
  EXPECT_LT(rms, 1.3);
  EXPECT_LT(max_ratio, 2.5);
  EXPECT_LT(max_focal, 3.5);
}

}  // namespace
}  // namespace vlp
