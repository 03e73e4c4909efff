// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit.h"

#include <utility>

#include "station/lamp_faults.h"

namespace vlp {

Unit::Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads)
    : config_(config),
      camera_id_(std::move(camera_id)),
      program_(std::move(program)),
      threads_(threads),
      boards_(std::make_unique<BoardDetector>(config.board)) {}
Unit::~Unit() = default;

void Unit::reread(StationStep step) {
  if (step != StationStep::dispersion && step != StationStep::check) return;
  at(step).result.reset();
  forget_after(step);
}

void Unit::advance(bool all_in) {
  for (const StationStep step : kStationSteps) {
    UnitStep& state = at(step);
    if (!calibration_before(step)) return;
    const auto waiting = std::exchange(state.waiting, {});
    if (!waiting.empty()) {
      look(step, waiting);
      count_refusals(step);
    }
    if (state.result && (state.result->ok() || !all_in)) continue;
    state.enough = has_enough(step);
    if (!state.enough && !all_in) return;
    state.result = solve(step, all_in);
    state.picture = state.result->drawing ? draw_aside(state.result->drawing) : StepPicture{};
    if (!state.result->ok()) return;
  }
}

std::optional<Calibration> Unit::calibration_before(StationStep step) const {
  if (step == StationStep::boards) return Calibration{};
  const UnitStep& before = steps_[index(step) - 1];
  if (!before.result || !before.result->ok()) return std::nullopt;
  return before.result->calibration;
}

std::optional<StationStep> Unit::current() const {
  for (const StationStep step : kStationSteps) {
    if (!this->step(step).done()) return step;
  }
  return std::nullopt;
}

std::vector<ReportPicture> Unit::pictures() const {
  std::vector<ReportPicture> pictures;
  for (const UnitStep& state : steps_) {
    if (!state.result || !state.picture.valid()) continue;
    if (const auto& picture = state.picture.get()) pictures.push_back(*picture);
  }
  return pictures;
}

bool Unit::hopeless() const {
  const auto step = current();
  if (!step) return false;
  const UnitStep& state = this->step(*step);
  if (state.refused_in_a_row >= config_.refuse.in_a_row) return true;
  const bool stuck = state.enough && state.result && !state.result->ok();
  if (!stuck || *step == StationStep::boards) return false;
  const auto frames = frames_of(state);
  return !lamp_faults(frames, config_.lamps, *calibration_before(*step)).empty() ||
         !unseen_lamps(frames, config_.lamps).empty();
}

}  // namespace vlp
