// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Corners of tags whose edges are detected with a wrong curvature.
#include "calibration/intrinsics/edge_corrections.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "calibration/intrinsics/synthetic_views.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "simulation/scene.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

constexpr double kReach = 0.8;

/// Fits the parabola a + b w + c w^2 off the chord, by least squares, to the image of the straight
/// line between two pixels, up to kReach along it.
Eigen::Vector3d fit_parabola(const Lens& lens, const Eigen::Vector2d& from,
                             const Eigen::Vector2d& to, const Eigen::Vector2d& outwards) {
  constexpr int steps = 2000;
  const Eigen::Vector3d a = lens.unproject_pixel(from).value().direction,
                        b = lens.unproject_pixel(to).value().direction;
  const Eigen::Vector2d length = to - from;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double before = -1;
  for (int i = 1; i < steps; ++i) {
    const double share = double(i) / steps;
    const Eigen::Vector2d off = lens.project_point((1 - share) * a + share * b).value() - from;
    const double w = 2 * length.dot(off) / length.squaredNorm() - 1, step = w - before;
    before = w;
    if (std::abs(w) > kReach) continue;
    const Eigen::Vector3d terms(1, w, w * w);
    normal += step * terms * terms.transpose();
    right += step * outwards.dot(off) * terms;
  }
  return normal.inverse() * right;
}

struct Tag {
  std::array<Eigen::Vector2d, 4> truth;
  std::vector<BoardLattice::Corner> seen;
};

/// Returns a tag in the corner of the image, with edges whose fitted parabolas have curvature
/// errors. The fit displaces an edge outwards by error_px (reach^2 / 3 - w^2), which a straight
/// line would not show.
Tag tag_with_errors(const std::array<double, 4>& error_px) {
  const Lens lens = synthetic_lens();
  Tag tag;
  tag.truth = {{{60, 120}, {118, 131}, {126, 72}, {64, 60}}};
  const Eigen::Vector2d middle = (tag.truth[0] + tag.truth[1] + tag.truth[2] + tag.truth[3]) / 4;
  std::array<Eigen::Vector2d, 4> outwards;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d along = (tag.truth[(k + 1) % 4] - tag.truth[k]).normalized();
    outwards[k] = {along.y(), -along.x()};
    if (outwards[k].dot(middle - tag.truth[k]) > 0) outwards[k] *= -1;
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t previous = (k + 3) % 4, next = (k + 1) % 4;
    const auto fitted = [&](std::size_t edge, std::size_t other) {
      Eigen::Vector3d abc = fit_parabola(lens, tag.truth[edge], tag.truth[other], outwards[edge]);
      abc += error_px[edge] * Eigen::Vector3d(kReach * kReach / 3, 0, -1);
      return abc;
    };
    const Eigen::Vector3d arriving = fitted(previous, k), leaving = fitted(k, next);
    Eigen::Matrix2d normals;
    normals << outwards[previous].transpose(), outwards[k].transpose();
    const Eigen::Vector2d off =
        normals.inverse() * Eigen::Vector2d(arriving.sum(), leaving.dot(Eigen::Vector3d(1, -1, 1)));
    tag.seen.push_back(
        {Eigen::Vector3d::Zero(), tag.truth[k] + off, 0, k, {0, 0}, 1, {leaving[2], 0, kReach}});
  }
  return tag;
}

TEST(CorrectCornersForEdgeCurvature, RemovesCornerErrorsCausedByCurvatureErrors) {
  for (const std::array<double, 4> errors_px :
       {std::array{0.0, 0.0, 0.0, 0.0}, {0.1, 0.0, 0.0, 0.0}, {0.06, -0.1, 0.03, 0.08}}) {
    Tag tag = tag_with_errors(errors_px);
    correct_corners_for_edge_curvature(tag.seen, synthetic_lens());
    for (std::size_t k = 0; k < 4; ++k) {
      // The errors rotate the chords.
      EXPECT_LT((tag.seen[k].pixel - tag.truth[k]).norm(), 1e-3);
    }
    // The corners now have the curvature of the lens.
    EXPECT_LT(correct_corners_for_edge_curvature(tag.seen, synthetic_lens()), 1e-3);
  }
}

TEST(CorrectCornersForEdgeCurvature, CorrectsEachOfSeveralTagsLikeOneAlone) {
  const std::vector<BoardLattice::Corner> unchanged = tag_with_errors({0.1, 0.1, 0.1, 0.1}).seen;
  std::vector<BoardLattice::Corner> alone = tag_with_errors({0.06, -0.1, 0.03, 0.08}).seen;
  std::vector<BoardLattice::Corner> all = unchanged;
  all[3].curvature.reach = 0;  // an edge of the first tag has no measured curvature
  all.insert(all.end(), alone.begin(), alone.end());
  all.insert(all.end(), alone.begin(), alone.end());
  const double displacement_px = correct_corners_for_edge_curvature(alone, synthetic_lens());
  EXPECT_GT(displacement_px, 0.05);
  EXPECT_EQ(correct_corners_for_edge_curvature(all, synthetic_lens()), displacement_px);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(all[k].pixel, unchanged[k].pixel);
    EXPECT_EQ(all[4 + k].pixel, alone[k].pixel);
    EXPECT_EQ(all[8 + k].pixel, alone[k].pixel);
  }
}

TEST(CorrectCornersForEdgeCurvature, KeepsCornersOfTagWithUnmeasuredEdgeCurvature) {
  Tag tag = tag_with_errors({0.1, 0.1, 0.1, 0.1});
  tag.seen[2].curvature.reach = 0;
  const auto before = tag.seen;
  EXPECT_EQ(correct_corners_for_edge_curvature(tag.seen, synthetic_lens()), 0);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(tag.seen[k].pixel, before[k].pixel);
}

/// Above all the noise of the position of a tag as a whole.
TEST(CorrectCornersForEdgeCurvature, ReducesCornerErrorsOfRenderedBoardByQuarter) {
  const Scene scene = read_scene_file(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
  const CaptureSet views = *std::ranges::find(scene.sets, "boards", &CaptureSet::folder);
  const FrameRenderer renderer(scene);
  const BoardDetector detector(scene.board->pattern);
  const BoardLattice lattice(scene.board->pattern);
  const Lens lens(scene.camera.lens_model, scene.camera.intrinsics);
  std::array<double, 2> squares{}, of_tags{};
  double stated = 0;
  std::size_t corners = 0;
  for (std::size_t index = 0; index < 8; ++index) {
    const BoardShot shot = make_board_capture_parameters(scene, views, index);
    std::map<int, TagDetection::Corners> truth;
    for (const auto& [tag, corner, pixel] :
         project_scene_corners_into_image(scene, renderer, shot)) {
      truth[*tag][static_cast<std::size_t>(corner)] = pixel;
    }
    const BoardDetection seen = detector.detect_board(
        simulate_sensor_image(scene.sensor, renderer.render_board_in_electrons(shot), index));
    auto all = lattice.list_corners_with_board_positions(seen);
    for (const std::size_t pass : {0U, 1U}) {
      for (std::size_t i = 0; i < seen.tags.size(); ++i) {
        Eigen::Vector2d sum(0, 0);
        for (std::size_t k = 0; k < 4; ++k) {
          const Eigen::Vector2d error = all[4 * i + k].pixel - truth[seen.tags[i].id][k];
          squares[pass] += error.squaredNorm();
          sum += error / 4;
        }
        of_tags[pass] += sum.squaredNorm();
      }
      correct_corners_for_edge_curvature(all, lens);
    }
    for (const auto& corner : all) stated += 2 * corner.sd_px * corner.sd_px;
    corners += all.size();
  }
  ASSERT_GT(corners, 400U);
  const auto px = [&](double sum) { return std::sqrt(sum / (2 * double(corners))); };
  EXPECT_LT(px(squares[1]), 0.75 * px(squares[0]));
  EXPECT_LT(px(4 * of_tags[1]), 0.62 * px(4 * of_tags[0]));
  // Pixel noise explains most of the remaining error.
  EXPECT_NEAR(px(stated) / px(squares[1]), 1, 0.2);
  RecordProperty("stated_px", std::to_string(px(stated)));
  RecordProperty("seen_px", std::to_string(px(squares[0])));
  RecordProperty("with_lens_px", std::to_string(px(squares[1])));
  RecordProperty("tags_seen_px", std::to_string(px(4 * of_tags[0])));
  RecordProperty("tags_with_lens_px", std::to_string(px(4 * of_tags[1])));
}

/// Returns the corners of an upright rectangle of 40 x 60 px around (500, 300), with the same
/// curvature of all edges.
std::vector<BoardLattice::Corner> rectangle_with_curvature(const EdgeCurvature& curvature) {
  std::vector<BoardLattice::Corner> corners;
  for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(480, 330), Eigen::Vector2d(520, 330),
                                       Eigen::Vector2d(520, 270), Eigen::Vector2d(480, 270)}) {
    BoardLattice::Corner& corner = corners.emplace_back();
    corner.pixel = pixel;
    corner.curvature = curvature;
  }
  return corners;
}

Lens straight_lens() { return Lens(LensModel::pinhole, std::array{500.0, 520.0, 400.0, 310.0}); }

// The edges of a lens without distortion are straight. The least-squares line of q (w^2 - 1) up to
// w = r is q (r^2 / 3 - 1), that of c (w^3 - w) is c (3 r^2 / 5 - 1) w.
TEST(CorrectCornersForEdgeCurvature, MovesCornersByLineFittedToCurvature) {
  constexpr double q = 0.3, c = 0.2, reach = 0.7;
  auto corners = rectangle_with_curvature({q, c, reach});
  const auto before = corners;
  const double mean = q * (reach * reach / 3 - 1), slope = c * (3 * reach * reach / 5 - 1);
  const double displacement_px = correct_corners_for_edge_curvature(corners, straight_lens());
  // Outward displacements of the lower, right, upper and left edge at their first and second ends.
  const double first = mean - slope, second = mean + slope;
  const std::array<Eigen::Vector2d, 4> expected{
      {{-second, first}, {first, second}, {second, -first}, {-first, -second}}};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_LT((corners[k].pixel - before[k].pixel - expected[k]).norm(), 1e-9) << k;
    EXPECT_NEAR(corners[k].curvature.quadratic_px, 0, 1e-9);
    EXPECT_NEAR(corners[k].curvature.cubic_px, 0, 1e-9);
    EXPECT_EQ(corners[k].curvature.reach, reach);
  }
  EXPECT_NEAR(displacement_px, std::hypot(first, second), 1e-9);
}

TEST(CorrectCornersForEdgeCurvature, ReturnsLargestDisplacementOfCorners) {
  auto corners = rectangle_with_curvature({0, 0, 1});
  corners[1].curvature.quadratic_px = 0.3;  // the right edge moves inwards by 0.2 px
  corners[2].curvature.quadratic_px = 0.6;  // the upper edge moves inwards by 0.4 px
  EXPECT_NEAR(correct_corners_for_edge_curvature(corners, straight_lens()), std::hypot(0.2, 0.4),
              1e-9);
  EXPECT_LT((corners[0].pixel - Eigen::Vector2d(480, 330)).norm(), 1e-9);
  EXPECT_LT((corners[1].pixel - Eigen::Vector2d(519.8, 330)).norm(), 1e-9);
  EXPECT_LT((corners[2].pixel - Eigen::Vector2d(519.8, 270.4)).norm(), 1e-9);
  EXPECT_LT((corners[3].pixel - Eigen::Vector2d(480, 270.4)).norm(), 1e-9);
}

// Corners move by sqrt(2) 2 q / 3 with reach 1. A quarter of the shorter edge is 10 px.
TEST(CorrectCornersForEdgeCurvature, KeepsTagIfCornerWouldMoveByQuarterOfEdge) {
  for (const double sign : {-1.0, 1.0}) {
    const double limit = sign * 10 / std::sqrt(2) * 3 / 2;
    auto below = rectangle_with_curvature({0.99 * limit, 0, 1});
    EXPECT_NEAR(correct_corners_for_edge_curvature(below, straight_lens()), 9.9, 1e-6);
    auto above = rectangle_with_curvature({1.01 * limit, 0, 1});
    EXPECT_EQ(correct_corners_for_edge_curvature(above, straight_lens()), 0);
    EXPECT_EQ(above[0].pixel, Eigen::Vector2d(480, 330));
    EXPECT_EQ(above[0].curvature.quadratic_px, 1.01 * limit);
  }
}

TEST(CorrectCornersForEdgeCurvature, KeepsTagOutsideImageCircleOfFisheye) {
  // The image circle ends 122 px from its center.
  const Lens fisheye(LensModel::fisheye,
                     std::array{100.0, 100.0, 400.0, 300.0, -0.1, 0.0, 0.0, 0.0});
  auto outside = rectangle_with_curvature({0.1, 0, 1});
  for (auto& corner : outside) corner.pixel.x() += 10;
  ASSERT_TRUE(fisheye.unproject_pixel(outside[0].pixel));
  ASSERT_FALSE(fisheye.unproject_pixel(outside[1].pixel));
  EXPECT_EQ(correct_corners_for_edge_curvature(outside, fisheye), 0);
  EXPECT_EQ(outside[3].pixel, Eigen::Vector2d(490, 270));
  auto inside = rectangle_with_curvature({0.1, 0, 1});
  for (auto& corner : inside) corner.pixel.x() -= 80;
  EXPECT_GT(correct_corners_for_edge_curvature(inside, fisheye), 0);
}

/// Returns the outward distance of the image of a straight line from its chord at w, by bisection.
double sagitta_by_bisection(const Lens& lens, const Eigen::Vector2d& from,
                            const Eigen::Vector2d& to, const Eigen::Vector2d& inside, double w) {
  const Eigen::Vector3d a = lens.unproject_pixel(from).value().direction,
                        b = lens.unproject_pixel(to).value().direction;
  const Eigen::Vector2d along = to - from;
  double low = 0, high = 1;
  Eigen::Vector2d offset(0, 0);
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    offset = lens.project_point((1 - middle) * a + middle * b).value() - from;
    (2 * along.dot(offset) / along.squaredNorm() - 1 < w ? low : high) = middle;
  }
  const auto side = [&](const Eigen::Vector2d& v) { return along.x() * v.y() - along.y() * v.x(); };
  return (side(inside - from) > 0 ? -1 : 1) * side(offset) / along.norm();
}

TEST(CorrectCornersForEdgeCurvature, MatchesIntegralsOverEdgesOfDistortedLens) {
  const Lens lens = synthetic_lens();
  // Both directions of rotation.
  for (const bool is_mirrored : {false, true}) {
    std::vector<BoardLattice::Corner> corners(4);
    const std::array<Eigen::Vector2d, 4> pixels{{{60, 120}, {158, 131}, {146, 52}, {64, 40}}};
    const std::array<EdgeCurvature, 4> curvatures{
        {{0.3, 0.1, 0.8}, {-0.2, 0.2, 0.9}, {0.1, -0.3, 0.7}, {-0.1, -0.15, 1.0}}};
    for (std::size_t k = 0; k < 4; ++k) {
      corners[k].pixel = pixels[is_mirrored ? 3 - k : k];
      corners[k].curvature = curvatures[k];
    }
    const auto before = corners;
    const Eigen::Vector2d inside = (pixels[0] + pixels[1] + pixels[2] + pixels[3]) / 4;
    // Outward displacements of each edge at both ends: the line fitted to the difference of the
    // curves.
    std::array<std::array<double, 2>, 4> ends{};
    for (std::size_t k = 0; k < 4; ++k) {
      const auto& [from, to] = std::pair(before[k].pixel, before[(k + 1) % 4].pixel);
      const double reach = curvatures[k].reach;
      double sum = 0, moment = 0, squares = 0;
      constexpr int steps = 400;
      for (int i = 0; i < steps; ++i) {
        const double w = reach * (2 * (i + 0.5) / steps - 1);
        const double seen =
            curvatures[k].quadratic_px * (w * w - 1) + curvatures[k].cubic_px * (w * w * w - w);
        const double difference = seen - sagitta_by_bisection(lens, from, to, inside, w);
        sum += difference;
        moment += difference * w;
        squares += w * w;
      }
      ends[k] = {sum / steps - moment / squares, sum / steps + moment / squares};
    }
    const double displacement_px = correct_corners_for_edge_curvature(corners, lens);
    double largest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d step = corners[k].pixel - before[k].pixel;
      largest = std::max(largest, step.norm());
      for (const bool arriving : {false, true}) {
        const std::size_t edge = arriving ? (k + 3) % 4 : k;
        const Eigen::Vector2d along =
            (before[(edge + 1) % 4].pixel - before[edge].pixel).normalized();
        const double sign =
            along.x() * (inside - before[k].pixel).y() - along.y() * (inside - before[k].pixel).x();
        const double outwards = (sign > 0 ? -1 : 1) * (along.x() * step.y() - along.y() * step.x());
        // The places on the edge are found by three iterations, accurate to 1e-4 px.
        EXPECT_NEAR(outwards, ends[edge][arriving ? 1 : 0], 3e-4) << k << ' ' << arriving;
      }
      for (const double w : {-0.5, 0.0, 0.5}) {
        EXPECT_NEAR(
            corners[k].curvature.curve_offset_from_straight_line_px(w),
            sagitta_by_bisection(lens, before[k].pixel, before[(k + 1) % 4].pixel, inside, w),
            0.02 * std::abs(corners[k].curvature.quadratic_px))
            << k << ' ' << w;
      }
    }
    EXPECT_NEAR(displacement_px, largest, 1e-12);
  }
}

}  // namespace
}  // namespace vlp
