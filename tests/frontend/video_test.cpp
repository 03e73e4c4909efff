// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Frames of videos, compared with the images from which they were made.
#include "frontend/video.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "frontend/lamp_intake.h"
#include "rig/lamp_map.h"
#include "support/datasets.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"
#include "support/write_video.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int kFrames = 40;

/// Creates a frame with smooth noise, which all codecs can encode.
cv::Mat make_frame(int number) {
  cv::Mat1b image(240, 320);
  cv::RNG random(static_cast<std::uint64_t>(number) + 1);
  random.fill(image, cv::RNG::UNIFORM, 0, 256);
  constexpr double soft_px = 3;
  cv::GaussianBlur(image, image, {}, soft_px);
  return image;
}

class VideoOfFrames : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < kFrames; ++i) frames.push_back(make_frame(i));
    if (!write_video(film, frames)) GTEST_SKIP() << "OpenCV writes no FFV1";
  }
  std::vector<std::string> names(ImageSource& source) const {
    std::vector<std::string> all;
    while (const auto image = source.read_next_image())
      all.push_back(image->file.filename().string());
    return all;
  }
  /// Writes a file with the first part of the video.
  fs::path cut(const std::string& name, double fraction) const {
    const std::string bytes = TemporaryFolder::read_content(film);
    return folder.file(name, bytes.substr(0, std::size_t(fraction * double(bytes.size()))));
  }

  const TemporaryFolder folder;
  const fs::path film = folder / "film.avi";
  std::vector<cv::Mat> frames;
};

TEST(VideoFrameNames, ContainNumberAndAreParsedBackToVideo) {
  EXPECT_TRUE(is_video_file_name("a/drive.MP4"));
  EXPECT_FALSE(is_video_file_name("a/drive.png"));
  EXPECT_EQ(make_frame_name("drive.mp4", 123), "drive.mp4#000123");
  EXPECT_EQ(make_frame_name("drive.mp4", 1234567), "drive.mp4#1234567");
  EXPECT_EQ(parse_video_name("drive.mp4#000123"), "drive.mp4");
  for (const char* other : {"drive.mp4", "drive.mp4#", "drive.mp4#12a", "a.png#000123"}) {
    EXPECT_EQ(parse_video_name(other), std::nullopt) << other;
  }
}

TEST_F(VideoOfFrames, ReturnsAllFramesWithTimes) {
  Video video(film.string());
  EXPECT_EQ(video.reported_frame_count(), std::size_t{kFrames});
  EXPECT_EQ(video.frame_size_px(), (std::array{320, 240}));
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = video.read_next_frame();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->number, std::size_t(i));
    EXPECT_NEAR(frame->time_s, 0.05 * i, 1e-9);
    EXPECT_EQ(cv::norm(frame->image, frames[std::size_t(i)], cv::NORM_INF), 0);
  }
  EXPECT_FALSE(video.read_next_frame());
  EXPECT_EQ(video.describe_missing_frames(), "");
}

TEST_F(VideoOfFrames, SourceReturnsEveryNthFrameBetweenImages) {
  const fs::path image = folder / "image.png";
  cv::imwrite(image.string(), frames[0]);
  FrontendOptions options;
  options.every = 15;
  ImageSource all({image, film, image}, options);
  EXPECT_EQ(all.expected_image_count(), 5U);
  EXPECT_THAT(names(all), ElementsAre("image.png", "film.avi#000000", "film.avi#000015",
                                      "film.avi#000030", "image.png"));
  EXPECT_THAT(all.video_warnings(), IsEmpty());
  ImageSource source({film}, options);
  source.read_next_image();
  const auto second = source.read_next_image();
  ASSERT_TRUE(second);
  EXPECT_NEAR(second->time_s.value(), 0.75, 1e-9);
  EXPECT_EQ(cv::norm(second->read_gray_image(options), frames[15], cv::NORM_INF), 0);
}

TEST_F(VideoOfFrames, SourceWarnsOfTruncatedVideo) {
  ImageSource source({cut("cut.avi", 0.6)});
  const auto count = names(source).size();
  EXPECT_GT(count, 20U);
  EXPECT_LT(count, 27U);
  EXPECT_THAT(source.video_warnings(),
              ElementsAre(HasSubstr("cut.avi: " + std::to_string(count) +
                                    " of its 40 frames can be decoded; is it cut short, or "
                                    "damaged?")));
}

/// The frames after the damage exist, with their own times.
TEST_F(VideoOfFrames, ReadingContinuesAfterDamagedFrames) {
  if (!write_video(film, frames, "PNG ")) GTEST_SKIP() << "OpenCV writes no PNG";
  std::string bytes = TemporaryFolder::read_content(film);
  bytes.replace(bytes.find("PNG", bytes.size() * 4 / 10), 3, "bad");
  bytes.replace(bytes.find("PNG", bytes.size() * 7 / 10), 3, "bad");
  Video video(folder.file("bad.avi", bytes).string());
  std::size_t count = 0;
  double last_s = 0;
  while (const auto frame = video.read_next_frame()) {
    EXPECT_EQ(frame->number, count);
    ++count;
    last_s = frame->time_s;
  }
  EXPECT_GT(count, 33U);
  EXPECT_LT(count, 39U);
  EXPECT_NEAR(last_s, 1.95, 1e-9);
  EXPECT_THAT(video.describe_missing_frames(), HasSubstr(" of its 40 frames can be decoded"));
}

TEST_F(VideoOfFrames, SourceThrowsForInvalidOrWronglySizedVideos) {
  const auto refusal = [&](const fs::path& file, const FrontendOptions& options = {},
                           const std::optional<std::array<int, 2>>& imager_px = {}) {
    return rejection_message([&] { ImageSource({file}, options, imager_px); });
  };
  const std::string none = ": cannot be opened as a video: is it cut short, or none?";
  const auto text = folder.file("text.mp4", "no video"), empty = folder.file("empty.avi", "");
  EXPECT_EQ(refusal(text), text.string() + none);
  EXPECT_EQ(refusal(empty), empty.string() + none);
  EXPECT_EQ(refusal(folder / "none.avi"),
            (folder / "none.avi").string() + ": there is no such video");
  // The header, and nothing behind it.
  const auto header = cut("header.avi", 0.005);
  EXPECT_THAT(refusal(header), testing::StartsWith(header.string() + ": "));
  FrontendOptions small;
  small.max_mpx = 0.05;
  EXPECT_THAT(refusal(film, small), HasSubstr("is 320 x 240 px, more than the 0.05 million"));
  EXPECT_THAT(refusal(film, {}, std::array{800, 600}),
              HasSubstr("is 320 x 240 px, the camera's images are 800 x 600 px"));
}

TEST_F(VideoOfFrames, YieldsSameLampsAsImages) {
  const auto files = list_images(kRig + "/sample");
  ASSERT_EQ(files.size(), 2U);
  std::vector<cv::Mat> images;
  for (const auto& file : files) images.push_back(read_image(file));
  ASSERT_TRUE(write_video(film, images));
  const LightDetector detector(
      read_lamp_map(kRig + "/lamps.yaml"),
      make_detector_camera(read_calibration(kRig + "/true_calibration.yaml")));
  const auto seen = [&](const std::vector<fs::path>& sources, int threads) {
    FrontendOptions options;
    options.threads = threads;
    return LampIntake(detector, ImageUse::fixes, options, {})
        .detect_lamps_in_images(sources)
        .images;
  };
  const auto of_images = seen(files, 1), of_film = seen({film}, 3);
  ASSERT_EQ(of_images.size(), files.size());
  ASSERT_EQ(of_film.size(), files.size());
  EXPECT_FALSE(of_images[1].time_s);
  EXPECT_EQ(of_film[1].image_file_name(), "film.avi#000001");
  EXPECT_NEAR(of_film[1].time_s.value(), 0.05, 1e-9);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto one = list_identified_lamps(of_images[i]), other = list_identified_lamps(of_film[i]);
    EXPECT_EQ(of_film[i].image_file_name(), make_frame_name("film.avi", i));
    ASSERT_EQ(one.size(), other.size());
    EXPECT_GE(one.size(), 4U);
    for (std::size_t k = 0; k < one.size(); ++k) {
      EXPECT_EQ(one[k].lamp, other[k].lamp);
      EXPECT_EQ(one[k].pixel, other[k].pixel);
    }
  }
}

/// Corners of a frame are kept as those of a file are.
TEST_F(VideoOfFrames, YieldsSameBoardCornersAsImages) {
  const fs::path file = kRig + "/sample-boards/0000.png";
  const cv::Mat image = read_image(file);
  ASSERT_TRUE(write_video(film, {image, image / 2}));
  const Board board = read_board(kRig + "/board.yaml");
  const BoardDetector detector(board);
  const BoardDetection of_image = detector.detect_board(image);
  ASSERT_GE(of_image.tags.size(), 20U);
  for (int run = 0; run < 2; ++run) {
    FrontendOptions options;
    options.threads = 2;
    options.corner_cache = folder / "cache";
    const auto seen = detect_boards({film}, board, "board.yaml", options).images;
    ASSERT_EQ(seen.size(), 2U);
    EXPECT_EQ(seen[1].image_file_name(), "film.avi#000001");
    ASSERT_TRUE(seen[0].board && seen[1].board);
    ASSERT_EQ(seen[0].board->detection.tags.size(), of_image.tags.size());
    for (std::size_t i = 0; i < of_image.tags.size(); ++i) {
      EXPECT_EQ(seen[0].board->detection.tags[i].corners_px, of_image.tags[i].corners_px);
    }
    EXPECT_NE(seen[1].board->detection.tags.at(0).corners_px, of_image.tags[0].corners_px);
    const fs::directory_iterator kept(folder / "cache");
    EXPECT_EQ(std::distance(begin(kept), end(kept)), 2);
  }
}

}  // namespace
}  // namespace vlp
