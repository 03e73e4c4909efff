// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics on images and boards that it cannot use.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/intrinsics_program.h"
#include "support/datasets.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::string kFaulty = VLP_SOURCE_DIR "/datasets/paper-rig-faulty/rendered";

class VlpIntrinsicsErrors : public VlpIntrinsics {
 protected:
  /// The view of the sample, as many times as there are names.
  std::string copies(const std::vector<std::string>& names) const {
    fs::create_directory(folder / "images");
    for (const auto& name : names) {
      fs::copy(kRig + "/sample-boards/0000.png", folder / ("images/" + name));
    }
    return (folder / "images").string();
  }
};

TEST_F(VlpIntrinsicsErrors, RejectsOneViewAndIdenticalViews) {
  const std::string board = kRig + "/board.yaml";
  const auto one = calibrate(copies({"0.png"}), board);
  EXPECT_EQ(one.exit_code, 3);
  EXPECT_THAT(one.errors, HasSubstr("1 views with the board: fewer than three"));
  for (const char* name : {"images/1.png", "images/2.png", "images/3.png", "images/4.png"}) {
    fs::copy(kRig + "/sample-boards/0000.png", folder / name);
  }
  const auto alike = calibrate((folder / "images").string(), board);
  EXPECT_EQ(alike.exit_code, 3);
  EXPECT_THAT(alike.errors, HasSubstr("1.png: is the same image as 0.png; skipped"));
  EXPECT_THAT(alike.errors, HasSubstr("1 views with the board: fewer than three"));
  EXPECT_FALSE(fs::exists(folder / "camera.yaml"));
}

TEST_F(VlpIntrinsicsErrors, RejectsTwoOutputsInOneFile) {
  const std::string images = copies({"0.png"}), board = kRig + "/board.yaml";
  const auto rejection_message = [&](const std::string& ros, const std::string& kalibr) {
    const auto result = calibrate(images, board,
                                  "--lens LENSMODEL_OPENCV4 --ros " + (folder / ros).string() +
                                      " --kalibr " + (folder / kalibr).string());
    EXPECT_EQ(result.exit_code, 2);
    return result.errors;
  };
  EXPECT_THAT(rejection_message("a.yaml", "./a.yaml"),
              HasSubstr("--ros and --kalibr are the same file"));
  EXPECT_THAT(rejection_message("images/../camera.yaml", "a.yaml"),
              HasSubstr("--output and --ros are the same file"));
  EXPECT_THAT(rejection_message("a.yaml", "camera.cameramodel"),
              HasSubstr("--output's .cameramodel and --kalibr are the same file"));
}

TEST_F(VlpIntrinsicsErrors, ErrorNamesCauseOfUndetectedTags) {
  const std::string board = kRig + "/board.yaml";
  const auto lamps = calibrate(kRig + "/sample", board);
  EXPECT_EQ(lamps.exit_code, 3);
  EXPECT_THAT(lamps.errors, HasSubstr("no tag of tag36h11 is visible in 2 images"));

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

TEST_F(VlpIntrinsicsErrors, ErrorNamesWrongKeyOfBoardFile) {
  std::string text = TemporaryFolder::read_content(kRig + "/board.yaml");
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
  const auto cols = calibrate(images, with("cols: 6", "cols: 5"));
  EXPECT_EQ(cols.exit_code, 2);
  EXPECT_THAT(cols.errors, HasSubstr("board.yaml: the images show cols 6, rows 5"));
  const auto ids = calibrate(images, with("first_id: 0", "first_id: 100"));
  EXPECT_EQ(ids.exit_code, 2);
  EXPECT_THAT(ids.errors, HasSubstr("with other ids than those of the board, 100 to 129"));
  const auto spacing = calibrate(images, with("tag_spacing: 1", "tag_spacing: 0.5"));
  EXPECT_EQ(spacing.exit_code, 2);
  EXPECT_THAT(spacing.errors, HasSubstr("tag_spacing is 0.5, but the images show gaps of "));
}

TEST_F(VlpIntrinsicsErrors, ErrorStatesDetectedIdOrderOfSquareKalibrBoard) {
  std::string scene =
      TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/paper-rig-faulty/scene.yaml");
  const std::string rows = "rows: 5,";
  scene.replace(scene.find(rows), rows.size(), "rows: 6,");
  const std::string file = folder.file("scene.yaml", scene).string();
  const std::string rig = (folder / "rig").string();
  ASSERT_EQ(run_program("vlp-simulate -q " + file + " --only sample-boards -o " + rig).exit_code,
            0);
  const std::string board = TemporaryFolder::read_content(rig + "/board.yaml");
  const std::string right = "row-major-from-bottom-left";
  for (const char* wrong : {"row-major-from-top-left", "row-major-from-bottom-right",
                            "column-major-from-top-left", "column-major-from-bottom-right"}) {
    std::string changed = board;
    changed.replace(changed.find(right), right.size(), wrong);
    const auto result =
        calibrate(rig + "/sample-boards", folder.file("board.yaml", changed).string());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.errors,
                HasSubstr("board.yaml: the images show cols 6, rows 6, id_order " + right));
  }
}

TEST_F(VlpIntrinsicsErrors, SkipsInvalidImagesAndOtherSizes) {
  const std::string images = copies({"0.png", "1.png"});
  folder.file("images/2.png", "no image\n");
  const auto bad = calibrate(images, kRig + "/board.yaml");
  EXPECT_EQ(bad.exit_code, 3) << bad.errors;
  EXPECT_THAT(bad.errors, HasSubstr("2.png: cannot be read as an image: it is not PNG"));
  const auto only = calibrate((folder / "images/2.png").string(), kRig + "/board.yaml");
  EXPECT_EQ(only.exit_code, 2);
  EXPECT_THAT(only.errors, HasSubstr("none of its 1 images can be used"));
  const cv::Mat image = cv::imread(kRig + "/sample-boards/0000.png", cv::IMREAD_GRAYSCALE);
  cv::imwrite((folder / "images/2.png").string(), image(cv::Rect(0, 0, 640, 480)));
  const auto mixed = calibrate(images, kRig + "/board.yaml");
  EXPECT_EQ(mixed.exit_code, 3) << "one view is left";
  EXPECT_THAT(mixed.errors,
              HasSubstr("2.png: is 640 x 480 px, the camera's images are 800 x 600 px; skipped"));
}

TEST_F(VlpIntrinsicsErrors, RejectsKalibrFormatForOpencv8LensAndWritesNoOutput) {
  const std::string kalibr = (folder / "kalibr.yaml").string();
  const auto result =
      calibrate(kRig + "/sample-boards", kRig + "/board.yaml", "--kalibr " + kalibr);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.errors, HasSubstr("Kalibr has no lens model like LENSMODEL_OPENCV8"));
  EXPECT_FALSE(fs::exists(folder / "camera.yaml"));
  EXPECT_FALSE(fs::exists(kalibr));
}

TEST_F(VlpIntrinsicsErrors, SkipsTinyAndHugeImages) {
  const std::string images = copies({"0.png"});
  cv::imwrite((folder / "images/1.png").string(), cv::Mat(600, 801, CV_8UC1, cv::Scalar(7)));
  cv::imwrite((folder / "images/2.png").string(), cv::Mat(1, 800, CV_8UC1, cv::Scalar(7)));
  const auto huge = calibrate(images, kRig + "/board.yaml", "--max-mpx 0.4802");
  EXPECT_EQ(huge.exit_code, 3) << "one view is left";
  EXPECT_THAT(huge.errors, HasSubstr("1.png: is 801 x 600 px, more than the 0.4802 million"));
  EXPECT_THAT(huge.errors,
              HasSubstr("2.png: is 800 x 1 px, the camera's images are 800 x 600 px; skipped"));
  fs::create_directory(folder / "tiny");
  cv::imwrite((folder / "tiny/0.png").string(), cv::Mat(1, 800, CV_8UC1, cv::Scalar(7)));
  const auto tiny = calibrate((folder / "tiny").string(), kRig + "/board.yaml");
  EXPECT_EQ(tiny.exit_code, 3) << tiny.errors;
  EXPECT_THAT(tiny.errors, HasSubstr("no tag of tag36h11 is visible in 1 images"));
}

TEST_F(VlpIntrinsicsErrors, ErrorNamesOverexposureForWashedOutTags) {
  cv::Mat image = cv::imread(kFaulty + "/sample-boards/0000.png", cv::IMREAD_GRAYSCALE), white;
  // White runs over all but the middles of what is black.
  cv::dilate(image, white, cv::getStructuringElement(cv::MORPH_ELLIPSE, {5, 5}));
  fs::create_directory(folder / "white");
  cv::imwrite((folder / "white/0.png").string(), white * 3);
  const auto result = calibrate((folder / "white").string(), kFaulty + "/board.yaml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.errors, HasSubstr("overexposed"));
}

TEST_F(VlpIntrinsicsErrors, ErrorAdvisesLessExposureForSaturatedBoards) {
  const std::string text =
      TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/paper-rig-faulty/scene.yaml");
  const std::string usual = "folder: boards\n    exposure_s: 0.004\n    views: {count: 36,";
  const auto at = text.find(usual);
  ASSERT_NE(at, std::string::npos);
  // Ten and forty times white: of some tags enough is left to see them, and of none.
  for (const std::string exposure : {"0.05", "0.2"}) {
    std::string scene = text;
    scene.replace(at, usual.size(),
                  "folder: boards\n    exposure_s: " + exposure + "\n    views: {count: 3,");
    const std::string file = folder.file("scene.yaml", scene).string();
    const std::string rig = (folder / ("rig" + exposure)).string();
    ASSERT_EQ(run_program("vlp-simulate -q " + file + " --only boards -o " + rig).exit_code, 0);
    const auto result = calibrate(rig + "/boards", rig + "/board.yaml");
    EXPECT_EQ(result.exit_code, 3);
    const std::string error = result.errors.substr(result.errors.find("error: "));
    EXPECT_THAT(error, HasSubstr("overexposed"));
    EXPECT_THAT(error, testing::AnyOf(HasSubstr("expose shorter"), HasSubstr("less exposure")));
    EXPECT_THAT(result.errors, Not(HasSubstr("border_bits")));
  }
}

TEST_F(VlpIntrinsicsErrors, ReturnsTwoForInvalidOptionValues) {
  const std::string images = kRig + "/sample-boards", board = kRig + "/board.yaml";
  EXPECT_EQ(calibrate(images, board, "--gate mean=3").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--gate rms_px=no").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--lens FISHEYE").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--plot plot.gif").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--held-out 1").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--warp maybe").exit_code, 2);
  EXPECT_EQ(calibrate(images, board, "--gate rms_px=1,views=no").exit_code, 2);
  EXPECT_EQ(calibrate(images + "/missing.png", board).exit_code, 2);
}

}  // namespace
}  // namespace vlp
