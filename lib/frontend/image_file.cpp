// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_file.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "codecs/codecs.h"
#include "frontend/image_header.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Returns true if a JPEG is truncated: no end marker (FF D9) follows its scan. A truncated JPEG is
/// decoded without an error, with gray pixels after the end of the data.
bool is_cut_jpeg(const std::string& bytes) {
  constexpr std::size_t marker = 2;
  if (!bytes.starts_with("\xff\xd8")) return false;
  const auto scan = bytes.rfind("\xff\xda"), end = bytes.rfind("\xff\xd9");
  return scan == std::string::npos || end == std::string::npos || end < scan + marker;
}

/// Returns true if a PNG is truncated: it lacks the empty IEND chunk with its checksum. Some
/// programs append data to this chunk.
bool is_cut_png(const std::string& bytes) {
  using namespace std::string_view_literals;
  constexpr auto end = "\0\0\0\0IEND\xae\x42\x60\x82"sv;
  return bytes.starts_with("\x89PNG\r\n\x1a\n") && bytes.rfind(end) == std::string::npos;
}

/// Returns the largest length in bytes of a file with `max_mpx` megapixels: four uncompressed
/// channels of 16 bits, and 64 MB for previews, metadata and color profiles.
std::size_t max_file_bytes(double max_mpx) {
  constexpr double bytes_per_mpx = 8e6, metadata_bytes = 64e6;
  constexpr double max_of_decoder = std::numeric_limits<int>::max();
  return static_cast<std::size_t>(
      std::min(max_mpx * bytes_per_mpx + metadata_bytes, max_of_decoder));
}

}  // namespace

void check_size(const fs::path& file, std::int64_t width, std::int64_t height, double max_mpx) {
  constexpr double million = 1e6;
  if (static_cast<double>(width) * static_cast<double>(height) <= max_mpx * million) return;
  throw InputError(
      file, "is " + std::to_string(width) + " x " + std::to_string(height) + " px, more than the " +
                shortest(max_mpx) +
                " million that are allowed; --max-mpx of vlp-detect and vlp-intrinsics "
                "allows more");
}

cv::Mat read_image(const fs::path& file, double max_mpx) {
  std::string bytes = read_file(file, max_file_bytes(max_mpx));
  if (bytes.empty()) throw InputError(file, "cannot be read as an image");
  const char* const cut = "cannot be read as an image: it is cut short";
  if (is_cut_jpeg(bytes)) throw InputError(file, cut);
  // Other formats are rejected, because the memory that they need is unknown before decoding.
  const auto size = read_header_size(bytes);
  if (!size) {
    throw InputError(file, has_image_signature(bytes)
                               ? "cannot be read as an image: it is cut short or damaged"
                               : "cannot be read as an image: is no PNG, JPEG, BMP, TIFF, PBM, PGM "
                                 "or PPM");
  }
  check_size(file, (*size)[0], (*size)[1], max_mpx);
  if (is_cut_png(bytes)) throw InputError(file, cut);
  cv::Mat image;
  try {
    image = codecs().decode(
        bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception& failure) {
    throw InputError(file, "cannot be read as an image: " + failure.err);
  }
  if (image.empty()) throw InputError(file, "cannot be read as an image");
  check_size(file, image.cols, image.rows, max_mpx);
  if (image.depth() != CV_8U && image.depth() != CV_16U) {
    throw InputError(file, "has neither 8 nor 16 bits");
  }
  return image;
}

}  // namespace vlp
