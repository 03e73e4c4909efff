// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Chessboards and ChArUco boards end to end: printed, rendered, calibrated from.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>

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
    return compare_projections(Lens(truth.lens_model, truth.intrinsics),
                               Lens(found.camera.lens_model, found.camera.intrinsics),
                               truth.imager_px, [](const auto&) { return 1; })
        ->mean_px;
  }

  const std::string rig = (folder / "rig").string();
  const std::string boards = rig + "/boards", board = rig + "/board.yaml";
};

TEST_F(VlpIntrinsicsSquareBoards, EstimatesLensFromChessboardAndRejectsSizeInCorners) {
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

TEST_F(VlpIntrinsicsSquareBoards, EstimatesLensFromCharucoBoardAndItsCorners) {
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
}

}  // namespace
}  // namespace vlp
