// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_file.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstddef>
#include <string_view>

#include "codecs/codecs.h"
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

using Size = std::optional<std::array<std::int64_t, 2>>;

enum class ByteOrder { big, little };

/// Reads an unsigned number of `count` bytes; std::nullopt beyond the end.
std::optional<std::int64_t> read_number_at(std::string_view bytes, std::size_t at,
                                           std::size_t count, ByteOrder order) {
  if (at > bytes.size() || bytes.size() - at < count) return {};
  std::int64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t place = order == ByteOrder::big ? at + i : at + count - 1 - i;
    value = value << 8 | static_cast<unsigned char>(bytes[place]);
  }
  return value;
}

Size make_size(const std::optional<std::int64_t>& width,
               const std::optional<std::int64_t>& height) {
  if (!width || !height) return {};
  return std::array{*width, *height};
}

/// Reads the size from the first chunk, IHDR. Its length and type follow the signature of 8 bytes.
Size read_png_size(std::string_view bytes) {
  return make_size(read_number_at(bytes, 16, 4, ByteOrder::big),
                   read_number_at(bytes, 20, 4, ByteOrder::big));
}

/// Reads the size of a BMP. A negative height means that rows are stored from the top.
Size read_bmp_size(std::string_view bytes) {
  const auto header = read_number_at(bytes, 14, 4, ByteOrder::little);
  constexpr std::int64_t oldest = 12;  // of OS/2, with sizes of two bytes
  if (header == oldest) {
    return make_size(read_number_at(bytes, 18, 2, ByteOrder::little),
                     read_number_at(bytes, 20, 2, ByteOrder::little));
  }
  const auto signed_at = [&](std::size_t at) -> std::optional<std::int64_t> {
    const auto value = read_number_at(bytes, at, 4, ByteOrder::little);
    if (!value) return {};
    const auto with_sign = static_cast<std::int32_t>(*value);
    return with_sign < 0 ? -static_cast<std::int64_t>(with_sign) : with_sign;
  };
  return make_size(signed_at(18), signed_at(22));
}

/// Reads the frame header, SOF: FF C0 to FF CF but for C4, C8 and CC. The segments before it are
/// skipped by their lengths, as libjpeg does.
Size read_jpeg_size(std::string_view bytes) {
  std::size_t at = 2;
  while (at + 4 <= bytes.size()) {
    if (bytes[at] != '\xff') {  // decoders look for the next marker, too
      ++at;
      continue;
    }
    const auto marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker == 0xff || marker == 0) {  // filled up, or no marker
      ++at;
      continue;
    }
    if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) {  // TEM, RST: without a length
      at += 2;
      continue;
    }
    if (marker == 0xd8 || marker == 0xd9) return {};  // another start, or the end
    const auto length = read_number_at(bytes, at + 2, 2, ByteOrder::big);
    const bool frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame) {
      return make_size(read_number_at(bytes, at + 7, 2, ByteOrder::big),
                       read_number_at(bytes, at + 5, 2, ByteOrder::big));
    }
    if (!length || *length < 2) return {};
    at += 2 + static_cast<std::size_t>(*length);
  }
  return {};
}

/// Layout of TIFF and of BigTIFF, whose numbers have 8 bytes, as far as the size requires it.
struct TiffLayout {
  /// Position of the offset of the first directory; number of bytes of an offset and of a count of
  /// entries.
  std::size_t directory_at, place_bytes, count_bytes;
  /// Bytes of an entry, and where in it the value stands.
  std::size_t entry_bytes, value_at;
};
constexpr TiffLayout kTiff{4, 4, 2, 12, 8}, kBigTiff{8, 8, 8, 20, 12};

/// Reads tags 256 and 257 of the first directory, each a SHORT (3), a LONG (4) or, in BigTIFF, a
/// LONG8 (16). libtiff reads others, too, but no usual program writes them. Of a tag that occurs
/// twice the first counts, as in libtiff.
Size read_tiff_size(std::string_view bytes, const TiffLayout& layout) {
  const ByteOrder order = bytes[0] == 'M' ? ByteOrder::big : ByteOrder::little;
  const auto directory = read_number_at(bytes, layout.directory_at, layout.place_bytes, order);
  if (!directory || *directory < 0) return {};
  const auto start = static_cast<std::size_t>(*directory);
  const auto entries = read_number_at(bytes, start, layout.count_bytes, order);
  if (!entries || *entries < 0) return {};
  std::optional<std::int64_t> width, height;
  for (std::size_t i = 0; i < static_cast<std::size_t>(*entries); ++i) {
    const std::size_t entry = start + layout.count_bytes + i * layout.entry_bytes;
    const auto tag = read_number_at(bytes, entry, 2, order),
               type = read_number_at(bytes, entry + 2, 2, order);
    if (!tag || !type) return {};
    if (*tag != 256 && *tag != 257) continue;
    const std::size_t value_bytes = *type == 3 ? 2 : *type == 4 ? 4 : *type == 16 ? 8 : 0;
    if (value_bytes == 0 || value_bytes > layout.place_bytes) return {};
    auto& size = *tag == 256 ? width : height;
    if (!size) size = read_number_at(bytes, entry + layout.value_at, value_bytes, order);
    if (!size) return {};
  }
  return make_size(width, height);
}

/// Reads the size of a PBM, PGM or PPM: "P5", width and height, separated by white space and
/// comments.
Size read_pnm_size(std::string_view bytes) {
  std::size_t at = 2;
  const auto is_space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  const auto next = [&]() -> std::optional<std::int64_t> {
    while (at < bytes.size() && (is_space(bytes[at]) || bytes[at] == '#')) {
      at = bytes[at] == '#' ? std::min(bytes.find('\n', at), bytes.size()) : at + 1;
    }
    std::int64_t value = 0;
    const std::string_view remaining = bytes.substr(at);
    const auto [stop, failure] =
        std::from_chars(remaining.data(), remaining.data() + remaining.size(), value);
    // A number at the very end may be cut short.
    if (failure != std::errc() || stop == remaining.data() + remaining.size()) return {};
    at += static_cast<std::size_t>(stop - remaining.data());
    return value;
  };
  const auto width = next();
  return make_size(width, next());
}

/// Beginning of the files of an image format, and the reader of the size.
struct ImageFormat {
  std::string_view signature;
  Size (*read_size)(std::string_view bytes);
};

/// Returns the format of a file; nullptr for other files.
const ImageFormat* find_format(std::string_view bytes) {
  using namespace std::string_view_literals;
  constexpr auto tiff = [](std::string_view file) { return read_tiff_size(file, kTiff); };
  constexpr auto big_tiff = [](std::string_view file) { return read_tiff_size(file, kBigTiff); };
  static constexpr std::array formats{ImageFormat{"\x89PNG\r\n\x1a\n"sv, read_png_size},
                                      ImageFormat{"\xff\xd8"sv, read_jpeg_size},
                                      ImageFormat{"BM"sv, read_bmp_size},
                                      ImageFormat{"II*\0"sv, tiff},
                                      ImageFormat{"MM\0*"sv, tiff},
                                      ImageFormat{"II+\0"sv, big_tiff},
                                      ImageFormat{"MM\0+"sv, big_tiff},
                                      ImageFormat{"P1"sv, read_pnm_size},
                                      ImageFormat{"P2"sv, read_pnm_size},
                                      ImageFormat{"P3"sv, read_pnm_size},
                                      ImageFormat{"P4"sv, read_pnm_size},
                                      ImageFormat{"P5"sv, read_pnm_size},
                                      ImageFormat{"P6"sv, read_pnm_size}};
  const auto* const found = std::ranges::find_if(
      formats, [&](const ImageFormat& format) { return bytes.starts_with(format.signature); });
  return found == formats.end() ? nullptr : found;
}

}  // namespace

bool has_image_signature(std::string_view bytes) { return find_format(bytes) != nullptr; }

Size read_header_size(std::string_view bytes) {
  const ImageFormat* const format = find_format(bytes);
  return format == nullptr ? Size() : format->read_size(bytes);
}

void check_megapixels(const fs::path& file, std::int64_t width, std::int64_t height,
                      double max_mpx) {
  constexpr double million = 1e6;
  if (static_cast<double>(width) * static_cast<double>(height) <= max_mpx * million) return;
  throw InputError(
      file, "is " + std::to_string(width) + " x " + std::to_string(height) + " px, more than the " +
                format_exact_number(max_mpx) +
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
    // [FILE-7] `cannot be read as an image` | damaged, raw, or of another format; other images are
    //   used | save in a listed format
    throw InputError(
        file, has_image_signature(bytes)
                  ? "cannot be read as an image: it is cut short or damaged"
                  : "cannot be read as an image: it is not PNG, JPEG, BMP, TIFF, PBM, PGM or PPM");
  }
  check_megapixels(file, (*size)[0], (*size)[1], max_mpx);
  if (is_cut_png(bytes)) throw InputError(file, cut);
  cv::Mat image;
  try {
    image = decode_gray_image(bytes);
  } catch (const cv::Exception& failure) {
    throw InputError(file, "cannot be read as an image: " + failure.err);
  }
  if (image.empty()) throw InputError(file, "cannot be read as an image");
  check_megapixels(file, image.cols, image.rows, max_mpx);
  if (image.depth() != CV_8U && image.depth() != CV_16U) {
    throw InputError(file, "has neither 8 nor 16 bits");
  }
  return image;
}

bool has_file_extension(const fs::path& file, std::initializer_list<std::string_view> extensions) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(extensions, extension) != extensions.end();
}

bool is_image_file_name(const fs::path& file) {
  return has_file_extension(file, {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"});
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw InputError(folder, "is not a folder of images");
  std::vector<fs::path> images;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code no_file;  // a folder, a pipe, a link that leads nowhere
    if (entry->is_regular_file(no_file) && is_image_file_name(entry->path()))
      images.push_back(entry->path());
  }
  // [FILE-1]
  if (error) throw InputError(folder, "cannot be read: " + error.message());
  if (images.empty()) {
    // [FILE-7] `contains no image`
    throw InputError(folder, "contains no image (.png, .jpg, .bmp, .tif or .pgm)");
  }
  std::sort(images.begin(), images.end());
  return images;
}

std::vector<fs::path> expand_folders(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    if (!fs::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    const auto inside = list_images(name);
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

}  // namespace vlp
