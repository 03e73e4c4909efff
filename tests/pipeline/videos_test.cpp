// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Videos as input of vlp-detect, against the images that they were made of.
#include <gmock/gmock.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "captures/captures_table.h"
#include "frontend/image_file.h"
#include "pipeline/intrinsics_program.h"
#include "support/datasets.h"
#include "support/write_video.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// Writes a video of the images in a folder, each repeated `times` times. Returns false on failure.
bool write_video_of_folder(const fs::path& file, const fs::path& folder, int times,
                           const char* codec = "FFV1") {
  std::vector<cv::Mat> frames;
  for (const auto& image : list_images(folder)) {
    for (int i = 0; i < times; ++i) frames.push_back(read_image(image));
  }
  return write_video(file, frames, codec);
}

/// The text with every `from` replaced.
std::string with(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

class VlpDetectVideo : public testing::Test {
 protected:
  ProgramResult detect(const std::string& images, const std::string& output,
                       const std::string& options = "") const {
    return run_program("vlp-detect '" + images + "' --lamps " + kRig +
                       "/lamps.yaml --calibration " + kRig + "/true_calibration.yaml -o " +
                       (folder / output).string() + " " + options);
  }
  const TemporaryFolder folder;
};

TEST_F(VlpDetectVideo, YieldsSameDetectionsAsImages) {
  const std::string film = (folder / "drive.avi").string();
  if (!write_video_of_folder(film, kRig + "/sample", 1)) GTEST_SKIP() << "OpenCV writes no FFV1";
  ASSERT_EQ(detect(kRig + "/sample", "images.csv").exit_code, 0);
  const auto found = detect(film, "film.csv",
                            "--annotate " + (folder / "pictures").string() + " --captures " +
                                (folder / "captures.csv").string());
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  EXPECT_EQ(found.errors, "");
  EXPECT_THAT(found.output, HasSubstr("images      2\n"));
  const std::string table = TemporaryFolder::read_content(folder / "film.csv");
  EXPECT_EQ(with(with(table, "drive.avi#000000", "0000.png"), "drive.avi#000001", "0001.png"),
            TemporaryFolder::read_content(folder / "images.csv"));
  EXPECT_TRUE(fs::exists(folder / "pictures/drive.avi#000001.png"));
  EXPECT_NEAR(*read_captures_csv(folder / "captures.csv").at("drive.avi#000001").time_s, 0.05,
              1e-9);
  // Both go on to the fixes.
  const auto located = run_program("vlp-locate " + (folder / "film.csv").string() + " --captures " +
                                   (folder / "captures.csv").string() + " --lamps " + kRig +
                                   "/lamps.yaml --calibration " + kRig +
                                   "/true_calibration.yaml -o " + (folder / "fixes.csv").string());
  EXPECT_EQ(located.exit_code, 0) << located.errors;
  EXPECT_THAT(TemporaryFolder::read_content(folder / "fixes.csv"),
              HasSubstr("drive.avi#000001,ok"));

  ASSERT_EQ(detect(film, "first.csv", "--every 2").exit_code, 0);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "first.csv"),
              Not(HasSubstr("drive.avi#000001")));
}

}  // namespace
}  // namespace vlp
