// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace vlp {

/// Returns true if the file has one of the extensions, which are in lower case, as ".png".
bool has_extension(const std::filesystem::path& file,
                   std::initializer_list<std::string_view> extensions);

/// Returns true if the extension of the file name, in upper or lower case, is that of an image:
/// PNG, JPEG, BMP, TIFF or PGM. The file is not opened.
bool is_image_file_name(const std::filesystem::path& file);

/// Lists the images in a folder, sorted by name.
/// @throws InputError if it is no folder or contains no image
std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Replaces each folder among the names by the images in it.
/// @throws InputError as list_images()
std::vector<std::filesystem::path> replace_folders_by_images(const std::vector<std::string>& names);

}  // namespace vlp
