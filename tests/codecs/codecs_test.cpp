// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

#include <gtest/gtest.h>

#include <stdexcept>

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
