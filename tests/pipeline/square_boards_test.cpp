// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Chessboards and ChArUco boards end to end: printed, rendered, calibrated from.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "calibration/intrinsics/projection_difference.h"
#include "detection/boards/board_detector.h"
#include "pipeline/intrinsics_program.h"
#include "rig/board.h"
#include "rig/calibration.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VlpIntrinsicsSquareBoards : public VlpIntrinsics {
 protected:
  /// The camera of paper-rig, before a board of this print.
  void render(const std::string& print, const std::string& views) const {
    std::string scene =
        TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
    const auto from = scene.find("{family:"), to = scene.find('}', from) + 1;
    scene.replace(from, to - from, print);
    scene.resize(scene.find("captures:"));
    scene += "captures: [{folder: boards, exposure_s: 0.004, views: " + views + "}]\n";
    const auto done =
        run_program("vlp-simulate -q " + folder.file("scene.yaml", scene).string() + " -o " + rig);
    ASSERT_EQ(done.exit_code, 0) << done.errors;
  }
  /// Over the whole image.
  double mean_error_px() const {
    const Camera truth = read_calibration(rig + "/true_calibration.yaml").camera;
    const Calibration found = read_calibration(folder / "camera.yaml");
    return compute_projection_difference(Lens(truth.lens_model, truth.intrinsics),
                                         Lens(found.camera.lens_model, found.camera.intrinsics),
                                         truth.imager_px, [](const auto&) { return 1; })
        ->mean_px;
  }
  std::string board_with(const std::string& from, const std::string& to) const {
    std::string text = TemporaryFolder::read_content(rig + "/board.yaml");
    text.replace(text.find(from), from.size(), to);
    return folder.file("board.yaml", text).string();
  }

  const std::string rig = (folder / "rig").string();
  const std::string boards = rig + "/boards", board = rig + "/board.yaml";
};

TEST_F(VlpIntrinsicsSquareBoards, EstimatesLensFromChessboardAndRejectsCornerCountsAsSize) {
  render("{kind: chessboard, cols: 10, rows: 7, square_size_m: 0.015}",
         "{count: 24, distance_m: [0.15, 0.25], tilt_deg: 45, roll_deg: 180, field_coverage: 0.7}");
  const std::string cache = " --cache " + (folder / "cache").string();
  const auto found = calibrate(boards, board, "-v" + cache);
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_THAT(found.errors,
              HasSubstr("no complete chessboard of 10 x 7 squares; the largest part has "));
  EXPECT_THAT(found.errors,
              HasSubstr("a chessboard has the same appearance after a rotation by 180 degrees"));
  EXPECT_LT(mean_error_px(), 0.04);  // of twelve views
  const std::string camera = content("camera.cameramodel");
  EXPECT_EQ(calibrate(boards, board, cache).exit_code, 0);
  EXPECT_EQ(content("camera.cameramodel"), camera);

  // Turned by a quarter it is a board of 7 x 10.
  std::string turned = TemporaryFolder::read_content(board);
  turned.replace(turned.find("cols: 10\nrows: 7"), 16, "cols: 7\nrows: 10");
  EXPECT_EQ(calibrate(boards, folder.file("turned.yaml", turned).string()).exit_code, 0);
  EXPECT_LT(mean_error_px(), 0.04);

  std::string counted = TemporaryFolder::read_content(board);
  counted.replace(counted.find("cols: 10\nrows: 7"), 16, "cols: 9\nrows: 6");
  const auto corners = calibrate(boards, folder.file("counted.yaml", counted).string());
  EXPECT_EQ(corners.exit_code, 2);
  EXPECT_THAT(corners.errors,
              HasSubstr("the images show a chessboard of 10 x 7 squares or more: cols and "
                        "rows count squares, not the corners between them"));
}

TEST_F(VlpIntrinsicsSquareBoards, EstimatesLensFromCharucoBoardAndNamesWrongBoardKeys) {
  render(
      "{kind: charuco, cols: 10, rows: 8, square_size_m: 0.02, marker_size_m: 0.015, "
      "dictionary: DICT_5X5_100, top_left: white}",
      "{count: 20, distance_m: [0.13, 0.28], tilt_deg: 45, roll_deg: 180, field_coverage: 1}");
  const std::string table = (folder / "corners.csv").string();
  const auto found = calibrate(boards, board, "--corners " + table);
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_LT(mean_error_px(), 0.04);  // of twelve views
  const std::string camera = content("camera.cameramodel");
  ASSERT_EQ(calibrate(table, board, "--imager-px 800 600").exit_code, 0);
  EXPECT_EQ(content("camera.cameramodel"), camera);
  ASSERT_EQ(calibrate(boards + "/true_corners.csv", board, "--imager-px 800 600").exit_code, 0);
  EXPECT_LT(mean_error_px(), 0.003);

  const auto refusal = [&](const std::string& from, const std::string& to) {
    const auto result = calibrate(boards, board_with(from, to));
    EXPECT_EQ(result.exit_code, 2) << result.output;
    return result.errors;
  };
  EXPECT_THAT(refusal("DICT_5X5_100", "DICT_4X4_100"),
              HasSubstr("the image shows markers of DICT_5X5"));
  EXPECT_THAT(refusal("DICT_5X5_100", "DICT_5X5_99"), HasSubstr("OpenCV has no dictionary"));
  EXPECT_THAT(refusal("top_left: white", "top_left: black"),
              HasSubstr("the images show cols 10, rows 8, top_left white"));
  EXPECT_THAT(refusal("cols: 10\nrows: 8", "cols: 8\nrows: 10"),
              HasSubstr("the images show cols 10, rows 8, top_left white"));
  EXPECT_THAT(refusal("marker_size_m: 0.015", "marker_size_m: 0.01"),
              HasSubstr("a square is 2 markers wide by board.yaml, but 1.3"));
}

TEST_F(VlpIntrinsicsSquareBoards, VlpBoardPrintsSquaresToScale) {
  const std::string pdf = (folder / "board.pdf").string();
  const auto made = run_program("vlp-board --charuco --dictionary DICT_4X4_50 -o " + pdf);
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  const Board charuco = read_board(folder / "board.yaml");
  EXPECT_EQ(charuco.kind, BoardKind::charuco);
  EXPECT_EQ(charuco.family, "DICT_4X4_50");
  for (const std::string wrong : {"--chessboard --tag-mm 20", "--chessboard --cols 3",
                                  "--square-mm 20", "--charuco --dictionary DICT_4X4_5"}) {
    EXPECT_EQ(run_program("vlp-board " + wrong + " -o " + (folder / "no.pdf").string()).exit_code,
              2)
        << wrong;
  }
  EXPECT_FALSE(fs::exists(folder / "no.pdf"));
  ASSERT_EQ(run_program("vlp-board --chessboard --square-mm 20 -o " +
                        (folder / "chessboard.pdf").string())
                .exit_code,
            0);
  const Board chessboard = read_board(folder / "chessboard.yaml");
  EXPECT_EQ(chessboard.square_size_m, 0.02);
  if (run_program("command -v pdftoppm").exit_code != 0) GTEST_SKIP() << "no pdftoppm here";
  constexpr double px_per_m = 10000 / 2.0;  // 127 dpi
  for (const auto& [name, print] :
       {std::pair("board", charuco), std::pair("chessboard", chessboard)}) {
    SCOPED_TRACE(name);
    const std::string page = (folder / name).string();
    ASSERT_EQ(
        run_program("pdftoppm -r 127 -gray -singlefile -png " + page + ".pdf " + page).exit_code,
        0);
    const BoardDetection seen =
        BoardDetector(print).detect_board(cv::imread(page + ".png", cv::IMREAD_GRAYSCALE));
    ASSERT_EQ(seen.points.size(), static_cast<std::size_t>((print.cols - 1) * (print.rows - 1)));
    const double width_px =
        (seen.points[static_cast<std::size_t>(print.cols - 2)].pixel - seen.points[0].pixel).norm();
    EXPECT_NEAR(width_px / px_per_m, (print.cols - 2) * print.square_size_m, 1e-4);
  }
}

}  // namespace
}  // namespace vlp
