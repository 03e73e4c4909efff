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

TEST(CorrectCurvature, RemovesCornerErrorsCausedByCurvatureErrors) {
  for (const std::array<double, 4> errors_px :
       {std::array{0.0, 0.0, 0.0, 0.0}, {0.1, 0.0, 0.0, 0.0}, {0.06, -0.1, 0.03, 0.08}}) {
    Tag tag = tag_with_errors(errors_px);
    correct_curvature(tag.seen, synthetic_lens());
    for (std::size_t k = 0; k < 4; ++k) {
      // The errors rotate the chords.
      EXPECT_LT((tag.seen[k].pixel - tag.truth[k]).norm(), 1e-3);
    }
    // The corners now have the curvature of the lens.
    EXPECT_LT(correct_curvature(tag.seen, synthetic_lens()), 1e-3);
  }
}

TEST(CorrectCurvature, KeepsCornersOfTagWithUnmeasuredEdgeCurvature) {
  Tag tag = tag_with_errors({0.1, 0.1, 0.1, 0.1});
  tag.seen[2].curvature.reach = 0;
  const auto before = tag.seen;
  EXPECT_EQ(correct_curvature(tag.seen, synthetic_lens()), 0);
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(tag.seen[k].pixel, before[k].pixel);
}

/// Above all the noise of the position of a tag as a whole.
TEST(CorrectCurvature, ReducesCornerErrorsOfRenderedBoardByQuarter) {
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
    const BoardShot shot = make_board_shot(scene, views, index);
    std::map<int, TagDetection::Corners> truth;
    for (const auto& [tag, corner, pixel] : list_true_corners(scene, renderer, shot)) {
      truth[*tag][static_cast<std::size_t>(corner)] = pixel;
    }
    const BoardDetection seen = detector.detect_board(
        simulate_sensor_image(scene.sensor, renderer.render_board(shot), index));
    auto all = lattice.list_corners(seen);
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
      correct_curvature(all, lens);
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
TEST(CorrectCurvature, MovesCornersByLineFittedToCurvature) {
  constexpr double q = 0.3, c = 0.2, reach = 0.7;
  auto corners = rectangle_with_curvature({q, c, reach});
  const auto before = corners;
  const double mean = q * (reach * reach / 3 - 1), slope = c * (3 * reach * reach / 5 - 1);
  const double displacement_px = correct_curvature(corners, straight_lens());
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

}  // namespace
}  // namespace vlp
