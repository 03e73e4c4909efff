// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_folder.h"

#include <algorithm>

#include "captures/id.h"
#include "rig/input_error.h"

namespace vlp {

namespace fs = std::filesystem;

CapturesTable read_captures_with_truth(const fs::path& folder) {
  CapturesTable captures = read_folder_captures(folder);
  if (!fs::exists(folder / "truth.csv")) return captures;
  for (const TruthRow& row : read_truth_table(folder / "truth.csv")) {
    Capture& capture = captures[row.image];
    capture.x_m = row.xy_m.x();
    capture.y_m = row.xy_m.y();
    if (row.z_m) capture.z_m = row.z_m;
    if (row.yaw_rad) capture.yaw_rad = row.yaw_rad;
    capture.measured_point = MeasuredPoint::camera;
    capture.position_sd_m.reset();
  }
  return captures;
}

std::optional<fs::path> find_truth_file(const fs::path& folder) {
  if (fs::exists(folder / "truth.csv")) return folder / "truth.csv";
  if (!fs::exists(folder / "captures.csv")) return std::nullopt;
  const CapturesTable captures = read_captures_csv(folder / "captures.csv");
  const bool places = std::any_of(captures.begin(), captures.end(), [](const auto& capture) {
    return capture.second.x_m && capture.second.y_m &&
           capture.second.measured_point == MeasuredPoint::camera;
  });
  return places ? std::optional(folder / "captures.csv") : std::nullopt;
}

std::vector<TruthRow> read_truth_positions(const fs::path& folder) {
  if (fs::exists(folder / "truth.csv")) return read_truth_table(folder / "truth.csv");
  return list_truth_positions(read_folder_captures(folder));
}

std::vector<TruthRow> list_truth_positions(const CapturesTable& captures) {
  std::vector<TruthRow> rows;
  for (const auto& [image, capture] : captures) {
    if (!capture.x_m || !capture.y_m || capture.measured_point == MeasuredPoint::axis) continue;
    rows.push_back({image, {*capture.x_m, *capture.y_m}, capture.z_m, capture.yaw_rad});
  }
  return rows;
}

namespace {

bool is_line_drive_folder(const fs::path& folder) {
  if (!folder.filename().string().starts_with("line-") || !fs::is_directory(folder)) return false;
  try {
    return find_truth_file(folder).has_value();
  } catch (const InputError&) {
    return true;
  }
}

}  // namespace

SessionFolder::SessionFolder(const fs::path& folder) : folder_(folder) {
  if (!fs::is_directory(folder)) throw InputError(folder, "is not a folder of captures");
  const auto need = [&](const char* name) {
    if (!fs::exists(folder_ / name)) throw InputError(folder_ / name, "is missing");
  };
  need("lamps.yaml");
  need("rotation");
  if (!camera_calibration_path() && !fs::exists(board_file()) && !fs::exists(boards_folder())) {
    throw InputError(folder, "has neither boards with board.yaml nor camera.yaml");
  }
  if (!camera_calibration_path()) {
    need("board.yaml");
    need("boards");
  }
  for (const auto& entry : fs::directory_iterator(folder_)) {
    if (!is_line_drive_folder(entry.path())) continue;
    const Id name(entry.path().filename().string(), folder_, "drive");  // used in names of outputs
    lines_.push_back(folder_ / name.id_text());
  }
  std::sort(lines_.begin(), lines_.end());
}

std::optional<fs::path> SessionFolder::find_entry(const char* name) const {
  return fs::exists(folder_ / name) ? std::optional(folder_ / name) : std::nullopt;
}

bool is_session_folder(const fs::path& session, const fs::path& results) {
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

std::array<Eigen::Vector2d, 2> read_end_points(const fs::path& truth,
                                               const std::vector<TruthRow>& places) {
  const std::array<Eigen::Vector2d, 2> ends_m{places.front().xy_m, places.back().xy_m};
  if (ends_m[0] == ends_m[1]) throw InputError(truth, "start and end of the drive are equal");
  return ends_m;
}

}  // namespace vlp
