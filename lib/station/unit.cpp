// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit.h"

#include <fmt/core.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>

#include "captures/digest.h"
#include "captures/in_parallel.h"
#include "station/lamp_faults.h"
#include "station/turn_map.h"

namespace vlp {

namespace fs = std::filesystem;

int UnitStep::used() const {
  return static_cast<int>(std::count_if(images.begin(), images.end(), [](const auto& image) {
    return image.second.refused.empty();
  }));
}

Unit::Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads)
    : config_(config),
      camera_id_(std::move(camera_id)),
      program_(std::move(program)),
      threads_(threads),
      boards_(std::make_unique<BoardDetector>(config.board)) {
  cv::setNumThreads(1);  // the images themselves go in parallel
}
Unit::~Unit() = default;

void Unit::add(StationStep step, const std::vector<fs::path>& files) {
  UnitStep& state = at(step);
  if (files.empty()) return;
  state.folder = files.front().parent_path();
  if (calibration_before(step)) return look(step, files);
  state.waiting.insert(state.waiting.end(), files.begin(), files.end());
}

void Unit::look(StationStep step, const std::vector<fs::path>& files) {
  std::vector<UnitImage> images(files.size());
  std::optional<LampDetector> lamps;
  if (step != StationStep::boards) {
    lamps.emplace(config_.lamps, detector_camera(*calibration_before(step)));
  }
  in_parallel(files.size(), threads_, [&](std::size_t i) {
    images[i] = lamps ? look_at_lamps(files[i], config_, *lamps)
                      : look_at_board(files[i], config_, *boards_);
  });
  for (UnitImage& image : images) take(step, std::move(image));
}

void Unit::take(StationStep step, UnitImage image) {
  UnitStep& state = at(step);
  const std::string name = image.file.filename().string();
  state.images.erase(name);
  if (image.refused.empty() && step == StationStep::boards) {
    const double near_px = config_.refuse.same_pose_share * config_.type.imager_px[0];
    for (const auto& [other, known] : state.images) {
      if (!known.refused.empty() || !same_pose(image.view->seen, known.view->seen, near_px)) {
        continue;
      }
      image.refused = "same pose as " + other;
      break;
    }
  }
  if (image.refused.empty() && step == StationStep::rotation) {
    const double near_px = config_.refuse.same_pose_share * config_.type.imager_px[0];
    for (const auto& [other, known] : state.images) {
      if (!known.refused.empty() || !same_lamps(image.lamps, known.lamps, near_px)) continue;
      image.refused = "same pose as " + other;
      break;
    }
  }
  if (image.refused.empty() && state.done()) image.refused = "not needed: the step has enough";
  const bool used = image.refused.empty();
  // A camera that rests is no fault.
  const bool fault = !used && !state.done() && !image.refused.starts_with("same pose");
  if (used || fault) state.refused_in_a_row = fault ? state.refused_in_a_row + 1 : 0;
  state.last = name;
  state.images.emplace(name, std::move(image));
  if (!used) return;
  state.result.reset();
  forget_after(step);
}

void Unit::remove(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  std::erase_if(state.waiting, [&](const fs::path& file) { return file.filename() == name; });
  const auto image = state.images.find(name);
  if (image == state.images.end()) return;
  const bool used = image->second.refused.empty();
  state.images.erase(image);
  state.refused_in_a_row = 0;
  if (!used) return;
  state.result.reset();
  forget_after(step);
}

/// What rests on a step is looked at anew with what will come of it.
void Unit::forget_after(StationStep step) {
  for (const StationStep later : kStationSteps) {
    if (later <= step) continue;
    UnitStep& state = at(later);
    for (const auto& [name, image] : state.images) state.waiting.push_back(image.file);
    state.images.clear();
    state.result.reset();
    state.enough = false;
  }
}

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

void Unit::advance(bool all_in) {
  for (const StationStep step : kStationSteps) {
    UnitStep& state = at(step);
    if (!calibration_before(step)) return;
    const auto waiting = std::exchange(state.waiting, {});
    if (!waiting.empty()) look(step, waiting);
    if (state.result) continue;
    state.enough = has_enough(step);
    if (!state.enough && !all_in) return;
    state.result = solve(step);
    if (!state.result->problem.empty()) return;
  }
}

StageResult Unit::solve(StationStep step) const {
  const UnitStep& state = this->step(step);
  if (state.used() == 0) return {"no image can be used"};
  StageResult result;
  if (step == StationStep::boards) {
    std::vector<BoardView> views;
    for (const auto& [name, image] : state.images) {
      if (image.refused.empty()) views.push_back(*image.view);
    }
    result = solve_boards(config_, camera_id_, views);
  } else {
    const Calibration calibration = *calibration_before(step);
    const auto frames = frames_of(state);
    CapturesTable places;
    for (const char* table : {"captures.csv", "truth.csv"}) {
      if (!places.empty() || !fs::exists(state.folder / table)) continue;
      places = read_captures(state.folder / table);
      std::erase_if(places, [](const auto& place) { return !place.second.x_m; });
    }
    if (step == StationStep::rotation) result = solve_rotation(config_, calibration, frames);
    if (step == StationStep::dispersion) {
      result = solve_dispersion(config_, calibration, frames, places);
    }
    if (step == StationStep::check) result = check_fixes(config_, calibration, frames, places);
  }
  if (result.problem.empty() && step != StationStep::check) {
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

std::optional<Calibration> Unit::calibration_before(StationStep step) const {
  if (step == StationStep::boards) return Calibration{};
  const UnitStep& before = steps_[index(step) - 1];
  if (!before.result || !before.result->problem.empty()) return std::nullopt;
  return before.result->calibration;
}

std::optional<StationStep> Unit::current() const {
  for (const StationStep step : kStationSteps) {
    if (!this->step(step).done()) return step;
  }
  return std::nullopt;
}

bool Unit::hopeless() const {
  const auto step = current();
  if (!step) return false;
  const UnitStep& state = this->step(*step);
  if (state.refused_in_a_row >= config_.refuse.in_a_row) return true;
  const bool stuck = state.enough && state.result && !state.result->problem.empty();
  const auto known = calibration_before(*step);
  return stuck && *step != StationStep::boards &&
         !lamp_faults(frames_of(state), config_.lamps, *known).empty();
}

}  // namespace vlp
