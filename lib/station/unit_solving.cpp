// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Unit: what a step's images come to.
#include <fmt/core.h>

#include "captures/digest.h"
#include "rig/input_error.h"
#include "session/session_folder.h"
#include "station/station_steps.h"
#include "station/turn_map.h"
#include "station/unit.h"

namespace vlp {

bool Unit::has_enough(StationStep step) const {
  const UnitStep& state = this->step(step);
  const StationEnough& enough = config_.enough;
  switch (step) {
    case StationStep::boards:
      return state.used() >= enough.board_views &&
             board_coverage(state, config_.type.imager_px) >= enough.board_coverage;
    case StationStep::rotation:
      return turn_map(frames_of(state), config_, *calibration_before(step)).enough;
    case StationStep::dispersion:
      return state.used() >= enough.dispersion_captures;
    case StationStep::check:
      return state.used() >= enough.check_captures;
  }
  return false;
}

StepResult Unit::solve(StationStep step, bool all_in) const {
  const UnitStep& state = this->step(step);
  StepResult result;
  if (state.used() == 0) {
    result.fail(StepFailure::undetermined, "no image can be used");
    return result;
  }
  const Calibration before = *calibration_before(step);
  try {
    switch (step) {
      case StationStep::boards:
        result = solve_boards(config_, camera_id_, views_of(state));
        break;
      case StationStep::rotation:
        result = solve_rotation(config_, before, frames_of(state));
        break;
      case StationStep::dispersion:
        result = solve_dispersion(config_, before, frames_of(state), captures_in(state.folder));
        break;
      case StationStep::check:
        return check_fixes(config_, before, frames_of(state), captures_in(state.folder));
    }
  } catch (const InputError& error) {  // a table, maybe in the making
    if (all_in) throw;
    result.fail(StepFailure::bad_input, error.what());
    return result;
  }
  if (result.ok()) {
    HistoryEntry& entry = result.calibration.history.back();
    const std::string part = entry.part;
    entry = history_of(step);
    entry.part = part;
  }
  return result;
}

HistoryEntry Unit::history_of(StationStep step) const {
  std::string digests;
  for (const auto& [name, image] : this->step(step).images) {
    if (image.refused.empty()) digests += fmt::format("{}  {}\n", image.sha256, name);
  }
  return {"",
          program_.program,
          program_.version,
          "",
          {{"station", config_.sha256}, {name_of(step), sha256_of_text(digests)}}};
}

}  // namespace vlp
