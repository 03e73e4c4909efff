// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vlp {

/// Checks that an image has at most `max_mpx` megapixels. Throws InputError otherwise.
void check_megapixels(const std::filesystem::path& file, std::int64_t width, std::int64_t height,
                      double max_mpx);

/// Returns true if `bytes` starts with the signature of PNG, JPEG, BMP, TIFF, PBM, PGM or PPM.
/// `bytes` is a file or its beginning.
bool has_image_signature(std::string_view bytes);

/// Parses width and height in pixels from the header of a PNG, JPEG, BMP, TIFF, PBM, PGM or PPM
/// file. The image is not decoded, because a file of a megabyte can contain gigapixels. Returns
/// std::nullopt for other files, and for files truncated before the size.
std::optional<std::array<std::int64_t, 2>> read_header_size(std::string_view bytes);

/// Reads an image as gray levels of 8 or 16 bits and converts color. The format is recognized by
/// the content: PNG, JPEG, BMP, TIFF, PBM, PGM or PPM. An orientation tag in the file is ignored,
/// because the readout direction does not rotate with it.
///
/// @throws InputError for other formats and damaged files. Before decoding also for images of more
///         than `max_mpx` megapixels, and for files longer than such an image can be or than 2 GiB
cv::Mat read_image(const std::filesystem::path& file,
                   double max_mpx = std::numeric_limits<double>::infinity());

/// Returns true if the file has one of the extensions, which are in lower case, as ".png".
bool has_file_extension(const std::filesystem::path& file,
                        std::initializer_list<std::string_view> extensions);

/// Returns true if the extension of the file name, in upper or lower case, is that of an image:
/// PNG, JPEG, BMP, TIFF or PGM. The file is not opened.
bool is_image_file_name(const std::filesystem::path& file);

/// Lists the images in a folder, sorted by name.
/// @throws InputError if it is no folder or contains no image
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Replaces each folder among the names by the images in it.
/// @throws InputError as list_images()
std::vector<std::filesystem::path> expand_folders(const std::vector<std::string>& names);

}  // namespace vlp
