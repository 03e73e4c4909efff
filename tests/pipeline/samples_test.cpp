// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// The rendered samples in datasets/ are what the program makes of their scenes, and those of lamps
/// that are plain discs are located.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

struct Sample {
  const char* scene;
  double mean_mm;  // of the fixes' horizontal errors, 1.5 times what it was when this was written
};

void PrintTo(const Sample& sample, std::ostream* to) { *to << sample.scene; }

std::string test_name(std::string scene) {
  std::erase(scene, '-');
  return scene;
}

class RenderedSamples : public testing::TestWithParam<const char*> {
 protected:
  const fs::path dataset = fs::path(VLP_SOURCE_DIR "/datasets") / GetParam();
  const TemporaryFolder folder;
};

class RenderedSamplesOfDiscs : public testing::TestWithParam<Sample> {
 protected:
  const fs::path dataset = fs::path(VLP_SOURCE_DIR "/datasets") / GetParam().scene;
  const TemporaryFolder folder;
};

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

TEST_P(RenderedSamples, VlpSimulateReproducesCommittedFiles) {
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
    const fs::path ending = entry.path().extension();
    if (ending == ".png" || ending == ".jpg") {
      expect_same_picture(entry, rendered);
      ++images;
    } else {
      EXPECT_EQ(TemporaryFolder::read_content(rendered), TemporaryFolder::read_content(entry));
    }
  }
  EXPECT_GE(images, 1);
}

/// As committed: what another system renders is not asked here.
TEST_P(RenderedSamplesOfDiscs, VlpLocateFixesHaveMeanErrorBelowLimit) {
  const std::string rendered = (dataset / "rendered").string();
  const std::string fixes = (folder / "fixes.csv").string();
  const auto located =
      run_program("vlp-locate -q " + rendered + "/sample --lamps " + rendered +
                  "/lamps.yaml --calibration " + rendered + "/true_calibration.yaml -o " + fixes);
  ASSERT_EQ(located.exit_code, 0) << located.errors;
  const auto result =
      run_program("vlp-evaluate " + fixes + " --truth " + rendered + "/sample/truth.csv --gate " +
                  "missing_fraction=0,mean_mm=" + std::to_string(GetParam().mean_mm));
  EXPECT_EQ(result.exit_code, 0) << result.output << result.errors;
}

INSTANTIATE_TEST_SUITE_P(Scenes, RenderedSamples,
                         testing::Values("paper-rig", "paper-rig-faulty", "clutter", "wide",
                                         "downlights"),
                         [](const auto& instance) { return test_name(instance.param); });

INSTANTIATE_TEST_SUITE_P(Scenes, RenderedSamplesOfDiscs,
                         testing::Values(Sample{"paper-rig", 0.038},
                                         Sample{"paper-rig-faulty", 0.33}, Sample{"clutter", 0.085},
                                         Sample{"wide", 0.048}),
                         [](const auto& instance) { return test_name(instance.param.scene); });

}  // namespace
}  // namespace vlp
