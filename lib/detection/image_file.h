// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace vlp {

/// Whether the name is that of an image, by its ending: PNG, JPEG, BMP, TIFF and PGM.
bool is_image_name(const std::filesystem::path& file);

/// The images in a folder by name: PNG, JPEG, BMP, TIFF and PGM. Throws InputError when it is no
/// folder or holds none.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Larger images than this are taken for a mistake: decoded they fill gigabytes.
inline constexpr double kUsualMaxMpx = 200;

/// Throws InputError when that is more than so many million pixels.
void check_size(const std::filesystem::path& file, std::int64_t width, std::int64_t height,
                double max_mpx);

/// An image as grey levels of 8 or 16 bits; colour is converted, and a turn that the file asks for
/// is not made, because the shutter does not turn. Throws InputError for what is no image, and,
/// before it is decoded, for what its header says is larger than so many million pixels.
cv::Mat read_image(const std::filesystem::path& file, double max_mpx = kUsualMaxMpx);

}  // namespace vlp
