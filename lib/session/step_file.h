// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "session/step_result.h"

namespace vlp {

/// In a metre, of what JSON has in mm.
inline constexpr double kMillimetres = 1e3;

/// How a step ended, kept beside its outputs so that it need not be run again.
struct KeptStep {
  /// Digest of all that the step depends on, and of what it wrote.
  std::string key, outputs;
  /// Without calibration and drawing.
  StepResult result;
};

/// Nothing when there is no such file, or it is not of this version of the toolbox.
std::optional<KeptStep> read_step(const std::filesystem::path& file);
/// Whole or not at all. Throws InputError.
void write_step(const std::filesystem::path& file, const KeptStep& step);

/// A result as it stands there and in session.json. Figures that are not finite are null.
nlohmann::ordered_json json_of(const StepResult& result);
nlohmann::ordered_json json_of(const CheckedMetric& gate);

}  // namespace vlp
