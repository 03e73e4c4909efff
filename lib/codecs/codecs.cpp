// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "codecs/codecs.h"

#include <dlfcn.h>

#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "codecs/load_function.h"

namespace vlp {
namespace {

constexpr const char* kProblem = "images cannot be read or written";

const Codecs& load_codecs() {
  // Binding the functions of all its libraries at once takes 15 ms.
  return *load_function<const Codecs*()>(VLP_CODECS_LIBRARY, "vlp_codecs", kProblem, RTLD_LAZY)();
}

/// Returns true if the header is that of a gray PNG image with 8 or 16 bits. The signature and the
/// length of the header precede its name; width and height follow it.
bool is_gray_png(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr std::size_t depth = 24, color_type = 25;
  constexpr char gray = 0;
  return bytes.starts_with("\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR"sv) && bytes.size() > color_type &&
         (bytes[depth] == 8 || bytes[depth] == 16) && bytes[color_type] == gray;
}

/// Decodes a gray PNG image. Returns an empty matrix if it cannot be decoded.
cv::Mat decode_gray_png(std::string_view bytes) {
  static auto* const decode = load_function<bool(std::string_view, cv::Mat&)>(
      VLP_PNG_LIBRARY, "vlp_decode_gray_png", kProblem, RTLD_LAZY);
  cv::Mat image;
  return decode(bytes, image) ? image : cv::Mat();
}

}  // namespace

const Codecs& get_codecs() {
  static const Codecs& loaded = load_codecs();
  return loaded;
}

cv::Mat decode_gray_image(std::string& bytes) {
  cv::Mat image = is_gray_png(bytes) ? decode_gray_png(bytes) : cv::Mat();
  if (!image.empty()) return image;
  return get_codecs().decode_image(
      bytes, cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
}

}  // namespace vlp
