// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Rendered corners of boards, measured along their edges, against mrcal's projection.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <numbers>

#include "geometry/angles.h"
#include "rig/board_layout.h"
#include "simulation/plain_scene.h"
#include "simulation/truth.h"
#include "support/mrcal_oracle.h"

namespace vlp {
namespace {

/// Nearly straight edge at a corner: one coordinate as a quadratic polynomial of the other.
struct EdgeCurve {
  Eigen::Vector3d coefficients;
  double origin;

  double at(double position) const {
    const double d = position - origin;
    return coefficients.dot(Eigen::Vector3d(1, d, d * d));
  }
};

/// Measures the black border's edge from `corner` to `next`, which runs more along x than along y.
/// Counts the white pixels between two rows in each column, which is exact for a straight edge.
/// `image` is 0 for black and 1 for white.
EdgeCurve fit_edge(const cv::Mat1d& image, const Eigen::Vector2d& corner,
                   const Eigen::Vector2d& next) {
  constexpr int reach_px = 2, skipped_px = 2;  // the black border is 3.5 px wide or more
  const Eigen::Vector2d displacement = next - corner;
  std::vector<Eigen::Vector2d> points;
  const int first = int(std::ceil(std::min(corner.x(), next.x()))) + skipped_px;
  const int last = int(std::floor(std::max(corner.x(), next.x()))) - skipped_px;
  for (int column = first; column <= last; ++column) {
    const int row =
        int(std::lround(corner.y() + displacement.y() * (column - corner.x()) / displacement.x()));
    double white = 0;
    for (int y = row - reach_px; y <= row + reach_px; ++y) white += image(y, column);
    const bool white_above = image(row - reach_px, column) > image(row + reach_px, column);
    const double edge = white_above ? row - reach_px - 0.5 + white : row + reach_px + 0.5 - white;
    points.emplace_back(column, edge);
  }
  Eigen::MatrixX3d terms(points.size(), 3);
  Eigen::VectorXd values(points.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Eigen::Vector2d& point = points[std::size_t(i)];
    const double d = point.x() - corner.x();
    terms.row(i) << 1, d, d * d;
    values[i] = point.y();
  }
  return {terms.colPivHouseholderQr().solve(values), corner.x()};
}

/// Returns the intersection of the two edges of a corner; `a` is its neighbor along x, `b` along y.
Eigen::Vector2d measured_corner(const cv::Mat1d& image, const cv::Mat1d& transposed,
                                const Eigen::Vector2d& corner, const Eigen::Vector2d& a,
                                const Eigen::Vector2d& b) {
  const EdgeCurve along_x = fit_edge(image, corner, a);
  const EdgeCurve along_y = fit_edge(transposed, corner.reverse(), b.reverse());
  Eigen::Vector2d meeting = corner;
  for (int i = 0; i < 20; ++i) {
    meeting.y() = along_x.at(meeting.x());
    meeting.x() = along_y.at(meeting.y());
  }
  return meeting;
}

struct View {
  Camera camera;
  Eigen::Vector2d warp_m;
  bool kalibr_border;
  const char* name;

  friend void PrintTo(const View& view, std::ostream* out) { *out << view.name; }
};

class FrameRendererBoard : public testing::TestWithParam<View> {
 protected:
  FrameRendererBoard() {
    scene_.camera = GetParam().camera;
    scene_.board = plain_board();
    scene_.board->warp_m = GetParam().warp_m;
    if (GetParam().kalibr_border) scene_.board->pattern.border_bits = 2;
  }
  Scene scene_ = plain_scene();
  // Small rotation, so that the edges of the tags keep their directions.
  CaptureSet views_ = board_views(6, 0.17, rad_from_deg(18), rad_from_deg(12), 0.4);
};

TEST_P(FrameRendererBoard, RenderedCornersMatchTrueCorners) {
  const FrameRenderer renderer(scene_);
  double worst_px = 0, squares = 0;
  int corners = 0;
  for (std::size_t index = 0; index < 6; ++index) {
    const BoardShot shot = make_board_shot(scene_, views_, index);
    const cv::Mat1d image(renderer.render_board(shot) / 1e3);
    const cv::Mat1d transposed(image.t());
    std::map<int, std::map<int, Eigen::Vector2d>> tags;
    for (const auto& [tag, corner, pixel] : list_true_corners(scene_, renderer, shot)) {
      constexpr double edge_px = 8;
      if (pixel.minCoeff() > edge_px && pixel.x() < 799 - edge_px && pixel.y() < 599 - edge_px) {
        tags[tag.value()][corner] = pixel;
      }
    }
    for (const auto& [tag, at] : tags) {
      if (at.size() < 4) continue;
      for (int corner = 0; corner < 4; ++corner) {
        // Bottom left, bottom right, top right, top left: neighbors along x are 0 1 and 2 3.
        const Eigen::Vector2d found =
            measured_corner(image, transposed, at.at(corner), at.at(corner ^ 1), at.at(3 - corner));
        const double error_px = (found - at.at(corner)).norm();
        worst_px = std::max(worst_px, error_px);
        squares += error_px * error_px;
        ++corners;
      }
    }
  }
  EXPECT_GT(corners, 200);
  EXPECT_LT(worst_px, 0.01);
  EXPECT_LT(std::sqrt(squares / corners), 0.003);
}

TEST_P(FrameRendererBoard, TrueCornersMatchMrcalProjection) {
  const FrameRenderer renderer(scene_);
  const MrcalOracle mrcal(std::string(lens_model_name(scene_.camera.lens_model)),
                          scene_.camera.intrinsics);
  const BoardShot shot = make_board_shot(scene_, views_, 1);
  const auto layout = list_board_tags(scene_.board->pattern);
  const Eigen::Vector2d field_m = compute_tag_field_size_m(scene_.board->pattern);
  const auto truth = list_true_corners(scene_, renderer, shot);
  ASSERT_FALSE(truth.empty());
  for (const auto& [tag, corner, pixel] : truth) {
    ASSERT_TRUE(tag);
    const Eigen::Vector2d at_m = layout.at(std::size_t(*tag)).corners_m.at(std::size_t(corner));
    const Eigen::Vector2d fraction = 2 * at_m.cwiseQuotient(field_m) - Eigen::Vector2d(1, 1);
    const double depth_m = scene_.board->warp_m.dot(
        Eigen::Vector2d(1 - fraction.x() * fraction.x(), 1 - fraction.y() * fraction.y()));
    const Eigen::Vector3d point =
        shot.camera_from_board(0) * Eigen::Vector3d(at_m.x(), at_m.y(), depth_m);
    EXPECT_LT((mrcal.project(std::vector{point})[0] - pixel).norm(), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Views, FrameRendererBoard,
    testing::Values(View{paper_rig_camera(), {0, 0}, false, "Flat"},
                    View{paper_rig_camera(), {0.002, -0.001}, false, "Bent"},
                    View{wide_camera(), {0.001, 0.001}, true, "WideAndBorderOfTwoBits"},
                    View{stereographic_camera(), {0, 0}, false, "Stereographic"}),
    [](const auto& instance) { return std::string(instance.param.name); });

/// Returns the value of a pixel near a straight edge blurred by a Gaussian: the integral of its
/// distribution function over the pixel.
double white_share(double from_edge_px, double sigma_px) {
  const auto integral = [&](double x) {
    const double t = x / sigma_px;
    return x * std::erfc(-t * M_SQRT1_2) / 2 +
           sigma_px * std::exp(-t * t / 2) / std::sqrt(2 * std::numbers::pi);
  };
  return integral(from_edge_px + 0.5) - integral(from_edge_px - 0.5);
}

TEST(FrameRenderer, BlursBoardEdgeBeforePixelIntegration) {
  constexpr double sigma_px = 0.6;
  Scene scene = plain_scene();
  scene.camera = pinhole_camera();
  scene.optics.blur_px = sigma_px;
  scene.board = plain_board();
  const FrameRenderer renderer(scene);
  const BoardShot shot = make_board_shot(scene, board_views(1, 0.171, 0, 0, 0), 0);
  const cv::Mat1f image(renderer.render_board(shot) / 1e3);
  double worst = 0;
  int edges = 0;
  // Left of a tag there is white, and its black border is seven pixels wide.
  for (const auto& [tag, corner, pixel] : list_true_corners(scene, renderer, shot)) {
    constexpr int reach_px = 4, down_px = 20;
    if (corner != 3 || pixel.x() < reach_px || pixel.y() + down_px > 599) continue;
    const int row = static_cast<int>(pixel.y()) + down_px;
    const int column = static_cast<int>(std::lround(pixel.x()));
    for (int u = column - reach_px; u < column + reach_px; ++u) {
      worst = std::max(worst, std::abs(image(row, u) - white_share(pixel.x() - u, sigma_px)));
    }
    ++edges;
  }
  EXPECT_GT(edges, 15);
  EXPECT_LT(worst, 0.012);  // of pixels that are blurred it would be 0.06
}

/// Returns the level of a white wall at a pixel, for a fisheye lens with rays up to 104 degrees off
/// its axis.
double level_at(const Eigen::Vector2d& pixel, double vignetting_power) {
  Scene scene = plain_scene();
  scene.camera = {
      "fisheye", {800, 800}, LensModel::fisheye, {290, 290, 399.5, 399.5, -0.1, 0, 0, 0},
      {},        3e-5,       Readout::rows};
  scene.optics.vignetting_power = vignetting_power;
  scene.board = plain_board();
  const cv::Mat1f image =
      FrameRenderer(scene).render_board(make_board_shot(scene, board_views(1, 5, 0, 0, 0), 0));
  return image(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
}

// 350 px from the center are 95 degrees, 360 px beyond the last ray.
TEST(FrameRenderer, RendersBoardBeyond90DegreesOnlyWithoutVignetting) {
  const double on_axis = level_at({400, 100}, 0);
  EXPECT_GT(on_axis, 0);
  EXPECT_EQ(level_at({749, 400}, 0), on_axis);
  EXPECT_EQ(level_at({765, 400}, 0), 0);
  EXPECT_EQ(level_at({749, 400}, 1), 0);
}

}  // namespace
}  // namespace vlp
