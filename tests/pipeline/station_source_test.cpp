// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station run --source: frames of a video; a camera there is none.
#include <sys/mount.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "small_station.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class VlpStationSource : public SmallStation {};

/// Writes images, the first two several times: what a camera sees that rests for a while.
bool write_video(const fs::path& file, const std::vector<fs::path>& images) {
  cv::VideoWriter video(file.string(), cv::VideoWriter::fourcc('F', 'F', 'V', '1'), 10, {800, 600},
                        false);
  if (!video.isOpened()) return false;
  for (const auto& image : images) {
    const cv::Mat frame = cv::imread(image.string(), cv::IMREAD_GRAYSCALE);
    for (int i = 0; i < (image <= images[1] ? 3 : 1); ++i) video.write(frame);
  }
  return true;
}

TEST_F(VlpStationSource, UsesFramesOfVideoAsBoardImages) {
  render();
  prepare("a");
  const std::string video = (folder / "boards.avi").string();
  if (!write_video(video, images("boards"))) GTEST_SKIP() << "OpenCV writes no FFV1";
  for (const char* step : {"rotation", "dispersion", "check"}) {
    for (const auto& image : images(step)) drop(image, captures("a") / step);
  }
  const auto result = run_program(run("a", "--idle-s 60 --source boards=" + video));
  EXPECT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("refused: is the same image as frame-000000.png"));
  EXPECT_THAT(records("show").output, HasSubstr("images     48, 48 used"));
}

TEST_F(VlpStationSource, CreatesNoCapturesFolderWhenSourceCannotBeOpened) {
  const auto camera = run_program(run("0001", "--source boards=/dev/video99"));
  EXPECT_EQ(camera.exit_code, 2);
  EXPECT_EQ(camera.errors,
            "vlp-station: error: /dev/video99: there is no such camera: is it connected?\n");
  const auto video = run_program(run("0001", "--source " + folder.file("a.avi", "a").string()));
  EXPECT_THAT(video.errors,
              AllOf(HasSubstr("a.avi: cannot be opened as a video: is it cut short, or none?\n"),
                    Not(HasSubstr("OpenCV"))));
  EXPECT_FALSE(fs::exists(captures("0001")));
}

/// Frames that had room are kept whole, and the same command goes on with them once there is room.
TEST_F(VlpStationSource, KeepsCompleteFramesOfVideoWhenDiskIsFull) {
  change("scene.yaml", "count: 16", "count: 8");
  change("station.yaml", "board_views: 16", "board_views: 8");
  render("boards");
  const std::string video = (folder / "boards.avi").string();
  if (!write_video(video, images("boards"))) GTEST_SKIP() << "OpenCV writes no FFV1";
  const auto small = folder / "station/captures";
  fs::create_directory(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=900k") != 0) {  // three frames or four
    GTEST_SKIP() << "no small file system can be mounted here";
  }
  const std::string command = run("a", "--idle-s 60 --source " + video);
  const auto full = run_program(command);
  EXPECT_EQ(full.exit_code, 2) << full.errors;
  EXPECT_THAT(full.errors, HasSubstr("cannot be written: No space left on device"));
  int frames = 0;
  for (const auto& entry : fs::directory_iterator(captures("a") / "boards")) {
    EXPECT_FALSE(cv::imread(entry.path().string()).empty()) << entry.path();
    ++frames;
  }
  EXPECT_GT(frames, 0);
  ASSERT_EQ(::mount("none", small.c_str(), "tmpfs", MS_REMOUNT, "size=20m"), 0);
  const auto rest = run_program(command);
  EXPECT_THAT(rest.errors, AllOf(HasSubstr("refused: is the same image as frame-000000.png"),
                                 HasSubstr("boards is done")));
  EXPECT_THAT(records("show").output, HasSubstr("images     8, 8 used"));
  ::umount2(small.c_str(), MNT_DETACH);
}

}  // namespace
}  // namespace vlp
