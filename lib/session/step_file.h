// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "session/step_result.h"

namespace vlp {

/// Millimeters per meter, for the lengths in JSON.
inline constexpr double kMillimetersPerMeter = 1e3;

/// Record of a step, stored with its outputs so that an unchanged step is not run again.
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
nlohmann::ordered_json to_json(const StepResult& result);
/// Returns a checked gate in the form of session.json.
nlohmann::ordered_json to_json(const CheckedMetric& gate);

}  // namespace vlp
