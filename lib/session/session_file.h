// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "session/session.h"

namespace vlp {

/// Millimeters per meter: factor of the lengths in JSON documents, which are in mm.
inline constexpr double kMillimetersPerMeter = 1e3;

/// Stored result of a step, with digests of its inputs and outputs. A later run reuses the result
/// if the digests are unchanged.
struct StepRecord {
  /// Digests of all inputs of the step and of its outputs.
  std::string key, outputs;
  /// Result without gates, details, calibration and drawing.
  StepResult result;
};

/// Reads the record of a step. Returns std::nullopt if the file is missing, damaged, or of another
/// format version.
std::optional<StepRecord> read_step_record(const std::filesystem::path& file);
/// Writes the record of a step atomically. Throws InputError if the file cannot be written.
void write_step_record(const std::filesystem::path& file, const StepRecord& step);

/// Returns a result in the form of the record and of session.json. Metrics that are not finite are
/// null.
nlohmann::ordered_json make_step_json(const StepResult& result);
/// Returns a checked gate in the form of session.json.
nlohmann::ordered_json make_gate_json(const CheckedMetric& gate);

/// Returns the content of `session.json`, the machine-readable result in format "vlp-session/2":
///   verdict      "pass", "gate" or "no result"
///   reason, failure ("none", "bad_input", "undetermined", ...), camera, version
///   metrics      each with step, name, value; unit, if the metric has a MetricKind; limit,
///                direction and passed, if a gate limits it
///   steps        each with name, warnings, notes, skipped images with reasons, rejected lamps with
///                their numbers of captures, offset of each lamp from the prediction by the others
///   calibration  focal length, principal point, tilt, lever arm, dispersion, in the unit at the
///                end of the key; zenith_deg is x/z and y/z of the zenith
///   history      inputs with their digests
/// Standard deviations (_sd_) cover the captures of the step alone; that of the zenith includes the
/// contribution of the lens. The file is written last: without it the results are those of a run
/// that was killed. The same run gives the same bytes.
std::string format_session(const SessionResult& result, const SessionOptions& options);

/// Returns the content of `junit.xml` for CI systems: a test for each step with its warnings, then
/// a test for each gate. A step without a result is an error of type SessionResult::failure, with
/// its message. A session that cannot be read is an error of a test named "session".
std::string format_session_junit(const SessionResult& result);

}  // namespace vlp
