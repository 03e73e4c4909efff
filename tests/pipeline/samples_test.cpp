// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The rendered samples in datasets/ are what the program makes of their scenes.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

class Samples : public testing::TestWithParam<const char*> {};

/// Another processor may round another way, so the noise may differ; the picture may not.
void expect_same_picture(const fs::path& committed, const fs::path& rendered) {
  const cv::Mat expected = cv::imread(committed.string(), cv::IMREAD_UNCHANGED);
  const cv::Mat found = cv::imread(rendered.string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(found.size(), expected.size());
  ASSERT_EQ(found.type(), expected.type());
  double brightest = 0;
  cv::minMaxLoc(expected, nullptr, &brightest);
  const double rms =
      cv::norm(found, expected, cv::NORM_L2) / std::sqrt(static_cast<double>(expected.total()));
  EXPECT_LT(rms, 0.01 * brightest) << committed;
}

TEST_P(Samples, AreWhatTheSceneGives) {
  const fs::path dataset = fs::path(VLP_SOURCE_DIR "/datasets") / GetParam();
  const TemporaryFolder folder;
  std::string only;
  for (const fs::directory_entry& entry : fs::directory_iterator(dataset / "rendered")) {
    if (entry.is_directory()) only += (only.empty() ? "" : ",") + entry.path().filename().string();
  }
  const auto result = run_program("vlp-simulate -q " + (dataset / "scene.yaml").string() +
                                  " --only " + only + " -o " + (folder / "rendered").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  int images = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(dataset / "rendered")) {
    if (entry.is_directory()) continue;
    const fs::path rendered = folder / "rendered" / fs::relative(entry, dataset / "rendered");
    if (entry.path().extension() == ".png") {
      expect_same_picture(entry, rendered);
      ++images;
    } else {
      EXPECT_EQ(TemporaryFolder::content_of(rendered), TemporaryFolder::content_of(entry));
    }
  }
  EXPECT_GE(images, 1);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Samples,
                         testing::Values("paper-rig", "paper-rig-faulty", "clutter", "wide"),
                         [](const auto& instance) {
                           std::string name = instance.param;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace vlp
