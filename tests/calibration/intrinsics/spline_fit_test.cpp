// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/spline_fit.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "camera/spline_grid.h"

namespace vlp {
namespace {

using testing::EndsWith;

constexpr double kRadPerDeg = std::numbers::pi / 180;

Lens make_stereographic(double fx, double fy, double cx, double cy) {
  return {LensModel::stereographic, std::array{fx, fy, cx, cy}};
}

/// Returns half the field of view of a grid along x, in the stereographic plane.
double half_width(const SplineGrid& grid) { return 2 * std::tan(grid.fov_x_deg * kRadPerDeg / 4); }

/// A stereographic lens with other focal lengths and another center is a linear surface. Its second
/// differences are 0, so that control points without rays continue it exactly.
TEST(FitSplinedLensToLens, ReturnsExactControlPointsOfLinearSurface) {
  const std::vector<double> core{300, 320, 390, 310};
  const Lens lens = make_stereographic(330, 304, 399, 304);
  for (const SplineGrid& grid : {SplineGrid{3, 11, 8, 150}, {2, 9, 12, 120}, {3, 8, 9, 220}}) {
    const auto fitted =
        fit_splined_lens_to_lens(lens, {800, 600}, lens_model_for_spline_grid(grid), core);
    ASSERT_TRUE(fitted);
    ASSERT_EQ(fitted->size(), 4 + 2 * grid.num_control_points());
    for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ((*fitted)[k], core[k]);
    const double points_per_u = (grid.nx - grid.order) / (2 * half_width(grid));
    std::size_t at = 4;
    for (int row = 0; row < grid.ny; ++row) {
      for (int col = 0; col < grid.nx; ++col) {
        const double ux = (col - (grid.nx - 1) / 2.0) / points_per_u,
                     uy = (row - (grid.ny - 1) / 2.0) / points_per_u;
        EXPECT_NEAR((*fitted)[at++], (330. / 300 - 1) * ux + 9. / 300, 1e-6) << col << ' ' << row;
        EXPECT_NEAR((*fitted)[at++], (304. / 320 - 1) * uy - 6. / 320, 1e-6) << col << ' ' << row;
      }
    }
  }
}

TEST(FitSplinedLensToLens, MatchesRotatedFisheyeInImage) {
  const Lens fisheye(LensModel::fisheye,
                     std::array{290.0, 291.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006});
  const Eigen::Matrix3d fisheye_from_splined =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  constexpr LensModel model = lens_model_for_spline_grid({3, 16, 13, 180});
  const auto fitted = fit_splined_lens_to_lens(fisheye, {800, 600}, model, {290, 291, 402, 297},
                                               fisheye_from_splined);
  ASSERT_TRUE(fitted);
  const Lens splined(model, *fitted);
  int compared = 0;
  for (double u = 0; u < 800; u += 80) {
    for (double v = 0; v < 600; v += 60) {
      const auto ray = fisheye.unproject_pixel({u, v});
      ASSERT_TRUE(ray);
      const auto pixel = splined.project_point(fisheye_from_splined.transpose() * ray->direction);
      ASSERT_TRUE(pixel) << u << ' ' << v;
      EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 0.02) << u << ' ' << v;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 100);
}

/// Returns true if a grid of one piece can be fitted to a lens. Its 5 x 5 rays are at the pixels
/// `center_px` + k `step_px` with k from -2 to 2 on each axis.
bool can_fit_one_piece(const Eigen::Vector2d& center_px, const Eigen::Vector2d& step_px) {
  constexpr SplineGrid grid{3, 4, 4, 120};
  const Eigen::Vector2d focal_px = step_px / (half_width(grid) / 2);
  const Lens lens = make_stereographic(focal_px.x(), focal_px.y(), center_px.x(), center_px.y());
  return fit_splined_lens_to_lens(lens, {1000, 800}, lens_model_for_spline_grid(grid),
                                  {focal_px.x(), focal_px.y(), 500, 400})
      .has_value();
}

/// Two columns or rows of rays determine the surface, a single one does not. One of the two is 4 or
/// 6 % of the image size beyond the border.
TEST(FitSplinedLensToLens, UsesRaysUpTo5PercentBeyondImage) {
  EXPECT_TRUE(can_fit_one_piece({560, 400}, {600, 200}));   // columns at -40, 560, 1160
  EXPECT_FALSE(can_fit_one_piece({560, 400}, {620, 200}));  // columns at -60, 560
  EXPECT_TRUE(can_fit_one_piece({440, 400}, {600, 200}));   // columns at 440, 1040
  EXPECT_FALSE(can_fit_one_piece({440, 400}, {620, 200}));  // columns at 440, 1060
  EXPECT_TRUE(can_fit_one_piece({500, 448}, {200, 480}));   // rows at -32, 448, 928
  EXPECT_FALSE(can_fit_one_piece({500, 448}, {200, 496}));  // rows at -48, 448
  EXPECT_TRUE(can_fit_one_piece({500, 352}, {200, 480}));   // rows at 352, 832
  EXPECT_FALSE(can_fit_one_piece({500, 352}, {200, 496}));  // rows at 352, 848
}

TEST(FitSplinedLensToLens, ReturnsNulloptForFewerThanFourRays) {
  EXPECT_TRUE(can_fit_one_piece({560, 448}, {600, 480}));    // 2 x 2
  EXPECT_FALSE(can_fit_one_piece({560, 400}, {2000, 420}));  // 1 x 1
  EXPECT_FALSE(can_fit_one_piece({560, 400}, {2000, 2000}));
  EXPECT_FALSE(can_fit_one_piece({-5000, 400}, {1, 1}));  // none
}

TEST(ResizeSplineGridToReach, ReturnsSmallestGridThatCoversGivenExtent) {
  const SplineGrid grid{3, 11, 9, 100};
  const double edge = 2 * std::tan(30 * kRadPerDeg);  // 120 degrees
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {edge, edge / 2}), (SplineGrid{3, 11, 7, 120}));
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {edge * 0.999, edge * 0.51}),
            (SplineGrid{3, 11, 8, 120}));
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {edge * 1.001, edge * 2}),
            (SplineGrid{3, 11, 19, 121}));
  EXPECT_EQ(resize_spline_grid_to_reach({2, 12, 5, 60}, {edge, edge / 4}),
            (SplineGrid{2, 12, 5, 120}));
}

TEST(ResizeSplineGridToReach, KeepsBoundsOfGrids) {
  const SplineGrid grid{3, 11, 9, 100};
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {0, 0}), (SplineGrid{3, 11, 4, 1}));
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {1e12, 0}), (SplineGrid{3, 11, 4, 359}));
  EXPECT_EQ(resize_spline_grid_to_reach(grid, {1, 1e12}).ny, 255);
  EXPECT_EQ(resize_spline_grid_to_reach({2, 11, 9, 100}, {1, 0}).ny, 3);
}

TEST(FitCoreIntrinsicsOfSplinedLens, ReturnsParametersOfStereographicLens) {
  const std::vector<Eigen::Vector2d> pixels{{100, 50}, {700, 20}, {420, 590}, {300, 310}};
  const std::vector<double> core =
      fit_core_intrinsics_of_splined_lens(make_stereographic(310, 330, 402, 297), pixels);
  ASSERT_EQ(core.size(), 4U);
  EXPECT_NEAR(core[0], 310, 1e-9);
  EXPECT_NEAR(core[1], 330, 1e-9);
  EXPECT_EQ(core[2], 402);
  EXPECT_EQ(core[3], 297);
}

/// The focal length minimizes the squares of f u - (pixel - center) over the pixels with a ray.
TEST(FitCoreIntrinsicsOfSplinedLens, MinimizesSquaresOverPixelsWithRay) {
  const Lens fisheye(LensModel::fisheye,
                     std::array{290.0, 280.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006});
  const Eigen::Vector2d without_ray(1e4, 1e4);
  ASSERT_FALSE(fisheye.unproject_pixel(without_ray));
  const std::vector<Eigen::Vector2d> pixels{
      {10, 40}, {760, 20}, without_ray, {420, 590}, {300, 310}};
  const std::vector<double> core = fit_core_intrinsics_of_splined_lens(fisheye, pixels);
  ASSERT_EQ(core.size(), 4U);
  for (int axis = 0; axis < 2; ++axis) {
    const auto squares = [&](double focal_px) {
      double sum = 0;
      for (const Eigen::Vector2d& pixel : pixels) {
        const auto ray = fisheye.unproject_pixel(pixel);
        if (!ray) continue;
        const Eigen::Vector3d x = ray->direction.normalized();
        const double tangent = std::tan(std::acos(x.z()) / 2);
        const double u = 2 * tangent * x[axis] / x.head<2>().norm();
        sum += std::pow(focal_px * u - (pixel - fisheye.principal_point_px())[axis], 2);
      }
      return sum;
    };
    const double focal_px = core[static_cast<std::size_t>(axis)];
    EXPECT_GT(focal_px, 200);
    EXPECT_LT(focal_px, 300);
    EXPECT_NEAR(squares(focal_px + 0.1), squares(focal_px - 0.1), 1e-6);
  }
}

/// Image corners are 400 / 300 and 300 / 300 from the center in the stereographic plane.
TEST(DescribeTooCoarseSplineGrid, NamesGridThatCoversImageAndAnglesOffAxis) {
  const Lens lens = make_stereographic(300, 300, 400, 300);
  EXPECT_EQ(describe_too_coarse_spline_grid(
                lens, {801, 601}, lens_model_for_spline_grid({3, 4, 4, 300}), {300, 300, 400, 300}),
            "the control points of LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=4_Ny=4_fov_x_deg=300 "
            "do not cover the field of view, 67 degrees off axis horizontally and 53 vertically: "
            "use --lens LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=4_Ny=4_fov_x_deg=140");
}

/// The field of view is 0.23 degrees, but that of a grid is at least one degree: four columns of
/// control points leave a single column of rays in the image.
TEST(DescribeTooCoarseSplineGrid, DoublesColumnsUntilFitSucceeds) {
  constexpr LensModel coarse = lens_model_for_spline_grid({3, 4, 4, 300});
  const std::vector<double> core{2e5, 2e5, 400, 300};
  const Lens lens = make_stereographic(2e5, 2e5, 400, 300);
  ASSERT_FALSE(
      fit_splined_lens_to_lens(lens, {801, 601}, lens_model_for_spline_grid({3, 4, 4, 1}), core));
  EXPECT_THAT(describe_too_coarse_spline_grid(lens, {801, 601}, coarse, core),
              EndsWith("use --lens LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=8_Ny=4_fov_x_deg=1"));
}

TEST(DescribeTooCoarseSplineGrid, RecommendsAnotherModelIfNoGridIsFineEnough) {
  const std::vector<double> core{1e8, 1e8, 400, 300};
  EXPECT_THAT(describe_too_coarse_spline_grid(make_stereographic(1e8, 1e8, 400, 300), {801, 601},
                                              lens_model_for_spline_grid({3, 4, 4, 300}), core),
              EndsWith("0 degrees off axis horizontally and 0 vertically: use another model"));
}

}  // namespace
}  // namespace vlp
