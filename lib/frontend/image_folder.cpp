// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/image_folder.h"

#include <algorithm>
#include <cctype>

#include "rig/input_error.h"

namespace vlp {

namespace fs = std::filesystem;

bool has_extension(const fs::path& file, std::initializer_list<std::string_view> extensions) {
  std::string extension = file.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(extensions, extension) != extensions.end();
}

bool is_image_file_name(const fs::path& file) {
  return has_extension(file, {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"});
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
  if (error) throw InputError(folder, "cannot be read: " + error.message());
  if (images.empty()) {
    throw InputError(folder, "contains no image (.png, .jpg, .bmp, .tif or .pgm)");
  }
  std::sort(images.begin(), images.end());
  return images;
}

std::vector<fs::path> replace_folders_by_images(const std::vector<std::string>& names) {
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
