// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

constexpr std::array kImager_px{800, 600};

IntrinsicsInput make_input(const Board& board, const std::vector<BoardView>& views,
                           LensModel model) {
  IntrinsicsInput input{BoardLattice(board), {}, kImager_px, model};
  for (const BoardView& view : views)
    input.views.push_back(input.lattice.list_corners_with_board_positions(view.detection));
  return input;
}

class WriteMrcalCorners : public testing::TestWithParam<bool> {
 protected:
  const TemporaryFolder folder;
  const SyntheticViews views{synthetic_board(GetParam()), synthetic_lens()};
};

/// Tests a plain board, and a Kalibr board, which is four lattices for mrcal.
TEST_P(WriteMrcalCorners, RereadCornersYieldSameLensAsOriginalSolve) {
  constexpr int count = 12;
  Random random(3);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(count, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  std::vector<std::string> names;
  for (int i = 0; i < count; ++i) names.push_back(std::to_string(i) + ".png");
  write_mrcal_corners(folder / "corners.vnl", solution, names);
  const auto read = read_mrcal_corners(folder / "corners.vnl", views.board, kImager_px);
  ASSERT_FALSE(read.empty());
  ASSERT_EQ(read.size(), solution.views.size());
  std::size_t corners = 0;
  for (std::size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].image, names[solution.views[i]]);
    corners += read[i].detection.points.size();
  }
  EXPECT_EQ(corners, static_cast<std::size_t>(solution.corners));
  const IntrinsicsSolution again =
      solve_intrinsics(make_input(views.board, read, LensModel::opencv8));
  ASSERT_TRUE(again.has_succeeded());
  EXPECT_LT(
      compute_projection_difference(solution.fitted_lens(), again.fitted_lens(), kImager_px, even)
          .value()
          .worst_px,
      1e-3);
  EXPECT_NEAR(again.rms_px, solution.rms_px, 1e-5);
}

/// Images of two folders with the same names.
TEST_P(WriteMrcalCorners, AppendsNumbersToRepeatedImageNames) {
  constexpr std::size_t count = 8;
  Random random(3);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(count, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  ASSERT_EQ(solution.views.size(), count);
  const std::vector<std::string> names{"0.png",   "1.png", "0.png", "1.png",
                                       "1.png-2", "a b",   "a_b",   "0.png"};
  write_mrcal_corners(folder / "corners.vnl", solution, names);
  std::vector<std::string> found;
  for (const BoardView& view :
       read_mrcal_corners(folder / "corners.vnl", views.board, kImager_px)) {
    EXPECT_TRUE(view.detection.has_detected_corners());
    found.push_back(view.image);
  }
  EXPECT_EQ(found, (std::vector<std::string>{"0.png", "1.png", "0.png-2", "1.png-2", "1.png-2-2",
                                             "a_b", "a_b-2", "0.png-3"}));
}

INSTANTIATE_TEST_SUITE_P(Boards, WriteMrcalCorners, testing::Values(false, true));

Board chessboard() {
  Board board{"", 4, 5, 0, 1, 1, false, 0, {false, BoardCorner::top_left}};
  board.kind = BoardKind::chessboard;
  board.square_size_m = 0.02;
  return board;
}

std::string row(const std::string& x_and_y, const std::string& fourth) {
  return "0.png " + x_and_y + " " + fourth + "\n";
}

TEST(ReadMrcalCorners, ReturnsWeightsFromLevelOrWeightColumn) {
  const TemporaryFolder folder;
  std::string rows;
  for (int i = 0; i < 12; ++i) {
    rows += row(std::to_string(100 + 40 * (i % 3)) + " " + std::to_string(100 + 40 * (i / 3)),
                i == 0   ? "-"
                : i == 1 ? "0.5"
                         : "1");
  }
  rows += "none.png - -\n";
  const auto read = [&](const std::string& legend) {
    return read_mrcal_corners(folder.file("corners.vnl", "## a comment\n" + legend + rows),
                              chessboard(), kImager_px);
  };
  const auto by_level = read("# filename x y level\n");
  ASSERT_EQ(by_level.size(), 2U);
  EXPECT_FALSE(by_level[1].detection.has_detected_corners());
  ASSERT_EQ(by_level[0].detection.points.size(), 11U);
  EXPECT_EQ(by_level[0].detection.points[0].index, 1U);
  EXPECT_EQ(by_level[0].detection.points[0].weight, 1);  // mrcal takes the whole part
  EXPECT_EQ(by_level[0].detection.points[1].weight, 0.5);
  const auto by_weight = read("# filename x y weight\n");
  ASSERT_EQ(by_weight.size(), 2U);
  ASSERT_EQ(by_weight[0].detection.points.size(), 11U);
  EXPECT_EQ(by_weight[0].detection.points[0].weight, 0.5);
  EXPECT_EQ(by_weight[0].detection.points[1].weight, 1);
}

TEST(ReadMrcalCorners, ThrowsForWeightAbove1000) {
  const TemporaryFolder folder;
  const auto file = folder.file("corners.vnl", "# filename x y weight\n" + row("100 100", "1e7"));
  EXPECT_EQ(rejection_message([&] { read_mrcal_corners(file, chessboard(), kImager_px); }),
            file.string() + ":2: a weight of 1e+07: weights go up to 1000");
}

/// Levels start at 0, so that weights above 1 are written as weights, also powers of two.
TEST(ReadMrcalCorners, ReturnsWeightsWrittenByWriteMrcalCorners) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(6);
  IntrinsicsInput input = views.input(6, random, 0.05);
  for (const double most : {1.0, 2.0}) {
    for (auto& view : input.views) {
      for (std::size_t i = 0; i < view.size(); ++i) view[i].weight = most / (i % 2 == 0 ? 1 : 4);
    }
    const IntrinsicsSolution solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    ASSERT_GT(solution.corners, 0);
    const TemporaryFolder folder;
    const auto file = folder / "corners.vnl";
    const std::vector<std::string> names{"0", "1", "2", "3", "4", "5"};
    write_mrcal_corners(file, solution, names);
    std::size_t corners = 0;
    for (const BoardView& view : read_mrcal_corners(file, views.board, kImager_px)) {
      for (const PointDetection& point : view.detection.points) {
        EXPECT_TRUE(point.weight == most || point.weight == most / 4) << point.weight;
        ++corners;
      }
    }
    EXPECT_EQ(corners, static_cast<std::size_t>(solution.corners));
  }
}

/// With either solver, corners with large errors and small weights have little influence.
TEST(CornerWeight, SmallWeightsKeepSolvedLensAccurateDespiteCornerErrors) {
  const std::array fisheye{450.0, 451.0, 402.0, 297.0, 0.02, -0.01, 0.003, -0.0004};
  for (const Lens& lens : {synthetic_lens(), Lens(LensModel::fisheye, fisheye)}) {
    SCOPED_TRACE(lens_model_name(lens.lens_model()));
    const SyntheticViews views{synthetic_board(false), lens};
    Random random(5);
    IntrinsicsInput input = views.input(16, random, 0.05);
    input.warp = WarpChoice::off;
    for (auto& view : input.views) {
      for (auto& corner : view) corner.d_pixel_d_edge_shift.setZero();
    }
    const IntrinsicsSolution whole = solve_intrinsics(input);
    IntrinsicsInput weighted = input;
    for (auto& view : weighted.views) {
      for (auto& corner : view) corner.weight = 0.5;
    }
    const IntrinsicsSolution half = solve_intrinsics(weighted);
    ASSERT_TRUE(whole.has_succeeded() && half.has_succeeded());
    EXPECT_NEAR(half.rms_px, whole.rms_px / 2, 0.02 * whole.rms_px);
    // Every second corner has errors of a pixel, with a fiftieth of the weight.
    for (auto& view : input.views) {
      for (std::size_t i = 0; i < view.size(); i += 2) {
        view[i].pixel += Eigen::Vector2d(random.normal(), random.normal());
        view[i].weight = 0.02;
      }
    }
    const IntrinsicsSolution spoilt = solve_intrinsics(input);
    ASSERT_TRUE(spoilt.has_succeeded());
    EXPECT_LT(
        compute_projection_difference(lens, spoilt.fitted_lens(), kImager_px, even).value().mean_px,
        0.1);
  }
}

}  // namespace
}  // namespace vlp
