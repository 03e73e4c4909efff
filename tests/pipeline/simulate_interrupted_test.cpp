// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A run of vlp-simulate that ends early leaves whole files, and the next one does the rest.

#include <chrono>

#include "small_simulation.h"
#include "support/random.h"

namespace vlp {
namespace {

using VlpSimulateInterrupted = SmallSimulation;

TEST_F(VlpSimulateInterrupted, LeavesOnlyCompleteFilesWhenKilledAndResumes) {
  const Files expected = undisturbed();
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_EQ(simulate("--threads 2").exit_code, 0);
  const std::chrono::duration<double> run_time = std::chrono::steady_clock::now() - begin;

  Random random(1);
  int incomplete = 0, begun = 0;
  constexpr int min_kills = 20, max_kills = 200;  // on a busy machine few come between two images
  for (int i = 0; i < min_kills || (begun == 0 && i < max_kills); ++i) {
    std::filesystem::remove_all(output);
    const double wait_s = random.uniform(0, 1.1 * run_time.count());
    SCOPED_TRACE(wait_s);
    run_program("(exec " + command("-q --threads 2") + ") & sleep " + std::to_string(wait_s) +
                "; kill -9 $! 2>&-; wait");
    if (std::filesystem::exists(output)) {
      const Files left = files_below(output);
      for (const auto& [name, content] : left) {
        ASSERT_TRUE(expected.contains(name)) << name;
        ASSERT_TRUE(content == expected.at(name)) << name;
      }
      incomplete += left.size() < expected.size() ? 1 : 0;
      begun += find_images(left).empty() ? 0 : 1;
    }
    const auto result = simulate("--threads 2");
    ASSERT_EQ(result.exit_code, 0) << result.errors;
    ASSERT_TRUE(files_below(output) == expected);
  }
  EXPECT_GT(incomplete, 0) << "no kill came in time";
  EXPECT_GT(begun, 0) << "no run came to its first image";
}

}  // namespace
}  // namespace vlp
