// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/gate.h"
#include "frontend/options.h"
#include "rig/board.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Completion criteria of the steps.
struct CompletionCriteria {
  int board_views = 36;
  /// Required fraction, 0 to 1, of 8 x 6 equal cells of the image that contain corners of the board
  /// in at least one view.
  double board_coverage = 0.6;
  /// Number of captures at each height of the rotation, number of heights, and angular range
  /// covered at each height.
  int rotation_captures = 12;
  int rotation_heights = 2;
  double rotation_arc_rad = 5.2;
  int dispersion_captures = 40;
  int check_captures = 36;
};

/// Reference camera of `vlp-station verify`.
struct GoldenUnit {
  std::string camera_id;
  Calibration calibration;
  std::vector<Gate> gates;
};

/// Command of the factory that runs after each verdict, for example to print labels, to update the
/// factory's system, or to write to the device.
struct Hook {
  /// Path of the program and its arguments, passed without a shell.
  std::vector<std::string> command;
  /// Working directory of the command.
  std::filesystem::path folder;
  /// Time limit, s. The command and all processes of its group are killed when it is exceeded.
  double time_limit_s = 30;
};

/// Limits after which the golden unit has to be measured again.
struct VerificationInterval {
  std::optional<double> hours;
  /// Number of units judged since the last measurement of the golden unit.
  std::optional<int> units;
};

/// Retention times of the files of a run, in days; without a value they are kept forever. The
/// record of a run is always kept.
struct Retention {
  std::optional<int> images_days, results_days;
};

/// Configuration of a station for one type of camera, `vlp-station/1`. Relative file names in it
/// refer to its folder.
struct StationConfig {
  std::string station;
  /// File of this configuration, as given.
  std::filesystem::path file;
  /// Type of the cameras: imager, lens model, row time and readout, with the nominal lens as
  /// intrinsics.
  Camera nominal_camera;
  /// File name of `type`, for messages.
  std::string type_file;
  Board board;
  LampMap lamps;
  /// Position (x, y) of the camera in the world in the step `dispersion`, unless its captures.csv
  /// contains positions.
  std::optional<Eigen::Vector2d> dispersion_position_m;
  CompletionCriteria completion;
  /// Acceptance limits of images.
  FrontendOptions frontend;
  /// Number of consecutive rejected images after which a step is aborted.
  int max_consecutive_rejections = 12;
  /// Gates, with guard bands if `guard_bands` contains standard uncertainties.
  std::vector<Gate> gates;
  std::optional<GoldenUnit> golden_unit;
  /// Limits after which the golden unit has to be measured again; std::nullopt: none. Requires a
  /// golden unit.
  std::optional<VerificationInterval> verification_interval;
  /// ECMAScript regular expression that the whole serial of a unit must match; empty if every
  /// serial is valid.
  std::string serial_pattern;
  /// Operators who may void runs of this station; empty if all may.
  std::vector<std::string> void_operators = {};
  /// Folder in which the images of a unit arrive, as CAPTURES/CAMERA/STEP/, and folder of the
  /// results.
  std::filesystem::path captures, results;
  /// Database of the records: SQLite file, or postgresql:// address.
  std::string records;
  /// Input files: station.yaml, then the files named in it.
  std::vector<std::filesystem::path> inputs = {};
  /// SHA-256 of the digests of `inputs`.
  std::string sha256;
  /// Folder of the runs that are not yet delivered to the records. Default: `spool` next to
  /// station.yaml.
  std::filesystem::path spool;
  std::optional<Hook> hook;
  Retention retention;
};

/// Returns the reason why a text is no valid camera id, which names folders; empty if it is valid.
std::string describe_camera_id_problem(const std::string& camera_id);

/// Returns the reason why a text is no valid serial of a unit of the station; empty if it is valid.
/// A serial names folders. Comparing it with `serial_pattern` must not take too long.
std::string describe_serial_problem(const StationConfig& config, const std::string& serial);

/// Returns the metrics of a unit, including all metrics that its gates can limit.
std::vector<MetricKind> list_unit_metrics();

/// Reads a station's configuration.
///
/// Throws InputError with file, line and key for
/// - unknown or missing keys and implausible values,
/// - a gate of an unknown metric,
/// - a guard band of a metric without a gate, or one that leaves no acceptable value,
/// - a camera type or a golden unit without row time or readout.
StationConfig read_station_config(const std::filesystem::path& file);

/// Computes the SHA-256 of the parsed configuration that affects measurements and verdicts.
///
///   included  camera type, board, lamp map, position, completion and rejection limits, gates with
///             guard bands, golden unit
///   excluded  name of the station, `verify_due`, serials, folders, records, spool, hook, retention
///
/// Format, comments, order and names of files do not change it.
std::string hash_settings(const StationConfig& config);

}  // namespace vlp
