// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_file.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "rig/input_error.h"
#include "support/rejection_message.h"
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

class ReadHeaderSizeOfFormat : public testing::TestWithParam<const char*> {};

TEST_P(ReadHeaderSizeOfFormat, ReturnsSizeOfImage) {
  for (const Size size : {Size{1, 1}, Size{2, 100}, Size{641, 3}, Size{300, 517}}) {
    const std::string bytes =
        encoded_as(GetParam(), static_cast<int>(size[0]), static_cast<int>(size[1]));
    EXPECT_EQ(read_header_size(bytes), size);
  }
}

TEST_P(ReadHeaderSizeOfFormat, ReturnsSizeOrNulloptForTruncatedFile) {
  const std::string bytes = encoded_as(GetParam(), 33, 21);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const auto size = read_header_size(std::string_view(bytes).substr(0, length));
    EXPECT_TRUE(!size || *size == (Size{33, 21})) << length;
  }
}

INSTANTIATE_TEST_SUITE_P(Formats, ReadHeaderSizeOfFormat,
                         testing::Values(".png", ".jpg", ".bmp", ".tif", ".pgm"),
                         [](const auto& ending) { return std::string(ending.param + 1); });

TEST(ReadHeaderSize, ReturnsSizeOfBigTiff) {
  std::string bytes("II+\0\x08\0\0\0\x10\0\0\0\0\0\0\0", 16);
  bytes += std::string("\x02\0\0\0\0\0\0\0", 8);
  bytes += std::string("\0\x01\x04\0\x01\0\0\0\0\0\0\0\x20\x4e\0\0\0\0\0\0", 20);
  bytes += std::string("\x01\x01\x03\0\x01\0\0\0\0\0\0\0\x2c\x01\0\0\0\0\0\0", 20);
  EXPECT_EQ(read_header_size(bytes), (Size{20000, 300}));
  for (std::size_t length = 0; length < 58; ++length) {
    EXPECT_FALSE(read_header_size(std::string_view(bytes).substr(0, length))) << length;
  }
}

TEST(ReadHeaderSize, ReturnsNulloptForFilesThatAreNoImages) {
  EXPECT_FALSE(read_header_size(""));
  EXPECT_FALSE(read_header_size("no image"));
  EXPECT_FALSE(read_header_size("P5 # never ends"));
}

TEST(ReadHeaderSize, SkipsNonMarkerBytesInJpeg) {
  std::string bytes = encoded_as(".jpg", 33, 21);
  bytes.insert(2, std::string("\x01\xff\x00\x02", 4));
  EXPECT_EQ(read_header_size(bytes), (Size{33, 21}));
}

TEST(ReadHeaderSize, SkipsJpegMarkersWithoutLength) {
  // Read as lengths, the two bytes behind the marker lead to the frame header in the comment.
  std::string comment("\xff\xe1\xff\xff", 4);
  const std::string small("\xff\xc0\0\x0b\x08\0\x10\0\x10", 9);
  comment.resize(0xffe1);
  comment += small;
  comment.resize(0xffff + 2);
  for (const std::string marker : {"\xff\xd0", "\xff\xd7", "\xff\x01"}) {
    std::string bytes = encoded_as(".jpg", 33, 21);
    bytes.insert(2, marker + comment);
    EXPECT_EQ(read_header_size(bytes), (Size{33, 21}));
  }
  for (const std::string marker : {"\xff\xd8", "\xff\xd9"}) {
    std::string bytes = encoded_as(".jpg", 33, 21);
    bytes.insert(2, marker);
    EXPECT_FALSE(read_header_size(bytes));
  }
}

/// Returns a TIFF file that ends with its directory.
std::string make_tiff(const std::vector<std::string>& entries) {
  std::string bytes("II*\0\x08\0\0\0", 8);
  bytes += {static_cast<char>(entries.size()), '\0'};
  for (const std::string& entry : entries) bytes += entry;
  return bytes + std::string(4, '\0');
}

TEST(ReadHeaderSize, UsesFirstOfRepeatedTagsOfTiff) {
  const std::string width("\0\x01\x04\0\x01\0\0\0\x30\x75\0\0", 12),
      height("\x01\x01\x04\0\x01\0\0\0\x2c\x01\0\0", 12),
      small_width("\0\x01\x04\0\x01\0\0\0\x02\0\0\0", 12),
      elsewhere("\0\x01\x10\0\x01\0\0\0\x08\0\0\0", 12);  // a LONG8 at byte 8
  EXPECT_EQ(read_header_size(make_tiff({width, height, small_width})), (Size{30000, 300}));
  EXPECT_FALSE(read_header_size(make_tiff({elsewhere, height})));
}

TEST(ReadImage, ReportsTruncatedFilesAsCutShortOrDamaged) {
  const TemporaryFolder folder;
  const std::string tiff = encoded_as(".tif", 33, 21), jpeg("\xff\xd8\xff\xda\xff\xd9");
  for (const std::string& content : {tiff.substr(0, 8), jpeg, std::string("BM12"), make_tiff({})}) {
    EXPECT_THAT(rejection_message([&] { read_image(folder.file("a.png", content)); }),
                HasSubstr("cannot be read as an image: it is cut short or damaged"));
  }
}

TEST(ReadImage, RejectsFilesOfUnsupportedFormats) {
  const TemporaryFolder folder;
  const std::string webp("RIFF\x10\0\0\0WEBPVP8L\x04\0\0\0\x2f\xff\xff\xff", 24);
  for (const std::string& content : {webp, std::string("no image"), std::string(100, '\0')}) {
    try {
      read_image(folder.file("a.png", content));
      ADD_FAILURE() << "is read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("it is not PNG, JPEG, BMP, TIFF, PBM, PGM or PPM"));
    }
  }
}

TEST(ReadImage, RejectsImageWhoseHeaderExceedsMaxMegapixels) {
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
