// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_record.h"

#include <fmt/core.h>

#include <utility>
#include <vector>

#include "captures/digest.h"
#include "rig/calibration_text.h"
#include "station/unit/unit_causes.h"

namespace vlp {

RunRecord make_unit_record(const Unit& unit, const std::string& run,
                           const ProgramVersion& program) {
  RunRecord record = make_record("unit", unit.config(), unit.camera_id(), run, program);
  if (const auto calibration = unit.calibration()) {
    record.calibration = calibration_text(*calibration);
  }
  record.metrics = unit.metrics();
  std::vector<Cause> causes = find_causes(unit);
  if (std::string problem = clock_problem(record); !problem.empty()) {
    causes.insert(causes.begin(), {std::move(problem), false});
  }
  record.set_verdict(causes);
  for (const StationStep step : kStationSteps) {
    for (const auto& [name, image] : unit.step(step).images) {
      std::string refused = image.refusal();
      if (image.discarded) refused.append(" (not kept)");
      record.images.push_back({.step = to_string(step),
                               .name = name,
                               .sha256 = image.sha256,
                               .refused = std::move(refused)});
    }
    for (const auto& file : unit.step(step).waiting) {
      record.images.push_back({.step = to_string(step),
                               .name = file.filename().string(),
                               .sha256 = sha256_of_file(file),
                               .refused = "not looked at: a step before is not done"});
    }
  }
  return record;
}

void reject_reused_images(RunRecord& record, const std::string& earlier,
                          const std::filesystem::path& station_file) {
  record.verdict = to_string(Verdict::invalid);
  record.causes = fmt::format(
      "all images are those of run {}, which is no repetition: take new ones, or '{}' if that run "
      "should not count\n{}",
      earlier, format_void_command(earlier, station_file), record.causes);
}

}  // namespace vlp
