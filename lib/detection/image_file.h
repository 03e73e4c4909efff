// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// An image as grey levels of 8 or 16 bits; colour is converted, and a turn that the file asks for
/// is not made, because the shutter does not turn. Throws InputError for what is no image.
cv::Mat read_image(const std::filesystem::path& file);

}  // namespace vlp
