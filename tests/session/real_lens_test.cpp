// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Lenses of real cameras from weak views and from a fisheye, when the real captures are there.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>
#include <vector>

#include "calibration/intrinsics/projection_difference.h"
#include "frontend/board_intake.h"
#include "geometry/polygon.h"
#include "session/lens_step.h"
#include "support/real_data.h"

namespace vlp {
namespace {

constexpr std::array kModels{LensModel::opencv4, LensModel::opencv5, LensModel::opencv8,
                             LensModel::opencv12, LensModel::fisheye};

LensInput make_input(Observations observations, const std::filesystem::path& board) {
  LensInput input{std::move(observations), read_board(board), board, {}, 0, WarpChoice::automatic};
  input.camera.lens_model = LensModel::fisheye;
  return input;
}

/// Returns the largest difference of two lenses where both are known, px.
double compute_worst_difference_px(const LensEstimate& a, const LensEstimate& b) {
  const auto difference =
      compare_projections(a.solution.fitted_lens(), b.solution.fitted_lens(),
                          a.solution.problem.imager_px, [&](const Eigen::Vector2d& pixel) {
                            const bool is_known = polygon_contains(a.report.region, pixel) &&
                                                  polygon_contains(b.report.region, pixel);
                            return is_known ? 1.0 : INFINITY;
                          });
  return difference ? difference->worst_px : INFINITY;
}

/// All views have nearly the same tilt. OPENCV8, OPENCV12 and OPENCV_FISHEYE fit alike and differ
/// by up to 10 px; the focal length of a long recording is 464 to 466 px and 461 to 463 px.
TEST(RealWeakViews, StatedErrorCoversDifferenceOfEachPairOfModels) {
  const std::filesystem::path folder = real_data("aprilgrid-euroc");
  if (folder.empty()) GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
  for (const auto& [name, focal_px] : {std::pair{"cam0.csv", 465.0}, {"cam1.csv", 462.0}}) {
    const std::filesystem::path board = folder / "board.yaml";
    LensInput input = make_input(
        read_board_views(folder / name, read_board(board), board, {752, 480}, {}), board);
    std::vector<LensEstimate> lenses;
    for (const LensModel model : kModels) {
      input.camera.lens_model = model;
      lenses.push_back(run_lens_step(input, {}).lens);
    }
    input.choose_lens_model = true;
    lenses.push_back(run_lens_step(input, {}).lens);
    for (const LensEstimate& lens : lenses) {
      ASSERT_TRUE(lens.has_succeeded() && lens.model_uncertainty && lens.intrinsics_covariance);
      const double focal_sd_px = std::sqrt((*lens.intrinsics_covariance)(0, 0));
      EXPECT_LT(std::abs(lens.solution.problem.intrinsics[0] - focal_px), 1.5 * focal_sd_px);
    }
    int pairs = 0;
    double max_ratio = 0;
    for (std::size_t a = 0; a < lenses.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        const double worst_px = compute_worst_difference_px(lenses[a], lenses[b]);
        const auto [less_px, more_px] = std::minmax(lenses[a].report.uncertainty_worst_px,
                                                    lenses[b].report.uncertainty_worst_px);
        EXPECT_LE(worst_px, 1.05 * more_px) << a << b;
        max_ratio = std::max(max_ratio, worst_px / more_px);
        if (b < 2) continue;  // held-out views reject OPENCV4 and OPENCV5
        EXPECT_LE(worst_px, 1.1 * less_px) << a << b;
        ++pairs;
      }
    }
    EXPECT_EQ(pairs, 6);
    std::printf("%s: difference of a pair at most %.2f of the stated error\n", name, max_ratio);
    EXPECT_GT(max_ratio, 0.5);
  }
}

/// The model folds 290 to 310 px from its center, within the image.
TEST(RealFisheye, EveryPixelOfValidRegionHasRay) {
  const std::filesystem::path folder = real_data("chessboard-fisheye");
  if (folder.empty()) GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
  const std::filesystem::path board = folder / "board.yaml";
  std::vector<std::filesystem::path> images;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".jpg") images.push_back(entry.path());
  }
  std::ranges::sort(images);
  ASSERT_EQ(images.size(), 26U);
  const LensEstimate lens =
      run_lens_step(make_input(detect_boards(images, read_board(board), board, {}), board), {})
          .lens;
  ASSERT_TRUE(lens.has_succeeded()) << lens.problem;
  EXPECT_GE(lens.solution.views.size(), 21U);
  const Lens fitted = lens.solution.fitted_lens();
  const ImageRegion& region = lens.report.region;
  std::vector<Eigen::Vector2d> pixels = make_pixel_grid(lens.solution.problem.imager_px, 161);
  std::erase_if(pixels, [&](const auto& pixel) { return !polygon_contains(region, pixel); });
  ASSERT_GT(pixels.size(), 10000U);
  for (std::size_t i = 0; i < region.size(); ++i) {
    for (const double along : {0.0, 0.25, 0.5, 0.75})
      pixels.emplace_back(region[i] + along * (region[(i + 1) % region.size()] - region[i]));
  }
  int missing = 0;
  for (const Eigen::Vector2d& pixel : pixels) missing += fitted.unproject_pixel(pixel) ? 0 : 1;
  EXPECT_EQ(missing, 0);
  EXPECT_GT(lens.report.region_fraction, 0.55);
}

}  // namespace
}  // namespace vlp
