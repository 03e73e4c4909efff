// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-station run while images arrive: the same result, refusals, kills, a video, a full disk.
#include <sys/mount.h>
#include <unistd.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>

#include "small_station.h"
#include "support/random.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class WatchedStation : public SmallStation {
 protected:
  const std::vector<std::string> steps{"boards", "rotation", "dispersion", "check"};

  /// The folders of a camera with the tables, as the fixture of the station writes them.
  void prepare(const std::string& camera) const {
    for (const std::string& step : steps) {
      fs::create_directories(captures(camera) / step);
      const auto table = folder / ("unit/" + step + "/captures.csv");
      if (fs::exists(table)) fs::copy_file(table, captures(camera) / step / "captures.csv");
    }
  }
  void drop_all(const std::string& camera) const {
    for (const std::string& step : steps) {
      for (const auto& image : images(step)) drop(image, captures(camera) / step);
    }
  }
};

TEST_F(WatchedStation, ComesToTheSameAsFromFullFoldersAndPutsTheImagesAway) {
  render();
  ASSERT_EQ(run_program(batch("a")).exit_code, 0);
  prepare("b");
  drop_all("b");
  const auto result = run_program(run("b", "--idle-s 60"));
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  EXPECT_THAT(result.errors, AllOf(HasSubstr("boards 0000.png: taken"), HasSubstr("(16/16)")));
  EXPECT_NE(comparable_calibration("a"), "");
  EXPECT_EQ(comparable_calibration("b"), comparable_calibration("a"));
  EXPECT_FALSE(fs::exists(captures("b")));
  int kept = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "station/captures")) {
    kept += entry.path().extension() == ".png" ? 1 : 0;
  }
  EXPECT_EQ(kept, 48);
}

TEST_F(WatchedStation, SaysWhyAnImageIsRefused) {
  const auto at = captures("a") / "boards";
  fs::create_directories(at);
  const std::string view = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample-boards/0000.png";
  fs::copy_file(view, at / "0.png");
  fs::copy_file(view, at / "1.png");
  cv::imwrite((at / "2.png").string(), cv::Mat1b(600, 800, static_cast<unsigned char>(3)));
  cv::imwrite((at / "3.png").string(), cv::Mat1b(480, 640, static_cast<unsigned char>(90)));
  std::ofstream(at / "4.png") << "no image";
  const auto result = run_program(run("a", "--idle-s 1"));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(
      result.errors,
      AllOf(HasSubstr("0.png: taken"), HasSubstr("1.png: refused: same pose as 0.png"),
            HasSubstr("2.png: refused: too dark"), HasSubstr("3.png: refused: is 640 x 480"),
            HasSubstr("4.png: refused: cannot be read")));
}

/// Killed again and again while images arrive, it goes on where it was, and loses nothing.
TEST_F(WatchedStation, GoesOnAfterItWasKilled) {
  render();
  ASSERT_EQ(run_program(batch("a")).exit_code, 0);
  const auto arrive = [&] {
    if (fs::exists(captures("b") / "boards" / images("boards").back().filename())) return;
    prepare("b");
    drop_all("b");
  };
  arrive();
  Random random(1);
  // With VLP_STATION_KILLS=100 as the station was tried once.
  const char* wanted = std::getenv("VLP_STATION_KILLS");
  const int kills = wanted == nullptr ? 4 : std::atoi(wanted);
  for (int i = 0; i < kills; ++i) {
    const double wait_s = random.uniform(0, 3);
    run_program("(exec " + run("b", "-q --idle-s 60") + ") & sleep " + std::to_string(wait_s) +
                "; kill -9 $! 2>&-; wait");
    for (const auto& entry : fs::recursive_directory_iterator(folder / "station/results")) {
      if (entry.path().filename() != "calibration.yaml") continue;
      EXPECT_THAT(TemporaryFolder::content_of(entry.path()), HasSubstr("intrinsics: ["));
    }
    arrive();  // if it came to its end, the next unit of that name
  }
  // A start after a kill between the record and the end puts the finished unit away, and waits.
  int exit_code = 1;
  for (int i = 0; i < 3 && exit_code != 0; ++i) {
    arrive();
    exit_code = run_program(run("b", "-q --idle-s 5")).exit_code;
  }
  EXPECT_EQ(exit_code, 0);
  int kept = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder / "station/captures")) {
    kept += entry.path().extension() == ".png" ? 1 : 0;
  }
  // Every unit that was put away has its record, its calibration and all of its images.
  const std::string list = records("list --camera-id b").output;
  int listed = 0;
  for (auto at = list.find("PASS"); at != std::string::npos; at = list.find("PASS", at + 1)) {
    ++listed;
  }
  EXPECT_EQ(kept, 48 * listed);
}

/// A captures.csv that comes last, and in parts, is read when it is whole.
TEST_F(WatchedStation, WaitsForTheTablesOfPlaces) {
  render();
  prepare("a");
  const auto table = captures("a") / "check/captures.csv";
  const std::string places = TemporaryFolder::content_of(table);
  std::ofstream(table) << places.substr(0, places.size() - 5);  // cut short
  drop_all("a");
  const auto result =
      run_program("(sleep 6; mv " + folder.file("places", places).string() + " " + table.string() +
                  ") & " + run("a", "--idle-s 60") + "; code=$?; wait; exit $code");
  EXPECT_EQ(result.exit_code, 0) << result.errors;
}

/// Writes images, each some times: what a camera sees that rests for a while.
bool write_video(const fs::path& file, const std::vector<fs::path>& images, int times) {
  cv::VideoWriter video(file.string(), cv::VideoWriter::fourcc('F', 'F', 'V', '1'), 10, {800, 600},
                        false);
  if (!video.isOpened()) return false;
  for (const auto& image : images) {
    const cv::Mat frame = cv::imread(image.string(), cv::IMREAD_GRAYSCALE);
    for (int i = 0; i < times; ++i) video.write(frame);
  }
  return true;
}

TEST_F(WatchedStation, TakesAVideo) {
  render();
  prepare("a");
  const std::string video = (folder / "boards.avi").string();
  if (!write_video(video, images("boards"), 2)) GTEST_SKIP() << "OpenCV writes no FFV1";
  for (const char* step : {"rotation", "dispersion", "check"}) {
    for (const auto& image : images(step)) drop(image, captures("a") / step);
  }
  const auto result = run_program(run("a", "--idle-s 60 --source boards=" + video));
  EXPECT_EQ(result.exit_code, 0) << result.output << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("refused: same pose as frame-000000.png"));
  EXPECT_THAT(records("show").output, HasSubstr("images     48, 48 used"));
}

/// All its frames are refused, and none is kept: the record still tells why.
TEST_F(WatchedStation, NamesTheCauseOfAVideoThatCannotBeUsed) {
  change("scene.yaml", "blur_px: 0.7", "blur_px: 2.5");
  change("scene.yaml", "count: 16", "count: 6");
  render("boards");
  const std::string video = (folder / "boards.avi").string();
  if (!write_video(video, images("boards"), 1)) GTEST_SKIP() << "OpenCV writes no FFV1";
  const auto result = run_program(run("a", "--idle-s 60 --source " + video));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.errors, HasSubstr("fails: the lens is blurred"));
  EXPECT_THAT(result.output, HasSubstr("6 of 6 images refused: 6 blurred"));
  EXPECT_THAT(records("show").output, HasSubstr("images     6, 0 used"));
}

TEST_F(WatchedStation, SurvivesAFullDisk) {
  render();
  const auto small = folder / "station/results";
  fs::create_directory(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=600k") != 0) {
    GTEST_SKIP() << "no small file system can be mounted here";
  }
  change("station.yaml", "records: records.db", "records: results/records.db");
  const std::string fill = (small / "full").string();
  run_program("head -c 1000000 /dev/zero >" + fill + " || true");
  EXPECT_EQ(run_program(batch("a")).exit_code, 2);
  fs::resize_file(fill, 0);
  ASSERT_EQ(run_program(batch("b")).exit_code, 0);
  // Now so full that a record fits in part.
  for (const int free_bytes : {4096, 12288}) {
    fs::resize_file(fill, 0);
    run_program("head -c 1000000 /dev/zero >" + fill + " || true");
    fs::resize_file(fill, fs::file_size(fill) - static_cast<std::uintmax_t>(free_bytes));
    const auto full = run_program(batch("c"));
    EXPECT_THAT(full.exit_code, testing::AnyOf(0, 2)) << full.errors;
    if (full.exit_code == 2) {
      EXPECT_THAT(full.errors, HasSubstr("results"));
    }
  }
  fs::remove(fill);
  EXPECT_THAT(records("list --camera-id b").output, HasSubstr("1 runs, 1 passed"));
  for (const auto& entry : fs::recursive_directory_iterator(small)) {
    if (entry.path().filename() != "calibration.yaml") continue;
    EXPECT_THAT(TemporaryFolder::content_of(entry.path()), HasSubstr("intrinsics: ["));
  }
  ::umount(small.c_str());
}

}  // namespace
}  // namespace vlp
