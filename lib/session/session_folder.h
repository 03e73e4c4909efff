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

/// What is known of the captures in a folder: the rules.
///
///  - captures.csv tells the inclination of every capture that has one, and where the camera was;
///  - truth.csv tells where the camera was. Where both do, truth.csv holds.
///
/// Each throws InputError for a table that cannot be read.

/// captures.csv, with the places of truth.csv; empty without either.
CapturesTable captures_in(const std::filesystem::path& folder);
/// The table that fixes of the folder are held against: truth.csv, or captures.csv when that tells
/// places; nothing without.
std::optional<std::filesystem::path> truth_file(const std::filesystem::path& folder);
/// The places in it, in its order; captures.csv need not tell one of every image, and is in the
/// order of the images. Precondition: there is one.
std::vector<TruthRow> truth_in(const std::filesystem::path& folder);

// clang-format off
/// The folder of a camera's captures, which is only read:
///
///   lamps.yaml            the lamps, with their frequencies or with classifier.yaml
///   boards/, board.yaml   images of the board, and what it is; or
///   camera.yaml           the camera part of a calibration, which goes before them
///   rotation/             captures while the camera turns on the spot
///   dispersion/           at known places, turning (optional)
///   check/                to locate, and with places to evaluate (optional)
///   line-*/               each along a straight line, with places (optional)
///   classifier.yaml       what tells the lamps apart, by vlp-train (optional)
///   gates.yaml            what the figures have to keep to (optional)
///
/// Other files and folders are left alone.
// clang-format on
class SessionFolder {
 public:
  /// Throws InputError when something is missing.
  explicit SessionFolder(const std::filesystem::path& folder);

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path lamps() const { return folder_ / "lamps.yaml"; }
  std::filesystem::path board() const { return folder_ / "board.yaml"; }
  std::filesystem::path boards() const { return folder_ / "boards"; }
  std::filesystem::path rotation() const { return folder_ / "rotation"; }
  std::optional<std::filesystem::path> camera() const { return if_there("camera.yaml"); }
  std::optional<std::filesystem::path> dispersion() const { return if_there("dispersion"); }
  std::optional<std::filesystem::path> check() const { return if_there("check"); }
  std::optional<std::filesystem::path> classifier() const { return if_there("classifier.yaml"); }
  std::optional<std::filesystem::path> gates() const { return if_there("gates.yaml"); }
  /// Drives along a line whose places are known, by name; one whose table cannot be read is there,
  /// for its step to say so.
  const std::vector<std::filesystem::path>& lines() const { return lines_; }

 private:
  std::optional<std::filesystem::path> if_there(const char* name) const;

  std::filesystem::path folder_;
  std::vector<std::filesystem::path> lines_;
};

/// Whether a folder is a session's, or one of the captures in it: no place for results.
bool holds_captures(const std::filesystem::path& session, const std::filesystem::path& results);

/// The first and the last place of a drive. Throws InputError when they are one.
std::array<Eigen::Vector2d, 2> ends_of(const std::filesystem::path& truth,
                                       const std::vector<TruthRow>& places);

}  // namespace vlp
