// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <bit>
#include <csetjmp>
#include <cstddef>
#include <cstring>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

namespace vlp {
namespace {

void read_bytes(png_structp png, png_bytep to, png_size_t count) {
  auto& remaining = *static_cast<std::string_view*>(png_get_io_ptr(png));
  if (count > remaining.size()) png_error(png, "end of the file");
  std::memcpy(to, remaining.data(), count);
  remaining.remove_prefix(count);
}

[[noreturn]] void return_to_decoder(png_structp png, png_const_charp) { png_longjmp(png, 1); }

void ignore_warning(png_structp, png_const_charp) {}

/// Decoder with its memory. Functions that call setjmp() have no objects with destructors.
class PngDecoder {
 public:
  explicit PngDecoder(std::string_view bytes) : remaining_(bytes) {
    png_ =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, return_to_decoder, ignore_warning);
    if (png_ == nullptr) return;
    info_ = png_create_info_struct(png_);
    png_set_read_fn(png_, &remaining_, read_bytes);
  }
  ~PngDecoder() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngDecoder(const PngDecoder&) = delete;
  PngDecoder& operator=(const PngDecoder&) = delete;

  /// Allocates the image. Returns false if the header cannot be decoded.
  bool read_header(cv::Mat& image) {
    if (info_ == nullptr) return false;
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
    png_read_info(png_, info_);
    const int depth = png_get_bit_depth(png_, info_);
    const bool is_gray = png_get_color_type(png_, info_) == PNG_COLOR_TYPE_GRAY;
    if (!is_gray || (depth != 8 && depth != 16)) return false;
    image.create(static_cast<int>(png_get_image_height(png_, info_)),
                 static_cast<int>(png_get_image_width(png_, info_)), depth == 8 ? CV_8U : CV_16U);
    return true;
  }

  /// Reads all rows and the end of the file. Returns false if they cannot be decoded.
  bool read_rows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
    if (std::endian::native == std::endian::little) png_set_swap(png_);
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    png_read_image(png_, rows);
    png_read_end(png_, nullptr);
    return true;
  }

 private:
  std::string_view remaining_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace
}  // namespace vlp

/// The function that decode_gray_image() calls. Returns false if the bytes cannot be decoded.
extern "C" __attribute__((visibility("default"))) bool vlp_decode_gray_png(std::string_view bytes,
                                                                           cv::Mat& image) {
  vlp::PngDecoder decoder(bytes);
  if (!decoder.read_header(image)) return false;
  std::vector<png_bytep> rows;
  rows.reserve(static_cast<std::size_t>(image.rows));
  for (int row = 0; row < image.rows; ++row) rows.push_back(image.ptr(row));
  return decoder.read_rows(rows.data());
}
