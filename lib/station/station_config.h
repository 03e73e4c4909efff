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

/// What counts as enough for each step.
struct StationEnough {
  int board_views = 36;
  /// Share of 8 x 6 parts of the image in which the views have corners.
  double board_coverage = 0.6;
  /// Captures at each height of the turn, the heights, and the arc over which they go.
  int turn_captures = 12;
  int turn_heights = 2;
  double turn_arc_rad = 5.2;
  int dispersion_captures = 40;
  int check_captures = 36;
};

/// The reference camera of `verify`.
struct GoldenUnit {
  std::string camera_id;
  Calibration calibration;
  std::vector<Gate> gates;
};

/// A command of the factory's own that is told of each verdict: labels, the factory's system,
/// writing to the device.
struct Hook {
  /// Program and arguments, as they are, without a shell.
  std::vector<std::string> command;
  /// The folder in which it is run.
  std::filesystem::path folder;
  /// Killed when it takes longer, with all processes of its group.
  double time_limit_s = 30;
};

/// When the golden unit is to be measured again, at the latest.
struct VerifyDue {
  std::optional<double> hours;
  /// Units that were judged since.
  std::optional<int> units;
};

/// How long what of a run is kept beside its record, which stays; without a figure for ever.
struct Retention {
  std::optional<int> images_days, results_days;
};

/// A station for one type of camera: `vlp-station/1`. Files that it names are beside it, unless
/// their names begin with a slash.
struct StationConfig {
  std::string station;
  /// File of this configuration, as it was named.
  std::filesystem::path file;
  /// The camera's type: imager, lens model, row time, read-out, and as lens the nominal one.
  Camera type;
  /// File name of `type`, for messages.
  std::string type_file;
  Board board;
  LampMap lamps;
  /// Where the camera is in the step `dispersion` unless its captures.csv says it.
  std::optional<Eigen::Vector2d> dispersion_station_m;
  StationEnough enough;
  /// Limits of the images.
  FrontendOptions frontend;
  /// Number of images rejected in a row after which a step is given up.
  int max_rejected_in_a_row = 12;
  /// With guard bands where `guard_bands` states standard uncertainties.
  std::vector<Gate> gates;
  std::optional<GoldenUnit> golden;
  /// Only with a golden unit.
  std::optional<VerifyDue> verify_due;
  /// A regular expression of ECMAScript that the ids of units match as a whole; empty: any do.
  std::string serial_pattern;
  /// Operators who may void runs of this station; empty: all may.
  std::vector<std::string> void_operators = {};
  /// Folders: where the images of a unit arrive, as CAPTURES/CAMERA/STEP/, and where results go.
  std::filesystem::path captures, results;
  /// A file of SQLite, or postgresql://...
  std::string records;
  /// Files that are read: station.yaml, then those that it names.
  std::vector<std::filesystem::path> inputs = {};
  /// SHA-256 of the digests of `inputs`.
  std::string sha256;
  /// The folder in which runs wait for the records, `spool` beside the station unless it says
  /// another.
  std::filesystem::path spool;
  std::optional<Hook> hook;
  Retention keep;
};

/// Returns why a text cannot be a camera's id, which names folders; an empty string if it can.
std::string camera_id_problem(const std::string& camera_id);

/// Returns why a text cannot be the id of a unit of the station, which names folders, or that
/// `serial_pattern` takes too long to be compared with it; an empty string if it can.
std::string serial_problem(const StationConfig& config, const std::string& serial);

/// The metrics of a unit, and those that its gates can be of.
std::vector<MetricKind> unit_metrics();

/// Throws InputError with file, line and key: unknown or missing keys, figures that no station can
/// mean, a gate of a figure that there is not, a guard band of what is no gate or that leaves
/// nothing within it, a type or a golden unit without row time or read-out.
StationConfig read_station(const std::filesystem::path& file);

}  // namespace vlp
