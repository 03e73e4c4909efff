// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// A run of vlp-simulate that ends early leaves whole files, and the next one does the rest.
#include <sys/stat.h>

#include <chrono>

#include "small_simulation.h"
#include "support/random.h"

namespace vlp {
namespace {

using VlpSimulateInterrupted = SmallSimulation;

ino_t file_number(const std::filesystem::path& file) {
  struct stat status {};
  EXPECT_EQ(::stat(file.c_str(), &status), 0) << file;
  return status.st_ino;
}

TEST_F(VlpSimulateInterrupted, RendersOnlyMissingImagesWhenRepeated) {
  const Files expected = undisturbed();
  ASSERT_EQ(simulate().exit_code, 0);
  for (const char* name : {"lamps/0003.png", "lamps/0015.png", "boards/0000.png",
                           "lamps/true_detections.csv", "true_lamps.yaml"}) {
    ASSERT_TRUE(std::filesystem::remove(output / name));
  }
  std::map<std::string, std::pair<ino_t, std::filesystem::file_time_type>> before;
  for (const std::string& image : find_images(files_below(output))) {
    before[image] = {file_number(output / image), last_write_time(output / image)};
  }
  ASSERT_EQ(before.size(), 21U);
  const auto result = simulate();
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_EQ(result.output, "rendered 3 captures, 21 existed; in " + output.string() + "\n");
  EXPECT_TRUE(files_below(output) == expected);
  for (const auto& [image, mark] : before) {
    EXPECT_EQ(file_number(output / image), mark.first) << image;
    EXPECT_EQ(last_write_time(output / image), mark.second) << image;
  }
}

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
