// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace vlp {

/// Returns a folder of real captures; empty if it does not exist.
inline std::filesystem::path real_data(const char* folder) {
  const std::filesystem::path all = VLP_REAL_DATA_DIR;
  const bool exists = !all.empty() && std::filesystem::is_directory(all / folder);
  return exists ? all / folder : std::filesystem::path();
}

}  // namespace vlp
