// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics on files of corners instead of images, against the same from images and against
/// mrcal's own tool.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "detection/boards/corner_table.h"
#include "pipeline/intrinsics_program.h"
#include "rig/calibration.h"
#include "support/datasets.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class VlpIntrinsicsCornerFiles : public VlpIntrinsics {
 protected:
  /// The rows of a table of 3 x 3 corners of a chessboard; an image to each place.
  static std::string vnl(std::initializer_list<const char*> names) {
    std::string text = "# filename x y level\n";
    for (const std::string name : names) {
      for (int i = 0; i < 9; ++i) {
        text += name + " " + std::to_string(100 + 50 * (i % 3)) + " " +
                std::to_string(100 + 50 * (i / 3)) + " 0\n";
      }
    }
    return text;
  }
  std::string refusal(const std::string& corners, const std::string& options) const {
    const auto result = calibrate(corners, chessboard, options);
    EXPECT_EQ(result.exit_code, 2) << result.output;
    // Warnings of skipped images may precede the error.
    const auto begin = result.errors.find("vlp-intrinsics: error: ");
    const std::string error = result.errors.substr(std::min(begin, result.errors.size()));
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 1) << result.errors;
    return result.errors;
  }
  Lens read_lens(const char* name) const {
    const Camera camera = read_calibration(folder / name).camera;
    return Lens(camera.lens_model, camera.intrinsics);
  }

  const std::string chessboard =
      folder
          .file("chessboard.yaml",
                "format: vlp-board/1\nkind: chessboard\ncols: 4\nrows: 4\nsquare_size_m: 0.02\n")
          .string();
};

constexpr const char* kSize = "--imager-px 800 600";

TEST_F(VlpIntrinsicsCornerFiles, RejectOptionsThatApplyOnlyToImages) {
  const std::string corners = folder.file("corners.vnl", vnl({"a.png"})).string();
  for (const std::string option : {"--cache", "--threads", "--max-mpx", "--every"}) {
    EXPECT_EQ(refusal(corners, std::string(kSize) + " " + option + " 2"),
              "vlp-intrinsics: error: " + option + ": only for images, and " + corners +
                  " is a file of corners; leave it out\n");
  }
}

/// A slip in a table costs its tag, and neither the view nor the table.
TEST_F(VlpIntrinsicsCornerFiles, YieldAccurateLensDespiteOneWrongCorner) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  std::vector<BoardView> seen;
  Random random(5);
  const BoardLattice lattice(views.board);
  constexpr double noise_px = 0.02;
  while (seen.size() < 10) {
    const BoardDetection view = views.random_view(random, noise_px);
    if (!lattice.are_corners_sufficient_for_pose(view)) continue;
    seen.push_back({"view" + std::to_string(seen.size()) + ".png", views.imager_px, view});
  }
  const fs::path table = folder / "corners.csv", board = folder / "board.yaml";
  write_board(board, views.board);
  const auto lens_with = [&](const Eigen::Vector2d& wrong) {
    auto spoilt = seen;
    spoilt[3].detection.tags[7].corners_px[2] = wrong;
    write_corner_table(table, spoilt, views.board);
    const auto result = calibrate(table.string(), board.string(), kSize);
    EXPECT_LE(result.exit_code, 1) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("view3.png: 1 of its "));
    EXPECT_THAT(result.errors, HasSubstr("corners are not where their neighbors predict them"));
    EXPECT_THAT(result.output, HasSubstr("views         10 used, 0 rejected"));
    return read_lens("camera.yaml");
  };
  for (const Eigen::Vector2d& wrong : {Eigen::Vector2d(2, 2), {-5, 20}, {1e6, 300}}) {
    const auto apart = compute_projection_difference(views.lens, lens_with(wrong), views.imager_px,
                                                     [](const auto&) { return 1; });
    EXPECT_LT(apart->mean_px, 0.1);
  }
}

/// Before images are looked at, which there are none of here.
TEST_F(VlpIntrinsicsCornerFiles, RejectWarpOfSquareChessboard) {
  const std::string none = (folder / "none.png").string();
  for (const std::string& images : {none, folder.file("corners.vnl", vnl({"a.png"})).string()}) {
    EXPECT_THAT(refusal(images, images == none ? "--warp on" : std::string("--warp on ") + kSize),
                HasSubstr("--warp on: not possible for a square chessboard"));
  }
}

TEST_F(VlpIntrinsicsCornerFiles, TablesYieldSameLensAsImagesAndAsSolveOfMrcal) {
  const std::string rig = (folder / "rig").string(), board = rig + "/board.yaml";
  ASSERT_EQ(run_program("vlp-simulate -q " VLP_SOURCE_DIR
                        "/datasets/paper-rig/scene.yaml --only boards -o " +
                        rig)
                .exit_code,
            0);
  const std::string table = (folder / "corners.csv").string();
  const std::string views = rig + "/boards/00[01]?.png";
  ASSERT_EQ(calibrate(views, board, "--warp on --corners " + table).exit_code, 0);
  const std::string model = content("camera.cameramodel"), corners = content("camera.corners.vnl");
  const Camera from_images = read_calibration(folder / "camera.yaml").camera;

  const auto again = calibrate(table, board, std::string("--warp on ") + kSize);
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_EQ(read_calibration(folder / "camera.yaml").camera.intrinsics, from_images.intrinsics);
  EXPECT_EQ(content("camera.cameramodel"), model);
  EXPECT_EQ(content("camera.corners.vnl"), corners);

  // mrcal's table has the corners without the shift of their edges.
  const Lens lens = read_lens("camera.yaml");
  fs::create_directory(folder / "mrcal");
  fs::copy(folder / "camera.corners.vnl", folder / "mrcal/corners.vnl");
  const std::string vnl = (folder / "mrcal/corners.vnl").string();
  const auto solved = calibrate(vnl, board, std::string("--warp on ") + kSize);
  ASSERT_EQ(solved.exit_code, 0) << solved.errors;
  const Lens here = read_lens("camera.yaml");
  const std::array imager_px{800, 600};
  const auto one = [](const auto&) { return 1; };
  EXPECT_LT(compute_projection_difference(lens, here, imager_px, one)->worst_px, 1e-3);
  EXPECT_EQ(read_calibration(folder / "camera.yaml").intrinsics_report->outliers, 0);
  const IntrinsicsReport report = *read_calibration(folder / "camera.yaml").intrinsics_report;

  if (run_program("command -v mrcal-calibrate-cameras").exit_code != 0) {
    GTEST_SKIP() << "no mrcal-calibrate-cameras here";
  }
  // By chance mrcal's own start has the pose of a view wrong, for one focal length or another.
  constexpr double right_px = 0.1;
  double theirs_px = INFINITY;
  for (const char* focal : {"500", "480", "520", "560", "440", "620"}) {
    const auto mrcal = run_program(
        "cd " + (folder / "mrcal").string() +
        " && rm -f camera-0.cameramodel && mrcal-calibrate-cameras --corners-cache corners.vnl "
        "--corners-cache-has-weights --lensmodel LENSMODEL_OPENCV8 --object-spacing 0.02 "
        "--object-width-n 12 "
        "--object-height-n 10 --imagersize 800 600 --skip-outlier-rejection --outdir . --focal " +
        focal + " '*.png'");
    const std::string before = "## RMS error: ";
    const auto at = mrcal.errors.rfind(before);
    ASSERT_NE(at, std::string::npos) << mrcal.errors;
    theirs_px = std::stod(mrcal.errors.substr(at + before.size()));
    if (theirs_px > right_px) continue;
    ASSERT_EQ(mrcal.exit_code, 0) << mrcal.errors;
    break;
  }
  ASSERT_LT(theirs_px, right_px);
  const Camera found = read_camera_of_any_format(folder / "mrcal/camera-0.cameramodel").camera;
  const Lens theirs(found.lens_model, found.intrinsics);
  EXPECT_LT(compute_projection_difference(theirs, here, imager_px, one)->worst_px, 0.01);
  // mrcal counts the corners that are not seen, too, and its regularization, a tenth of the squares
  // of corners that are known to 0.01 px.
  constexpr double points = 12 * 10;
  const double over =
      theirs_px / (std::sqrt(report.corners / (report.views * points)) * report.rms_px);
  EXPECT_GT(over, 0.999);
  EXPECT_LT(over, 1.06);
}

TEST_F(VlpIntrinsicsCornerFiles, AreRejectedWithLineAndCauseInOneLine) {
  const std::string good = vnl({"0.png", "1.png"});
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = good;
    changed.replace(changed.find(from), from.size(), to);
    return folder.file("corners.vnl", changed).string();
  };
  const std::string file = with("0.png", "0.png");
  EXPECT_THAT(refusal(file, ""),
              HasSubstr("a file of corners has no image size; give --imager-px"));
  EXPECT_THAT(refusal(file + " other.png", kSize), HasSubstr("excludes images; give it alone"));
  EXPECT_THAT(refusal(file, std::string(kSize) + " --corners " + (folder / "a.csv").string()),
              HasSubstr("is a file of corners already; leave --corners out"));
  EXPECT_THAT(
      refusal(file, "--imager-px 120 600"),
      HasSubstr("corners.vnl:3: a corner at (150, 100) is outside an image of 120 x 600 px"));
  EXPECT_THAT(refusal(with("0.png 200 100 0\n", ""), kSize),
              HasSubstr("corners.vnl:2: image '0.png' has 8 rows, but a board of 4 x 4 squares has "
                        "3 x 3 corners"));
  EXPECT_THAT(refusal(with("200 100 0", "nan 100 0"), kSize),
              HasSubstr("corners.vnl:4: 'nan' should be a finite number, or -"));
  EXPECT_THAT(refusal(with("200 100 0", "200"), kSize),
              HasSubstr("corners.vnl:4: should be: filename x y level"));
  EXPECT_THAT(refusal(with("1.png 100 100 0", "0.png 100 100 0\n1.png 100 100 0"), kSize),
              HasSubstr("corners.vnl:2: image '0.png' has 10 rows"));
  EXPECT_THAT(refusal(with("200 100 0", "200 100 99"), kSize), HasSubstr("a level should be"));
  const std::string cut = good.substr(0, good.size() - 3);
  EXPECT_THAT(refusal(folder.file("corners.vnl", cut).string(), kSize), HasSubstr("corners.vnl"));
  EXPECT_THAT(
      refusal(folder.file("corners.vnl", "# filename x y level\n0.png - - -\n").string(), kSize),
      HasSubstr("none of its 1 images has a corner of the board"));
  const std::string twice = vnl({"0.png", "1.png", "0.png"});
  EXPECT_THAT(refusal(folder.file("corners.vnl", twice).string(), kSize),
              HasSubstr("corners.vnl:20: image '0.png' occurs twice"));

  const auto table = [&](const std::string& rows) {
    return folder.file("corners.csv", "image,corner,u_px,v_px\n" + rows).string();
  };
  EXPECT_THAT(refusal(table("0.png,0,5,5\n0.png,0,6,5\n"), kSize),
              HasSubstr("corners.csv:3: corner: 0 occurs twice in image '0.png'"));
  EXPECT_THAT(refusal(table("0.png,9,5,5\n"), kSize), HasSubstr("should be within 0 and 8"));
  EXPECT_THAT(refusal(table("0.png,0,inf,5\n"), kSize), HasSubstr("corners.csv:2: u_px"));
  EXPECT_THAT(refusal(table("0.png,0,801,5\n"), kSize), HasSubstr("outside an image"));
}

/// Tables of chessboards whose sizes are miscounted.
TEST_F(VlpIntrinsicsCornerFiles, MiscountedBoardSizeIsReportedWithCorrection) {
  std::string text = "# filename x y level\n", table = "image,corner,u_px,v_px\n";
  for (int row = 0; row < 5; ++row) {
    for (int col = 0; col < 8; ++col) {
      const std::string u = std::to_string(100 + 50 * col), v = std::to_string(100 + 50 * row);
      text.append("0.png ").append(u).append(" ").append(v).append(" 0\n");
      table.append("0.png,").append(std::to_string(8 * row + col));
      table.append(",").append(u).append(",").append(v).append("\n");
    }
  }
  std::string corners = folder.file("corners.vnl", text).string();
  const auto rejection_message = [&](const std::string& size) {
    const std::string board = folder
                                  .file("board.yaml", "format: vlp-board/1\nkind: chessboard\n" +
                                                          size + "\nsquare_size_m: 0.02\n")
                                  .string();
    const auto result = calibrate(corners, board, kSize);
    return std::to_string(result.exit_code) + " " + result.errors;
  };
  EXPECT_THAT(rejection_message("cols: 8\nrows: 5"),
              HasSubstr("count squares, not the corners between them: cols 9, rows 6"));
  EXPECT_THAT(rejection_message("cols: 6\nrows: 9"),
              HasSubstr("2 vlp-intrinsics: error: " + corners +
                        ":2: the corners lie in rows of 8, but a board of 6 x 9 squares has 5 x 8 "
                        "corners; swap cols and rows"));
  EXPECT_THAT(rejection_message("cols: 9\nrows: 6"), HasSubstr("3 "));  // one view is too few

  corners = folder.file("corners.csv", table).string();
  EXPECT_THAT(rejection_message("cols: 6\nrows: 9"),
              HasSubstr("2 vlp-intrinsics: error: " + corners +
                        ": the corners lie in rows of 8, but a board of 6 x 9 squares has 5 x 8 "
                        "corners; swap cols and rows of board.yaml\n"));
  EXPECT_THAT(rejection_message("cols: 11\nrows: 5"),
              HasSubstr("is board.yaml that of the board?"));
  EXPECT_THAT(rejection_message("cols: 9\nrows: 6"), HasSubstr("3 "));
}

}  // namespace
}  // namespace vlp
