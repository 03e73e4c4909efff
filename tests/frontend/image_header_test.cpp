// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_header.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "frontend/image_file.h"
#include "rig/input_error.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using Size = std::array<std::int64_t, 2>;

std::string encoded_as(const std::string& ending, int width, int height) {
  std::vector<unsigned char> bytes;
  cv::imencode(ending, cv::Mat(height, width, CV_8UC1, cv::Scalar(90)), bytes);
  return {bytes.begin(), bytes.end()};
}

class SizeInHeader : public testing::TestWithParam<const char*> {};

TEST_P(SizeInHeader, IsThatOfTheImage) {
  for (const Size size : {Size{1, 1}, Size{2, 100}, Size{641, 3}, Size{300, 517}}) {
    const std::string bytes =
        encoded_as(GetParam(), static_cast<int>(size[0]), static_cast<int>(size[1]));
    EXPECT_EQ(size_in_header(bytes), size);
  }
}

TEST_P(SizeInHeader, OfAFileCutShortIsTheSameOrNone) {
  const std::string bytes = encoded_as(GetParam(), 33, 21);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto size = size_in_header(std::string_view(bytes).substr(0, length));
    EXPECT_TRUE(!size || *size == (Size{33, 21})) << length;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, SizeInHeader,
                         testing::Values(".png", ".jpg", ".bmp", ".tif", ".pgm"),
                         [](const auto& ending) { return std::string(ending.param + 1); });

TEST(SizeInHeaderOf, BigTiffIsThatOfItsDirectory) {
  std::string bytes("II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0", 16);
  bytes += std::string("\x02\0\0\0\0\0\0\0", 8);
  bytes += std::string("\0\x01\x04\0\x01\0\0\0\0\0\0\0\x20\x4e\0\0\0\0\0\0", 20);
  bytes += std::string("\x01\x01\x03\0\x01\0\0\0\0\0\0\0\x2c\x01\0\0\0\0\0\0", 20);
  EXPECT_EQ(size_in_header(bytes), (Size{20000, 300}));
  for (std::size_t length = 0; length < 58; ++length) {
    EXPECT_FALSE(size_in_header(std::string_view(bytes).substr(0, length))) << length;
  }
}

TEST(SizeInHeaderOf, OtherFilesIsNotKnown) {
  EXPECT_FALSE(size_in_header(""));
  EXPECT_FALSE(size_in_header("no image"));
  EXPECT_FALSE(size_in_header("P5 # never ends"));
}

TEST(SizeInHeaderOf, JpegIsFoundBehindBytesThatAreNoMarker) {
  std::string bytes = encoded_as(".jpg", 33, 21);
  bytes.insert(2, std::string("\x01\xff\x00\x02", 4));
  EXPECT_EQ(size_in_header(bytes), (Size{33, 21}));
}

TEST(ReadImage, RefusesOtherFormatsUndecoded) {
  const TemporaryFolder folder;
  const std::string webp("RIFF\x10\0\0\0WEBPVP8L\x04\0\0\0\x2f\xff\xff\xff", 24);
  for (const std::string& content : {webp, std::string("no image"), std::string(100, '\0')}) {
    try {
      read_image(folder.file("a.png", content));
      ADD_FAILURE() << "is read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("is no PNG, JPEG, BMP, TIFF or PGM"));
    }
  }
}

TEST(ReadImage, RefusesWhatItsHeaderSaysIsTooLargeUndecoded) {
  std::string bytes = encoded_as(".png", 30, 30);
  for (const std::size_t at : {16U, 20U}) bytes.replace(at, 4, std::string("\0\0\x75\x30", 4));
  const TemporaryFolder folder;
  const auto file = folder.file("large.png", bytes);
  const auto refusal = [&](double max_mpx) -> std::string {
    try {
      read_image(file, max_mpx);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(200), HasSubstr("is 30000 x 30000 px, more than the 200 million that are "
                                      "allowed; --max-mpx"));
  const auto small = folder.file("small.png", encoded_as(".png", 40, 25));
  EXPECT_EQ(read_image(small, 0.001).cols, 40);
  EXPECT_THROW(read_image(small, 0.0009), InputError);
}

}  // namespace
}  // namespace vlp
