// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_folders.h"

#include <fmt/core.h>

#include "rig/input_error.h"

namespace vlp {

namespace fs = std::filesystem;

void create_station_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  // [FILE-1]
  if (error) throw InputError(folder, "cannot be made: " + error.message());
}

void require_space(const SharedFolder& folder, std::uintmax_t bytes) {
  constexpr double megabyte = 1e6;
  std::error_code error;
  const fs::space_info space = fs::space(folder.folder_path(), error);
  if (!error && space.available < bytes) {
    throw InputError(folder.folder_path(),
                     fmt::format("has room for {:.1f} MB, the results of a run may need "
                                 "{:.0f}: make room before the unit is begun",
                                 double(space.available) / megabyte, double(bytes) / megabyte));
  }
  constexpr const char* probe = ".writable";
  folder.replace_file(probe, "results can be written here\n");
  folder.remove_file(probe);
}

}  // namespace vlp
