// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/spline_fit.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>
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
TEST(FitSplinedLens, ReturnsExactControlPointsOfLinearSurface) {
  const std::vector<double> core{300, 320, 390, 310};
  const Lens lens = make_stereographic(330, 304, 399, 304);
  for (const SplineGrid& grid : {SplineGrid{3, 11, 8, 150}, {2, 9, 12, 120}, {3, 8, 9, 220}}) {
    const auto fitted = fit_splined_lens(lens, {800, 600}, splined_lens_model(grid), core);
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

TEST(FitSplinedLens, ProjectsLikeRotatedFisheye) {
  const Lens fisheye(LensModel::fisheye,
                     std::array{290.0, 291.0, 402.0, 297.0, 0.03, -0.012, 0.004, -0.0006});
  const Eigen::Matrix3d fisheye_from_splined =
      Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  constexpr LensModel model = splined_lens_model({3, 16, 13, 180});
  const auto fitted =
      fit_splined_lens(fisheye, {800, 600}, model, {290, 291, 402, 297}, fisheye_from_splined);
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

TEST(ResizeSplineGrid, ReturnsSmallestGridThatCoversGivenExtent) {
  const SplineGrid grid{3, 11, 9, 100};
  const double edge = 2 * std::tan(30 * kRadPerDeg);  // 120 degrees
  EXPECT_EQ(resize_spline_grid(grid, {edge, edge / 2}), (SplineGrid{3, 11, 7, 120}));
  EXPECT_EQ(resize_spline_grid(grid, {edge * 0.999, edge * 0.51}), (SplineGrid{3, 11, 8, 120}));
  EXPECT_EQ(resize_spline_grid(grid, {edge * 1.001, edge * 2}), (SplineGrid{3, 11, 19, 121}));
  EXPECT_EQ(resize_spline_grid({2, 12, 5, 60}, {edge, edge / 4}), (SplineGrid{2, 12, 5, 120}));
}

/// Image corners are 400 / 300 and 300 / 300 from the center in the stereographic plane.
TEST(ExplainCoarseGrid, ReportsOffAxisAnglesAndSufficientGrid) {
  const Lens lens = make_stereographic(300, 300, 400, 300);
  EXPECT_EQ(explain_coarse_grid(lens, {801, 601}, splined_lens_model({3, 4, 4, 300}),
                                {300, 300, 400, 300}),
            "the control points of LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=4_Ny=4_fov_x_deg=300 "
            "do not cover the field of view, 67 degrees off axis horizontally and 53 vertically: "
            "use --lens LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=4_Ny=4_fov_x_deg=140");
}

}  // namespace
}  // namespace vlp
