// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "rig/calibration.h"
#include "session/session.h"
#include "support/temporary_folder.h"

namespace vlp {

/// Copy of a rendered session with a given camera, in "session", and its results, in "results".
///
/// The session has camera.yaml (with the row time), lamps.yaml with six lamps, rotation/ (2 heights
/// of 4 captures), dispersion/ (4), check/ (6) and line-x/ (4). Its camera is that of truth().
class RenderedSession : public testing::Test {
 protected:
  RenderedSession();

  std::filesystem::path session_file(const std::string& name) const {
    return session_folder / name;
  }
  std::filesystem::path results_file(const std::string& name) const {
    return results_folder / name;
  }
  bool has_result(const std::string& name) const {
    return std::filesystem::exists(results_file(name));
  }
  std::string read_result(const std::string& name) const {
    return TemporaryFolder::read_content(results_file(name));
  }
  void write_session_file(const std::string& name, const std::string& content) const {
    folder.file("session/" + name, content);
  }
  /// Replaces the first occurrence of a text in a file of the session.
  void edit_session_file(const std::string& name, const std::string& from,
                         const std::string& to) const;
  /// Removes all captures of a folder of the session except the first `count`.
  void keep_captures(const std::string& captures_folder, std::size_t count) const;
  /// Writes camera.yaml with the true lens. Without a row time the session has the step row-time.
  void write_camera(std::optional<double> row_time_s = 3e-5) const;
  /// Replaces camera.yaml by images of the board.
  void add_boards_in_place_of_camera() const;

  SessionResult run() const { return run_session(session_folder, results_folder, options); }

  /// Returns the true calibration: camera and tilt.
  static Calibration truth();
  /// Returns an image taken at (1.3, 0, 0) m, from where only lamps 3 and 6 are visible.
  static std::filesystem::path rendered_capture_of_two_lamps();

  const TemporaryFolder folder;
  const std::filesystem::path session_folder = folder / "session";
  const std::filesystem::path results_folder = folder / "results";
  SessionOptions options;
};

/// Returns the names of the steps of a run.
std::vector<std::string> list_steps(const SessionResult& result);
/// Returns the names of the steps that were run, not reused.
std::vector<std::string> list_executed_steps(const SessionResult& result);
/// Returns the step with this name. Fails the test and returns an empty step if there is none.
SessionStep find_step(const SessionResult& result, const std::string& name);

}  // namespace vlp
