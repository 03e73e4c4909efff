// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// scripts/fetch_recordings.sh with local repositories in place of those on GitHub, when the real
/// captures are there.
#include <gmock/gmock.h>

#include <filesystem>

#include "support/program.h"
#include "support/real_data.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FetchRecordings : public testing::Test {
 protected:
  const fs::path mocap = real_data("aprilgrid-mocap"), fisheye = real_data("chessboard-fisheye"),
                 led = real_data("led-1khz-frame");
  const TemporaryFolder folder;
  const fs::path hub = folder / "hub", recordings = folder / "recordings";

  void SetUp() override {
    if (mocap.empty() || fisheye.empty() || led.empty()) {
      GTEST_SKIP() << "no real captures: set VLP_REAL_DATA_DIR";
    }
    const std::string data = "chutsu/yac/yac/tests/test_data/mocap_data/";
    copy(mocap / "images", data + "cam0/data");
    copy(mocap / "LICENSE", "chutsu/yac/LICENSE");
    copy(mocap / "body.csv", data + "body0/data.csv");
    // A pose between the images, which is left out.
    ASSERT_EQ(run_program("echo 1606154170382315397,0,0,0,0,0,0,1 >>'" +
                          (hub / data / "body0/data.csv").string() + "'")
                  .exit_code,
              0);
    copy(fisheye, "lessthanoptimal/BoofCV-Data/example/calibration/fisheye/chessboard");
    copy(led / "frame_example.png", "gyroflow/rollingshutter/images/frame_example.png");
    commit("chutsu/yac", "3f326b5");
    commit("lessthanoptimal/BoofCV-Data", "cc6d8ad");
    commit("gyroflow/rollingshutter", "92a6459");
  }

  void copy(const fs::path& from, const std::string& to) const {
    fs::create_directories((hub / to).parent_path());
    fs::copy(from, hub / to, fs::copy_options::recursive);
    ASSERT_EQ(run_program("chmod -R u+w '" + (hub / to).string() + "'").exit_code, 0);
  }
  /// Commits all files of a repository, and names the commit as the script does.
  void commit(const std::string& repository, const std::string& name) const {
    const auto result = run_program(
        "cd '" + (hub / repository).string() +
        "' && git init --quiet && git add --all && git -c user.name=a -c user.email=a@a commit "
        "--quiet --message=x && git tag " +
        name);
    ASSERT_EQ(result.exit_code, 0) << result.errors;
  }
  ProgramResult fetch() const {
    return run_program(
        "GIT_CONFIG_COUNT=1 GIT_CONFIG_VALUE_0=https://github.com/ "
        "GIT_CONFIG_KEY_0='url.file://" +
        hub.string() + "/.insteadOf' '" VLP_SOURCE_DIR "/scripts/fetch_recordings.sh' '" +
        recordings.string() + "'");
  }
};

TEST_F(FetchRecordings, WritesFoldersOfTutorialAndDetectsChangedFile) {
  const auto result = fetch();
  ASSERT_EQ(result.exit_code, 0) << result.errors;
  const auto read = [](const fs::path& file) { return TemporaryFolder::read_content(file); };
  EXPECT_EQ(read(recordings / "aprilgrid-mocap/body.csv"), read(mocap / "body.csv"));
  for (const char* file : {"aprilgrid-mocap/board.yaml", "aprilgrid-mocap/LICENSE",
                           "chessboard-fisheye/board.yaml", "led-1khz-frame/lamps.yaml"}) {
    EXPECT_TRUE(fs::exists(recordings / file)) << file;
  }

  fs::remove_all(hub);  // existing folders are not fetched again
  EXPECT_EQ(fetch().exit_code, 0);
  fs::remove(recordings / "chessboard-fisheye/7.jpg");
  const auto changed = fetch();
  EXPECT_EQ(changed.exit_code, 1);
  EXPECT_THAT(changed.errors, HasSubstr("chessboard-fisheye: has other content than expected"));
}

}  // namespace
}  // namespace vlp
