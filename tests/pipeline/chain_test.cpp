// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// scripts/calibrate.sh: the whole chain, from a folder of images to a verdict.
#include <gmock/gmock.h>

#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Chain : public testing::Test {
 protected:
  void SetUp() override {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "hundreds of images; the programs' own tests run under the sanitizers";
#endif
  }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  /// Captures of a rig, without its lines.
  void render(const std::string& rig) const {
    const auto result = run_program("vlp-simulate -q " VLP_SOURCE_DIR "/datasets/" + rig +
                                    "/scene.yaml --only boards,rotation,dispersion,check -o " +
                                    path("station"));
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  ProgramResult calibrate(const std::string& options = "") const {
    return run_program("VLP_BIN=" VLP_PROGRAMS_DIR " " VLP_SOURCE_DIR "/scripts/calibrate.sh " +
                       path("station") + " " + options);
  }
  const TemporaryFolder folder;
};

class Accuracy : public Chain, public testing::WithParamInterface<const char*> {};

/// The gates are 1.5 times what was measured when they were written.
TEST_P(Accuracy, KeepsToItsGates) {
  render(GetParam());
  fs::copy(std::string(VLP_SOURCE_DIR "/datasets/") + GetParam() + "/gates.yaml",
           folder / "station/gates.yaml");
  const auto result = calibrate("--row-time-s 3e-5 --readout rows");
  EXPECT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_TRUE(fs::exists(folder / "station/results/report.html"));
}

INSTANTIATE_TEST_SUITE_P(Rigs, Accuracy, testing::Values("paper-rig", "paper-rig-faulty"));

}  // namespace
}  // namespace vlp
