// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics end to end.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "calibration/intrinsics/projection_difference.h"
#include "detection/boards/board_detector.h"
#include "rig/board_layout.h"
#include "rig/calibration.h"
#include "support/program.h"
#include "support/real_data.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const std::string kRig = VLP_SOURCE_DIR "/datasets/paper-rig/rendered";
const std::string kFaulty = VLP_SOURCE_DIR "/datasets/paper-rig-faulty/rendered";

class IntrinsicsProgram : public testing::Test {
 protected:
  ProgramResult calibrate(const std::string& images, const std::string& board,
                          const std::string& options = "") const {
    return run_program("vlp-intrinsics " + images + " --board " + board + " -o " +
                       (folder / "camera.yaml").string() + " " + options);
  }
  std::string content(const char* name) const { return TemporaryFolder::content_of(folder / name); }
  /// The view of the sample, as many times as there are names.
  std::string copies(const std::vector<std::string>& names) const {
    fs::create_directory(folder / "images");
    for (const auto& name : names) {
      fs::copy(kRig + "/sample-boards/0000.png", folder / ("images/" + name));
    }
    return (folder / "images").string();
  }
  const TemporaryFolder folder;
};

class RenderedRig : public IntrinsicsProgram, public testing::WithParamInterface<const char*> {};

TEST_P(RenderedRig, GivesItsLensWhateverTheThreads) {
  const std::string scene = std::string(VLP_SOURCE_DIR "/datasets/") + GetParam() + "/scene.yaml";
  const std::string rig = (folder / "rig").string();
  ASSERT_EQ(run_program("vlp-simulate -q " + scene + " --only boards -o " + rig).exit_code, 0);
  const std::string board = rig + "/board.yaml", cache = (folder / "cache").string();
  const auto first = calibrate(rig + "/boards", board, "--threads 1 --cache " + cache);
  ASSERT_EQ(first.exit_code, 0) << first.errors;
  EXPECT_EQ(first.errors, "");
  EXPECT_THAT(first.output, HasSubstr("views         36 used, 0 dropped"));

  const Camera truth = read_calibration(rig + "/true_calibration.yaml").camera;
  const Calibration found = read_calibration(folder / "camera.yaml");
  const auto difference =
      projection_difference(Lens(truth.lens_model, truth.intrinsics),
                            Lens(found.camera.lens_model, found.camera.intrinsics), truth.imager_px,
                            [](const auto&) { return 1; });
  EXPECT_LT(difference->mean_px, 0.05);
  EXPECT_LT(difference->worst_px, 0.2);
  ASSERT_TRUE(found.intrinsics_report);
  EXPECT_LT(found.intrinsics_report->rms_px, 0.03);  // measured: 0.018 and 0.013
  ASSERT_EQ(found.history.size(), 1U);
  EXPECT_EQ(found.history[0].inputs.size(), 37U);

  // With other threads, and from the cache, byte for byte.
  const std::string yaml = content("camera.yaml"), model = content("camera.cameramodel"),
                    corners = content("camera.corners.vnl");
  EXPECT_THAT(model, HasSubstr("'optimization_inputs': b'"));
  for (const std::string options : {"--threads 3", "--cache "}) {
    const auto again =
        calibrate(rig + "/boards", board, options == "--cache " ? options + cache : options);
    EXPECT_EQ(again.output, first.output);
    EXPECT_EQ(content("camera.yaml"), yaml);
    EXPECT_EQ(content("camera.cameramodel"), model);
    EXPECT_EQ(content("camera.corners.vnl"), corners);
  }
  fs::copy(folder / "camera.cameramodel", folder / "first.cameramodel");
  // Pictures, which change nothing in the calibration, not even its history.
  for (const std::string name : {"plot.png", "plot.svg"}) {
    const auto drawn = calibrate(rig + "/boards", board,
                                 "--cache " + cache + " --plot " + (folder / name).string());
    EXPECT_EQ(drawn.exit_code, 0);
    EXPECT_EQ(drawn.errors, "");  // gnuplot says nothing either
    EXPECT_EQ(content("camera.yaml"), yaml);
  }
  EXPECT_TRUE(content("plot.png").starts_with("\x89PNG"));
  EXPECT_THAT(content("plot.svg"), HasSubstr("standard deviation (px)"));
  // A gate that is not met: everything is written all the same.
  const auto gated = calibrate(rig + "/boards", board,
                               "--gate uncertainty_px=0.001 --held-out 6 --cache " + cache);
  EXPECT_EQ(gated.exit_code, 1);
  EXPECT_THAT(gated.errors, HasSubstr("the gate is 0.001; add views, next the board in the "));
  EXPECT_THAT(gated.output, HasSubstr("held out      6 views"));
  EXPECT_EQ(read_calibration(folder / "camera.yaml").intrinsics_report->views, 30);

  // mrcal's own uncertainty of the model, where mrcal for Python is installed.
  if (run_program("/usr/bin/python3 -c 'import mrcal'").exit_code != 0) return;
  const auto oracle =
      run_program("/usr/bin/python3 -c \"import mrcal, numpy as np; m = mrcal.cameramodel('" +
                  (folder / "first.cameramodel").string() +
                  "'); W, H = m.imagersize(); "
                  "print(max(mrcal.projection_uncertainty(mrcal.unproject(np.array((u, v), float), "
                  "*m.intrinsics()), m, atinfinity = True, what = 'worstdirection-stdev') "
                  "for u in (0, W - 1) for v in (0, H - 1)))\"");
  ASSERT_EQ(oracle.exit_code, 0) << oracle.errors;
  EXPECT_NEAR(std::stod(oracle.output), *found.intrinsics_report->uncertainty_px,
              1e-6 * *found.intrinsics_report->uncertainty_px);
}

INSTANTIATE_TEST_SUITE_P(Scenes, RenderedRig, testing::Values("paper-rig", "paper-rig-faulty"));

TEST_F(IntrinsicsProgram, RefusesOneViewAndViewsAllAlike) {
  const std::string board = kRig + "/board.yaml";
  const auto one = calibrate(copies({"0.png"}), board);
  EXPECT_EQ(one.exit_code, 3);
  EXPECT_THAT(one.errors, HasSubstr("1 views with the board: fewer than three"));
  for (const char* name : {"images/1.png", "images/2.png", "images/3.png", "images/4.png"}) {
    fs::copy(kRig + "/sample-boards/0000.png", folder / name);
  }
  const auto alike = calibrate((folder / "images").string(), board);
  EXPECT_EQ(alike.exit_code, 3);
  EXPECT_THAT(alike.errors, HasSubstr("all views show the board at the same angle"));
  EXPECT_FALSE(fs::exists(folder / "camera.yaml"));
}

TEST_F(IntrinsicsProgram, SaysWhyThereAreNoTags) {
  const std::string board = kRig + "/board.yaml";
  const auto lamps = calibrate(kRig + "/sample", board);
  EXPECT_EQ(lamps.exit_code, 3);
  EXPECT_THAT(lamps.errors, HasSubstr("no tag of tag36h11 is seen in 2 images"));

  const auto other = calibrate(kFaulty + "/sample-boards", board);
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.errors, HasSubstr("border_bits 2, corner_squares true"));

  const cv::Mat image = cv::imread(kRig + "/sample-boards/0000.png", cv::IMREAD_GRAYSCALE);
  cv::Mat mirrored;
  cv::flip(image, mirrored, 1);
  fs::create_directory(folder / "mirrored");
  cv::imwrite((folder / "mirrored/0.png").string(), mirrored);
  const auto mirror = calibrate((folder / "mirrored").string(), board);
  EXPECT_EQ(mirror.exit_code, 2);
  EXPECT_THAT(mirror.errors, HasSubstr("the image is mirrored"));
}

TEST_F(IntrinsicsProgram, NamesWhatIsWrongWithTheBoard) {
  std::string text = TemporaryFolder::content_of(kRig + "/board.yaml");
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    return folder.file("board.yaml", changed).string();
  };
  const std::string images = kRig + "/sample-boards";
  const auto order =
      calibrate(images, with("row-major-from-top-left", "row-major-from-bottom-left"));
  EXPECT_EQ(order.exit_code, 2);
  EXPECT_THAT(order.errors, HasSubstr("board.yaml: the images show cols 6, rows 5, id_order "
                                      "row-major-from-top-left"));
  const auto ids = calibrate(images, with("first_id: 0", "first_id: 100"));
  EXPECT_EQ(ids.exit_code, 2);
  EXPECT_THAT(ids.errors, HasSubstr("with other ids than the board has, 100 to 129"));
  const auto spacing = calibrate(images, with("tag_spacing: 1", "tag_spacing: 0.5"));
  EXPECT_EQ(spacing.exit_code, 2);
  EXPECT_THAT(spacing.errors, HasSubstr("tag_spacing is 0.5, but the images show gaps of "));
}

TEST_F(IntrinsicsProgram, RefusesMixedSizesAndSkipsWhatIsNoImage) {
  const std::string images = copies({"0.png", "1.png"});
  folder.file("images/2.png", "no image\n");
  const auto bad = calibrate(images, kRig + "/board.yaml");
  EXPECT_EQ(bad.exit_code, 3) << bad.errors;
  EXPECT_THAT(bad.errors, HasSubstr("2.png: cannot be read as an image; skipped"));
  const auto only = calibrate((folder / "images/2.png").string(), kRig + "/board.yaml");
  EXPECT_EQ(only.exit_code, 2);
  EXPECT_THAT(only.errors, HasSubstr("none of 1 images can be used"));
  const cv::Mat image = cv::imread(kRig + "/sample-boards/0000.png", cv::IMREAD_GRAYSCALE);
  cv::imwrite((folder / "images/2.png").string(), image(cv::Rect(0, 0, 640, 480)));
  const auto mixed = calibrate(images, kRig + "/board.yaml");
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_THAT(mixed.errors, HasSubstr("2.png: is 640 x 480, but 0.png is 800 x 600 px"));
}

TEST_F(IntrinsicsProgram, RefusesBadOptions) {
  const std::string images = kRig + "/sample-boards", board = kRig + "/board.yaml";
  EXPECT_EQ(calibrate(images, board, "--gate mean=3").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--gate rms_px=no").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--lens FISHEYE").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--plot plot.gif").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--held-out 1").exit_code, 2);
  EXPECT_EQ(calibrate(images + "/missing.png", board).exit_code, 2);
}

TEST_F(IntrinsicsProgram, SaysThatViewsFromTheFrontDoNotFixTheFocalLength) {
  const auto real = real_data("kalibr-aprilgrid-stereo");
  if (real.empty()) GTEST_SKIP() << "no real captures here";
  const auto result = calibrate((real / "cam0").string(), (real / "board.yaml").string());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("uncertainty_px is "));
  const auto report = read_calibration(folder / "camera.yaml").intrinsics_report;
  ASSERT_TRUE(report);
  EXPECT_EQ(report->views, 16);
  EXPECT_LT(report->rms_px, 0.32);  // Kalibr's own, per axis: 0.38 and 0.32
}

TEST_F(IntrinsicsProgram, FitsAPhonesImagesAsWellAsOthers) {
  const auto real = real_data("apriltag-lattice-phone");
  if (real.empty()) GTEST_SKIP() << "no real captures here";
  const auto result = calibrate(real.string(), (real / "board.yaml").string());
  EXPECT_EQ(result.exit_code, 1) << "eight views leave the image's corners open";
  const Calibration found = read_calibration(folder / "camera.yaml");
  EXPECT_LT(found.intrinsics_report->rms_px, 0.735 / std::sqrt(2));  // OpenCV's, 2-D
  EXPECT_NEAR(found.camera.intrinsics[0], 3196.9, 25);               // MATLAB's
}

class BoardProgram : public testing::Test {
 protected:
  const TemporaryFolder folder;
};

TEST_F(BoardProgram, MakesWhatItSays) {
  const std::string pdf = (folder / "board.pdf").string();
  ASSERT_EQ(run_program("vlp-board --kalibr --tag-mm 30 --paper A3 -o " + pdf).exit_code, 0);
  const std::string bytes = TemporaryFolder::content_of(pdf);
  EXPECT_TRUE(bytes.starts_with("%PDF-"));
  const Board board = read_board(folder / "board.yaml");
  EXPECT_EQ(board.tag_size_m, 0.03);
  EXPECT_EQ(board.border_bits, 2);
  EXPECT_TRUE(board.corner_squares);
  ASSERT_EQ(run_program("vlp-board --kalibr --tag-mm 30 --paper A3 -o " + pdf).exit_code, 0);
  EXPECT_EQ(TemporaryFolder::content_of(pdf), bytes);
}

TEST_F(BoardProgram, IsTrueToScale) {
  if (run_program("command -v pdftoppm").exit_code != 0) GTEST_SKIP() << "no pdftoppm here";
  const std::string pdf = (folder / "board.pdf").string();
  ASSERT_EQ(run_program("vlp-board -o " + pdf).exit_code, 0);
  constexpr double px_per_mm = 10;  // 254 dpi
  ASSERT_EQ(run_program("pdftoppm -r 254 -gray -singlefile -png " + pdf + " " +
                        (folder / "page").string())
                .exit_code,
            0);
  const cv::Mat page = cv::imread((folder / "page.png").string(), cv::IMREAD_GRAYSCALE);
  EXPECT_NEAR(page.cols, 297 * px_per_mm, 2);
  const Board board = read_board(folder / "board.yaml");
  const SeenBoard seen = BoardDetector(board).detect(page);
  ASSERT_EQ(seen.tags.size(), 30U);
  const double width_px = (seen.tags[5].corners_px[2] - seen.tags[0].corners_px[3]).norm();
  EXPECT_NEAR(width_px / px_per_mm / 1000, tag_field_m(board).x(), 1e-4);
}

TEST_F(BoardProgram, RefusesWhatDoesNotFit) {
  const std::string output = " -o " + (folder / "board.pdf").string();
  const auto large = run_program("vlp-board --tag-mm 50" + output);
  EXPECT_EQ(large.exit_code, 2);
  EXPECT_THAT(large.errors, HasSubstr("does not fit on A4"));
  EXPECT_EQ(run_program("vlp-board --paper B5" + output).exit_code, 2);
  EXPECT_EQ(run_program("vlp-board --first-id 580" + output).exit_code, 2);
  EXPECT_FALSE(fs::exists(folder / "board.pdf"));
}

}  // namespace
}  // namespace vlp
