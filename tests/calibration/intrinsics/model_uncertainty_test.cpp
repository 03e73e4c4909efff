// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/model_uncertainty.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
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
IntrinsicsSolution solve_exact_views(LensModel model, double focal_px) {
  const SyntheticViews views{
      synthetic_board(false),
      Lens(LensModel::opencv4, std::array{focal_px, focal_px, 402., 297., -0.2, 0.05, 0., 0.})};
  Random random(61);
  IntrinsicsInput input = make_views_without_edge_shifts(views, 10, random, 0.001);
  input.lens_model = model;
  return solve_intrinsics(input);
}

/// Returns a comparison in which OPENCV5 fits as well, with a focal length larger by 2 px.
LensChoice make_comparison(const IntrinsicsSolution& solution) {
  return {LensModel::opencv4,
          {{LensModel::opencv4, 0.05, 0, 0.1, 0, solution},
           {LensModel::opencv5, 0.052, 0.04, 0.1, 0, solve_exact_views(LensModel::opencv5, 522)}}};
}

const ImageRegion kRegion{{100, 100}, {700, 100}, {700, 500}, {100, 500}};

TEST(ComputeModelUncertainty, ReturnsDifferenceToModelThatIsNotRejected) {
  const IntrinsicsSolution solution = solve_exact_views(LensModel::opencv4, 520);
  ASSERT_TRUE(solution.has_succeeded());
  const auto found = compute_model_uncertainty(solution, make_comparison(solution), kRegion, 0.001);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->model, LensModel::opencv5);
  ASSERT_EQ(found->intrinsics.size(), 8);
  EXPECT_NEAR(found->intrinsics[0], 2, 0.05);
  EXPECT_NEAR(found->intrinsics[1], 2, 0.05);
  EXPECT_LT(found->intrinsics.segment(2, 2).norm(), 0.1);
  EXPECT_LT(found->intrinsics.tail(4).norm(), 1e-3);
  // The pixel (100, 100) moves by 2 / f of its distance from the center; there is no rotation.
  const Lens lens = solution.fitted_lens();
  EXPECT_NEAR(found->worst_px,
              2. / 520 * (Eigen::Vector2d(100, 100) - Eigen::Vector2d(402, 297)).norm(), 0.1);
  EXPECT_GT(found->mean_px, 0.3 * found->worst_px);
  EXPECT_LT(found->mean_px, 0.7 * found->worst_px);
}

TEST(ComputeModelUncertainty, SubtractsSquareOfNoise) {
  const IntrinsicsSolution solution = solve_exact_views(LensModel::opencv4, 520);
  ASSERT_TRUE(solution.has_succeeded());
  const LensChoice comparison = make_comparison(solution);
  const auto all = compute_model_uncertainty(solution, comparison, kRegion, 1e-3);
  ASSERT_TRUE(all);
  const auto part = compute_model_uncertainty(solution, comparison, kRegion, 0.6 * all->worst_px);
  ASSERT_TRUE(part);
  EXPECT_NEAR(part->worst_px, 0.8 * all->worst_px, 1e-3);
  EXPECT_NEAR(part->mean_px, 0.8 * all->mean_px, 1e-3);
  EXPECT_NEAR(part->intrinsics[0], 0.8 * all->intrinsics[0], 1e-2);
  EXPECT_FALSE(compute_model_uncertainty(solution, comparison, kRegion, 1.01 * all->worst_px));
}

TEST(ComputeModelUncertainty, IgnoresRejectedModelsUnlessTheyFitBetterThanRejectedLens) {
  const IntrinsicsSolution solution = solve_exact_views(LensModel::opencv4, 520);
  ASSERT_TRUE(solution.has_succeeded());
  LensChoice comparison = make_comparison(solution);
  comparison.candidates[1].excess = 0.2;
  EXPECT_FALSE(compute_model_uncertainty(solution, comparison, kRegion, 0.001));
  comparison.candidates[1].max_excess_by_blocks = 0.21;
  EXPECT_TRUE(compute_model_uncertainty(solution, comparison, kRegion, 0.001));
  comparison.candidates[1].max_excess_by_blocks = 0;
  comparison.candidates[0].excess = 0.3;
  EXPECT_TRUE(compute_model_uncertainty(solution, comparison, kRegion, 0.001));
  comparison.candidates[0].excess = 0;
  comparison.candidates[1] = {LensModel::opencv5};
  EXPECT_FALSE(compute_model_uncertainty(solution, comparison, kRegion, 0.001));
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
    if (!lattice.are_corners_sufficient_for_pose(seen)) continue;
    input.views.push_back({std::to_string(input.views.size()), synthetic.imager_px, seen});
  }
  return input;
}

/// Lenses of three models, each calibrated with the other models and with the selected one.
TEST(EstimateLens, StatedErrorCoversErrorOfWrongModelWithWeakViews) {
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
        const auto difference = compute_projection_difference(
            lenses[truth], lens, kImager, [&](const Eigen::Vector2d& pixel) {
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
