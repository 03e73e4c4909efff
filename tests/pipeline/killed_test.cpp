// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A program killed at any moment leaves the old output or the new one, whole.
#include <gtest/gtest.h>

#include <chrono>

#include "support/program.h"
#include "support/random.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(VlpLocateOutput, IsCompleteOldOrNewFileAfterKill) {
  const TemporaryFolder folder;
  const std::string example = VLP_SOURCE_DIR "/datasets/example/";
  // The example many times over, so that writing takes a while.
  std::string detections = TemporaryFolder::read_content(example + "detections.csv");
  const std::string header = detections.substr(0, detections.find('\n') + 1);
  const std::string rows = detections.substr(header.size());
  std::string many = header;
  for (int copy = 0; copy < 100; ++copy) {
    std::string renamed = rows;
    for (auto at = renamed.find("spot_"); at != std::string::npos; at = renamed.find("spot_", at)) {
      renamed.replace(at, 5, "copy" + std::to_string(copy) + "_");
    }
    many += renamed;
  }
  const auto large = folder.file("large.csv", many);
  const auto locate = [&](const std::filesystem::path& input, const std::filesystem::path& output) {
    return "exec vlp-locate -q " + input.string() + " --lamps " + example +
           "lamps.yaml --calibration " + example + "calibration.yaml -o " + output.string();
  };
  ASSERT_EQ(run_program(locate(example + "detections.csv", folder / "old.csv")).exit_code, 0);
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(run_program(locate(large, folder / "new.csv")).exit_code, 0);
  const std::chrono::duration<double> run_time = std::chrono::steady_clock::now() - begin;
  const std::string old_content = TemporaryFolder::read_content(folder / "old.csv");
  const std::string new_content = TemporaryFolder::read_content(folder / "new.csv");

  Random random(1);
  int left_old = 0, left_new = 0;
  for (int i = 0; i < 60; ++i) {
    const auto output = folder.file("fixes.csv", old_content);
    const double wait_s = random.uniform(0, 2 * run_time.count());
    run_program("(" + locate(large, output) + ") & sleep " + std::to_string(wait_s) +
                "; kill -9 $! 2>&-; wait");
    const std::string content = TemporaryFolder::read_content(output);
    ASSERT_TRUE(content == old_content || content == new_content) << "after " << wait_s << " s";
    ++(content == old_content ? left_old : left_new);
  }
  EXPECT_GT(left_old, 0) << "no kill came in time";
  EXPECT_GT(left_new, 0) << "no run came to its end";
}

}  // namespace
}  // namespace vlp
