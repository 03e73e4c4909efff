// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "plain_scene.h"
#include "simulation/board_print.h"
#include "support/random.h"

namespace vlp {
namespace {

/// Pattern whose areas of constant value are integrated like all others.
struct IntegratedEverywhere {
  const BoardPattern& pattern;

  Eigen::Vector2d intersect_ray_with_shape(const Eigen::Vector3d& origin,
                                           const Eigen::Vector3d& direction) const {
    return pattern.intersect_ray_with_shape(origin, direction);
  }
  double compute_edge_contribution_to_area_integral(const Eigen::Vector2d& p,
                                                    const Eigen::Vector2d& q) const {
    return pattern.compute_edge_contribution_to_area_integral(p, q);
  }
  static std::optional<double> find_constant_value_in_quadrilateral(
      const std::array<Eigen::Vector2d, 4>&) {
    return std::nullopt;
  }
};

/// Returns a fisheye camera of 250 x 240 pixels with a field of view above 180 degrees.
Camera make_small_fisheye() {
  Camera camera = pinhole_camera();
  camera.lens_model = LensModel::fisheye;
  camera.intrinsics = {70, 71, 125, 118, 0.03, -0.012, 0.004, -0.0006};
  camera.imager_px = {250, 240};
  return camera;
}

/// The board covers a part of the image, and the camera moves in two of three cases. Some rays of
/// the fisheye do not meet the board's plane.
TEST(AddShapeToImage, ConstantBlocksAndOutlinesEqualIntegrationOfEachElement) {
  SceneBoard board = plain_board();
  board.warp_m = {0.0005, -0.0004};
  board.surround_e_per_s = 4e5;
  const BoardPattern pattern(board);
  const PixelRays rays(make_small_fisheye(), 2);
  const PixelWindow window = make_full_image_window(rays);
  Random random(8);
  for (int i = 0; i < 6; ++i) {
    Eigen::Isometry3d board_from_camera =
        Eigen::Translation3d(random.uniform(0, 0.2), random.uniform(0, 0.2), -0.08) *
        Eigen::AngleAxisd(random.uniform(-3, 3), Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(random.uniform(-0.8, 0.8), Eigen::Vector3d::UnitX());
    const double step_m = std::array{0.0, 3e-4, -3e-4}[static_cast<std::size_t>(i % 3)];
    const auto pose = [&](int line) -> Eigen::Isometry3d {
      return Eigen::Translation3d(line * step_m, 0, 0) * board_from_camera;
    };
    for (const int per_px : {1, 2}) {
      cv::Mat1f image(per_px * (rays.num_readout_lines() + 4),
                      per_px * (rays.pixels_per_line() + 4), 0.F);
      cv::Mat1f expected = image.clone();
      add_shape_to_image(rays, window, pose, pattern, 0.5, image, per_px);
      constexpr int lines = 7;  // lower than a block
      for (int line = window.line_begin; line < window.line_end; line += lines) {
        const PixelWindow strip{line, std::min(line + lines, window.line_end), window.place_begin,
                                window.place_end};
        cv::Mat1f part = expected.rowRange(per_px * (strip.line_begin - window.line_begin),
                                           per_px * (strip.line_end - window.line_begin));
        add_shape_to_image(rays, strip, pose, IntegratedEverywhere{pattern}, 0.5, part, per_px);
      }
      EXPECT_GT(cv::countNonZero(image > 0), 1000);  // paper
      EXPECT_GT(cv::countNonZero(image < 0), 200);   // ink
      EXPECT_LT(cv::norm(image, expected, cv::NORM_INF), 5) << "of 3e5, the paper's value";
    }
  }
}

TEST(FindConstantValueInBlock, ReturnsNulloptIfEnlargedBoxContainsEdge) {
  const RectanglePattern pattern({{0, 0, 1, 1, 7}});
  const auto find = [&](const Eigen::Vector2d& corner_m, double size_m, double bulge_m,
                        bool is_along_column = false) {
    std::array<std::array<Eigen::Vector2d, 3>, 3> points;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        points[i][j] = corner_m + size_m / 2 * Eigen::Vector2d(double(j), double(i));
        if ((is_along_column ? i : j) == 1) points[i][j].y() -= bulge_m;
      }
    }
    return find_constant_value_in_block(pattern,
                                        {points[0].data(), points[1].data(), points[2].data()});
  };
  EXPECT_EQ(find({0.1, 0.1}, 0.8, 0), 7);
  EXPECT_EQ(find({2, -3}, 0.8, 0), 0);
  EXPECT_EQ(find({0.6, 0.1}, 0.8, 0), std::nullopt) << "beyond the right edge";
  EXPECT_EQ(find({-0.5, -0.5}, 2, 0), std::nullopt) << "around the rectangle";
  EXPECT_EQ(find({0.1, 0.1}, 0.8, 0.01), 7);
  EXPECT_EQ(find({0.1, 0.1}, 0.8, 0.04), std::nullopt)
      << "within the points, but not surely inside";
  EXPECT_EQ(find({0.1, 0.1}, 0.8, 0.5, true), std::nullopt) << "the rows lie unevenly";
}

TEST(FindConstantValueInBlock, ReturnsZeroOnlyIfNoRayMeetsPlane) {
  const RectanglePattern pattern({{0, 0, 1, 1, 7}});
  const Eigen::Vector2d missed = Eigen::Vector2d::Constant(NAN);
  std::array<Eigen::Vector2d, 3> row{missed, missed, missed}, half_row = row;
  EXPECT_EQ(find_constant_value_in_block(pattern, {row.data(), row.data(), row.data()}), 0);
  half_row[2] = {0.5, 0.5};
  EXPECT_EQ(find_constant_value_in_block(pattern, {row.data(), half_row.data(), row.data()}),
            std::nullopt);
}

}  // namespace
}  // namespace vlp
