// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics on similar views: they add no information and must not make a gate pass.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/intrinsics_program.h"
#include "support/datasets.h"
#include "support/random.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

const std::string kSample = kRig + "/sample-boards/0000.png";

class VlpIntrinsicsSimilarViews : public VlpIntrinsics {
 protected:
  VlpIntrinsicsSimilarViews() { fs::create_directory(images()); }
  fs::path images() const { return folder / "images"; }

  /// Views of the rig, all over the image.
  void render(int count) const {
    std::string scene =
        TemporaryFolder::read_content(VLP_SOURCE_DIR "/datasets/paper-rig/scene.yaml");
    const std::string usual = "views: {count: 36,";
    scene.replace(scene.find(usual), usual.size(), "views: {count: " + std::to_string(count) + ",");
    const std::string file = folder.file("scene.yaml", scene).string();
    const std::string rig = (folder / "rig").string();
    ASSERT_EQ(run_program("vlp-simulate -q " + file + " --only boards -o " + rig).exit_code, 0);
    for (const auto& entry : fs::directory_iterator(rig + "/boards")) {
      if (entry.path().extension() == ".png") fs::copy(entry.path(), images());
    }
  }
  ProgramResult calibrate_images(const std::string& options = "") const {
    return calibrate(images().string(), kRig + "/board.yaml", options);
  }
};

/// The board far away in a corner of the image, by a hand that trembles.
TEST_F(VlpIntrinsicsSimilarViews, CountAsOneWhenBoardMovesByFewPixels) {
  constexpr int count = 30;
  constexpr double size = 0.5, reach_px = 3, noise_dn = 2;
  const cv::Mat sample = cv::imread(kSample, cv::IMREAD_GRAYSCALE);
  Random random(3);
  for (int i = 0; i < count; ++i) {
    const double turn = random.uniform(-0.004, 0.004);
    const double u = random.uniform(0, reach_px), v = random.uniform(0, reach_px);
    const cv::Mat to_corner =
        (cv::Mat_<double>(2, 3) << size, -size * turn, u, size * turn, size, v);
    cv::Mat image(sample.size(), CV_8UC1), noise(sample.size(), CV_16SC1), noisy;
    cv::warpAffine(sample, image, to_corner, sample.size(), cv::INTER_AREA, cv::BORDER_CONSTANT,
                   sample.at<unsigned char>(0, 0));
    cv::RNG(static_cast<std::uint64_t>(i) + 1).fill(noise, cv::RNG::NORMAL, 0, noise_dn);
    cv::add(image, noise, noisy, cv::noArray(), CV_8U);
    cv::imwrite((images() / (std::to_string(10 + i) + ".png")).string(), noisy);
  }
  const auto result = calibrate_images();
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.errors,
              HasSubstr("39.png: shows the same view as 10.png: views count once; skipped"));
  EXPECT_THAT(result.errors, HasSubstr("1 views with the board: fewer than three"));
}

TEST_F(VlpIntrinsicsSimilarViews, CountAsOneWhenSavedAgainAsJpeg) {
  fs::copy(kSample, images() / "0.png");
  cv::imwrite((images() / "1.jpg").string(), cv::imread(kSample, cv::IMREAD_GRAYSCALE),
              {cv::IMWRITE_JPEG_QUALITY, 85});
  const auto result = calibrate_images();
  EXPECT_EQ(result.exit_code, 3) << result.output;
  EXPECT_THAT(result.errors,
              HasSubstr("1.jpg: shows the same view as 0.png: views count once; skipped"));
  EXPECT_THAT(result.errors, HasSubstr("1 views with the board: fewer than three"));
}

TEST_F(VlpIntrinsicsSimilarViews, CopiedFilesDoNotPassGateOnNumberOfViews) {
  render(5);
  const auto once = calibrate_images();
  EXPECT_EQ(once.exit_code, 1);
  EXPECT_THAT(once.errors, HasSubstr("views is 5, at least 6 is required"));
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(images())) files.push_back(entry.path());
  for (const fs::path& file : files) {
    fs::copy(file, images() / ("copy-of-" + file.filename().string()));
  }
  const auto twice = calibrate_images();
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_EQ(twice.output, once.output);
  EXPECT_THAT(twice.errors, HasSubstr("copy-of-0004.png: is the same image as 0004.png"));
  const auto find_failed_gates = [](const std::string& errors) {
    return errors.substr(errors.find("views is"));
  };
  EXPECT_EQ(find_failed_gates(twice.errors), find_failed_gates(once.errors));

  // Two gates at once are both taken.
  const auto changed = calibrate_images("--gate rms_px=1e-4,views=3");
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.errors, HasSubstr("at most 0.0001 px is required"));
  EXPECT_THAT(changed.errors, Not(HasSubstr("views is")));
}

}  // namespace
}  // namespace vlp
