// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

namespace vlp {
namespace {

/// cv::IMREAD_UNCHANGED, without the headers of imgcodecs.
constexpr int kUnchanged = -1;

cv::Mat1w gradient() {
  cv::Mat1w image(3, 5);
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      image(row, column) = static_cast<std::uint16_t>(1000 * row + 300 * column);
    }
  }
  return image;
}

TEST(Codecs, DecodeReturnsEncoded16BitImageExactly) {
  const cv::Mat1w image = gradient();
  for (const char* ending : {".png", ".tiff", ".pgm"}) {
    std::string bytes = get_codecs().encode_image_file(ending, image, {});
    const cv::Mat decoded = get_codecs().decode_image(bytes, kUnchanged);
    ASSERT_EQ(decoded.type(), CV_16UC1) << ending;
    ASSERT_EQ(decoded.size(), image.size()) << ending;
    EXPECT_EQ(cv::norm(decoded, image, cv::NORM_INF), 0) << ending;
  }
}

/// Flags of cv::imread for decode_gray_image(), without the headers of imgcodecs: gray, any depth,
/// orientation ignored.
constexpr int kGray = 0 | 2 | 128;

cv::Mat make_random_image(int type) {
  cv::Mat image(37, 53, type);
  cv::randu(image, 0, image.depth() == CV_8U ? 256 : 65536);
  return image;
}

TEST(DecodeGrayImage, MatchesOpencvForAllFormats) {
  for (const int type : {CV_8UC1, CV_16UC1, CV_8UC3, CV_16UC3, CV_8UC4, CV_16UC4}) {
    for (const char* ending : {".png", ".tiff", ".jpg", ".bmp", ".pgm", ".ppm"}) {
      const cv::Mat image = make_random_image(type);
      const int channels = std::string(ending) == ".pgm"   ? 1
                           : std::string(ending) == ".ppm" ? 3
                                                           : 0;
      if (channels > 0 && image.channels() != channels) continue;
      std::string bytes = get_codecs().encode_image_file(ending, image, {});
      const cv::Mat expected = get_codecs().decode_image(bytes, kGray);
      const cv::Mat decoded = decode_gray_image(bytes);
      ASSERT_FALSE(expected.empty()) << ending << type;
      ASSERT_EQ(decoded.type(), expected.type()) << ending << type;
      ASSERT_EQ(decoded.size(), expected.size()) << ending << type;
      EXPECT_EQ(cv::norm(decoded, expected, cv::NORM_INF), 0) << ending << type;
    }
  }
}

TEST(DecodeGrayImage, ReturnsEmptyImageForTruncatedPng) {
  const std::string bytes = get_codecs().encode_image_file(".png", make_random_image(CV_8UC1), {});
  for (const std::size_t length : {8U, 25U, 26U, 33U, 500U, 1000U}) {
    std::string truncated = bytes.substr(0, length);
    EXPECT_TRUE(decode_gray_image(truncated).empty()) << length;
  }
}

TEST(DecodeGrayImage, ReturnsEmptyImageForWrongChecksum) {
  std::string bytes = get_codecs().encode_image_file(".png", make_random_image(CV_16UC1), {});
  bytes[bytes.size() / 2] ^= 1;
  EXPECT_TRUE(decode_gray_image(bytes).empty());
}

TEST(DecodeGrayImageDeathTest, DoesNotLoadOpencvCodecsForGrayPng) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // in a new process
  const auto decode_and_exit = [] {
    std::string bytes(
        "\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR\0\0\0\x02\0\0\0\x01\x08\0\0\0\0\xd1\x49\x20\x56"
        "\0\0\0\x0bIDAT\x78\xda\x63\x88\x5a\x0a\0\x01\x5c\x01\0\x67\xf4\xa5\x15"
        "\0\0\0\0IEND\xae\x42\x60\x82",
        68);
    const cv::Mat1b image = decode_gray_image(bytes);
    std::ifstream file("/proc/self/maps");
    const std::string libraries(std::istreambuf_iterator<char>(file), {});
    const bool is_decoded =
        image.size() == cv::Size(2, 1) && image(0, 0) == 0x5a && image(0, 1) == 0xa5;
    const bool is_loaded = libraries.find("opencv_imgcodecs") != std::string::npos ||
                           libraries.find("opencv_core") == std::string::npos;
    std::exit(is_decoded && !is_loaded ? 0 : 1);
  };
  EXPECT_EXIT(decode_and_exit(), testing::ExitedWithCode(0), "");
}

TEST(Codecs, DecodeReturnsEmptyImageForBytesOfNoImage) {
  std::string bytes = "no image";
  EXPECT_TRUE(get_codecs().decode_image(bytes, kUnchanged).empty());
}

TEST(Codecs, EncodeThrowsForUnknownExtension) {
  EXPECT_ANY_THROW(get_codecs().encode_image_file(".unknown", gradient(), {}));
}

TEST(VideoReader, OpenReturnsFalseForMissingFile) {
  constexpr int ffmpeg = 1900;  // cv::CAP_FFMPEG
  if (!get_codecs().has_video_backend(ffmpeg)) GTEST_SKIP() << "OpenCV without FFmpeg";
  const auto reader = get_codecs().make_video_reader();
  ASSERT_TRUE(reader);
  EXPECT_FALSE(reader->open_video("/nonexistent.avi", ffmpeg));
  cv::Mat frame;
  EXPECT_FALSE(reader->grab_frame() && reader->retrieve_frame(frame));
}

}  // namespace
}  // namespace vlp
