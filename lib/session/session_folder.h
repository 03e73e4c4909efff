// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "captures/captures_table.h"
#include "captures/truth_table.h"

namespace vlp {

/// Tables of the captures in a folder:
///
///  - captures.csv holds the inclinations of captures and the places of the camera;
///  - truth.csv holds the places of the camera and takes precedence over captures.csv.
///
/// All functions throw InputError if a table cannot be read.

/// Reads the captures.csv of a folder. For images in truth.csv, positions are replaced by the
/// camera's positions in truth.csv, which have no standard deviation. Heights and yaws are replaced
/// where truth.csv has them. Images only in truth.csv are added. Returns rows by image name; an
/// empty table if neither file exists.
/// @throws InputError if a table cannot be read
CapturesTable read_captures_with_truth(const std::filesystem::path& folder);
/// Returns the table with the ground truth of the folder: truth.csv, or captures.csv if it has
/// places of the camera. Returns std::nullopt if neither exists.
std::optional<std::filesystem::path> find_truth_file(const std::filesystem::path& folder);
/// Returns the places in find_truth_file(): in the order of truth.csv, or in the order of the image
/// names for captures.csv, which need not have a place for every image.
/// @pre find_truth_file() returns a file
std::vector<TruthRow> read_truth_positions(const std::filesystem::path& folder);
/// Returns the places of the camera in a table, in the order of the image names. Omits captures
/// without one, and places of the axis of rotation.
std::vector<TruthRow> list_truth_positions(const CapturesTable& captures);

// clang-format off
/// Folder with the captures of a camera, which is only read:
///
///   lamps.yaml            the lamps, with their frequencies or with classifier.yaml
///   boards/, board.yaml   images of the board, and its geometry; or
///   camera.yaml           camera part of a calibration, which takes precedence over boards/
///   rotation/             captures of a rotation in place
///   dispersion/           captures at known places, at several yaws (optional)
///   check/                captures to locate and, with places, to evaluate (optional)
///   line-*/               captures along a straight line, with places (optional)
///   classifier.yaml       classifier of the lamps, by vlp-train (optional)
///   gates.yaml            limits of the metrics (optional)
///
/// Other files and folders are ignored.
// clang-format on
class SessionFolder {
 public:
  /// Opens the folder of a session. Throws InputError if a required file or folder is missing.
  explicit SessionFolder(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path lamp_map_file() const { return folder_ / "lamps.yaml"; }
  std::filesystem::path board_file() const { return folder_ / "board.yaml"; }
  std::filesystem::path boards_folder() const { return folder_ / "boards"; }
  std::filesystem::path rotation_folder() const { return folder_ / "rotation"; }
  std::optional<std::filesystem::path> camera_calibration_path() const {
    return find_entry("camera.yaml");
  }
  std::optional<std::filesystem::path> dispersion_folder() const {
    return find_entry("dispersion");
  }
  std::optional<std::filesystem::path> accuracy_check_folder() const { return find_entry("check"); }
  std::optional<std::filesystem::path> classifier_path() const {
    return find_entry("classifier.yaml");
  }
  std::optional<std::filesystem::path> gates_file() const { return find_entry("gates.yaml"); }
  /// Folders of the drives along a line with known places, sorted by name. Includes drives whose
  /// table cannot be read: their steps report the error.
  const std::vector<std::filesystem::path>& line_drive_folders() const { return lines_; }

 private:
  std::optional<std::filesystem::path> find_entry(const char* name) const;

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> lines_;
};

/// Returns true if `results` is the folder of the session or a folder of captures in it, where
/// results must not be written.
bool is_session_folder(const std::filesystem::path& session, const std::filesystem::path& results);

/// Returns the first and the last place of a drive, in m. Throws InputError if they are equal.
std::array<Eigen::Vector2d, 2> read_end_points(const std::filesystem::path& truth,
                                               const std::vector<TruthRow>& places);

}  // namespace vlp
