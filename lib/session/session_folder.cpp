// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_folder.h"

#include <algorithm>

#include "rig/input_error.h"

namespace vlp {

namespace fs = std::filesystem;

CapturesTable captures_in(const fs::path& folder) {
  CapturesTable captures;
  if (fs::exists(folder / "captures.csv")) captures = read_captures(folder / "captures.csv");
  if (!fs::exists(folder / "truth.csv")) return captures;
  for (const TruthRow& row : read_truth(folder / "truth.csv")) {
    Capture& capture = captures[row.image];
    capture.x_m = row.xy_m.x();
    capture.y_m = row.xy_m.y();
    if (row.z_m) capture.z_m = row.z_m;
    if (row.yaw_rad) capture.yaw_rad = row.yaw_rad;
  }
  return captures;
}

std::optional<fs::path> truth_file(const fs::path& folder) {
  if (fs::exists(folder / "truth.csv")) return folder / "truth.csv";
  if (!fs::exists(folder / "captures.csv")) return std::nullopt;
  const CapturesTable captures = read_captures(folder / "captures.csv");
  const bool places = std::any_of(captures.begin(), captures.end(), [](const auto& capture) {
    return capture.second.x_m && capture.second.y_m;
  });
  return places ? std::optional(folder / "captures.csv") : std::nullopt;
}

SessionFolder::SessionFolder(const fs::path& folder) : folder_(folder) {
  if (!fs::is_directory(folder)) throw InputError(folder, "is not a folder of captures");
  const auto need = [&](const char* name) {
    if (!fs::exists(folder_ / name)) throw InputError(folder_ / name, "is missing");
  };
  need("lamps.yaml");
  need("rotation");
  if (camera()) return;
  if (!fs::exists(board()) && !fs::exists(boards())) {
    throw InputError(folder, "has neither boards with board.yaml nor camera.yaml");
  }
  need("board.yaml");
  need("boards");
}

std::optional<fs::path> SessionFolder::if_there(const char* name) const {
  return fs::exists(folder_ / name) ? std::optional(folder_ / name) : std::nullopt;
}

std::vector<fs::path> SessionFolder::lines() const {
  std::vector<fs::path> lines;
  for (const auto& entry : fs::directory_iterator(folder_)) {
    const bool line = entry.path().filename().string().starts_with("line-");
    if (line && entry.is_directory() && truth_file(entry.path())) lines.push_back(entry.path());
  }
  std::sort(lines.begin(), lines.end());
  return lines;
}

bool holds_captures(const fs::path& session, const fs::path& results) {
  std::error_code missing;
  if (fs::equivalent(results, session, missing)) return true;
  for (const auto& entry : fs::directory_iterator(session)) {
    const std::string name = entry.path().filename().string();
    const bool captures = name == "boards" || name == "rotation" || name == "dispersion" ||
                          name == "check" || name.starts_with("line-");
    if (captures && fs::equivalent(results, entry.path(), missing)) return true;
  }
  return false;
}

std::array<Eigen::Vector2d, 2> ends_of(const fs::path& truth, const std::vector<TruthRow>& places) {
  const std::array<Eigen::Vector2d, 2> ends_m{places.front().xy_m, places.back().xy_m};
  if (ends_m[0] == ends_m[1]) throw InputError(truth, "the drive ends where it begins");
  return ends_m;
}

}  // namespace vlp
