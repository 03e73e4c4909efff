// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/core.h>

#include "captures/digest.h"
#include "detection/images_in_parallel.h"
#include "rig/input_error.h"
#include "session/leaning_captures.h"
#include "session/session_folder.h"
#include "station/unit/lamp_faults.h"
#include "station/unit/station_steps.h"
#include "station/unit/turn_map.h"

namespace vlp {

namespace {

namespace fs = std::filesystem;

/// As UnitImage has it.
Eigen::Matrix3d level_in(const LevelsOfImages& levels, const std::string& image) {
  const auto level = levels.find(image);
  return level == levels.end() ? Eigen::Matrix3d::Zero().eval() : level->second.value();
}

}  // namespace

Unit::Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads)
    : config_(config),
      camera_id_(std::move(camera_id)),
      program_(std::move(program)),
      threads_(threads),
      boards_(std::make_unique<BoardDetector>(config.board)) {}
Unit::~Unit() = default;

void Unit::reread(StationStep step) {
  if (step != StationStep::dispersion && step != StationStep::check) return;
  look_again(step);
  at(step).result.reset();
  forget_after(step);
}

/// At the images whose inclination is told otherwise by now. They were counted when they came.
void Unit::look_again(StationStep step) {
  const LevelsOfImages levels = levels_of(step);
  UnitStep& state = at(step);
  std::vector<fs::path> again;
  for (const auto& [name, image] : state.images) {
    if (!image.discarded && level_in(levels, name) != image.level) again.push_back(image.file);
  }
  if (again.empty() || !calibration_before(step)) return;
  const int refused = state.refused_together;
  const bool used = state.used_together;
  look(step, again);
  state.refused_together = refused;
  state.used_together = used;
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

namespace fs = std::filesystem;

void Unit::add(StationStep step, const std::vector<fs::path>& files, bool more_to_come) {
  UnitStep& state = at(step);
  if (files.empty()) return;
  state.folder = files.front().parent_path();
  if (!calibration_before(step)) {
    state.waiting.insert(state.waiting.end(), files.begin(), files.end());
    return;
  }
  look(step, files);
  if (!more_to_come) count_refusals(step);
}

/// In a row, of all that came together.
void Unit::count_refusals(StationStep step) {
  UnitStep& state = at(step);
  const int refused = std::exchange(state.refused_together, 0);
  const bool used = std::exchange(state.used_together, false);
  state.refused_in_a_row = used ? 0 : state.refused_in_a_row + refused;
}

/// Of the captures whose inclination is told, but for those of the turn, whose axis is level.
LevelsOfImages Unit::levels_of(StationStep step) const {
  if (step != StationStep::dispersion && step != StationStep::check) return {};
  const auto calibration = calibration_before(step);
  if (!calibration) return {};
  try {
    return levels_told(captures_table(this->step(step).folder), *calibration, 0);
  } catch (const InputError&) {  // the step will say so
    return {};
  }
}

void Unit::look(StationStep step, const std::vector<fs::path>& files) {
  std::vector<UnitImage> images(files.size());
  std::optional<LightDetector> lamps;
  if (step != StationStep::boards) {
    lamps.emplace(config_.lamps, detector_camera(*calibration_before(step)));
  }
  const LevelsOfImages levels = levels_of(step);
  images_in_parallel(files.size(), threads_, [&](std::size_t i) {
    if (!lamps) {
      images[i] = look_at_board(files[i], config_, *boards_);
      return;
    }
    const std::string name = files[i].filename().string();
    const auto leaning = leaning_detector(*lamps, levels, name);
    images[i] = look_at_lamps(files[i], config_, leaning ? *leaning : *lamps);
    images[i].level = level_in(levels, name);
  });
  for (UnitImage& image : images) {
    const std::string owner = owner_ && !image.sha256.empty() ? owner_(image.sha256) : "";
    if (!owner.empty()) image.refused = "already of " + owner;
    at(step).last = image.file.filename().string();
    take(step, std::move(image));
  }
}

void Unit::take(StationStep step, UnitImage image) {
  UnitStep& state = at(step);
  const std::string name = image.file.filename().string();
  drop(step, name);  // it was overwritten
  if (image.refused.empty()) {
    std::tie(image.superfluous, image.refused) = superfluity(step, image);
  }
  const bool used = image.refused.empty();
  const bool fault = !used && image.superfluous == Superfluous::no && !state.done();
  state.refused_together += fault ? 1 : 0;
  state.used_together = state.used_together || used;
  state.images.emplace(name, std::move(image));
  if (!used) return;
  state.result.reset();
  forget_after(step);
}

/// Whether and why a good image is not needed.
std::pair<Superfluous, std::string> Unit::superfluity(StationStep step,
                                                      const UnitImage& image) const {
  for (const UnitStep& any : steps_) {
    for (const auto& [name, other] : any.images) {
      if (!other.refused.empty() || other.sha256 != image.sha256) continue;
      return {Superfluous::same_pose, "same image as " + name};
    }
  }
  const double near_px = config_.refuse.same_pose_share * config_.type.imager_px[0];
  for (const auto& [name, other] : this->step(step).images) {
    if (!other.refused.empty()) continue;
    const bool same =
        step == StationStep::boards
            ? same_pose(image.view->seen, other.view->seen, near_px)
            : step == StationStep::rotation && same_lamps(image.lamps, other.lamps, near_px);
    if (same) return {Superfluous::same_pose, "same pose as " + name};
  }
  if (!this->step(step).done()) return {Superfluous::no, ""};
  return {Superfluous::enough, "not needed: the step has enough"};
}

/// Takes an image out of its step, and with it what rests on it; those that it stood in the way of
/// get their turn.
void Unit::drop(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  const auto image = state.images.find(name);
  if (image == state.images.end()) return;
  const bool used = image->second.refused.empty();
  state.images.erase(image);
  if (!used) return;
  state.result.reset();
  forget_after(step);
  std::vector<UnitImage> again;
  for (const auto& [other, known] : state.images) {
    if (known.superfluous != Superfluous::no) again.push_back(known);
  }
  std::erase_if(state.images,
                [](const auto& known) { return known.second.superfluous != Superfluous::no; });
  for (UnitImage& known : again) {
    known.refused.clear();
    known.superfluous = Superfluous::no;
    take(step, std::move(known));
  }
}

void Unit::remove(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  std::erase_if(state.waiting, [&](const fs::path& file) { return file.filename() == name; });
  if (state.images.contains(name)) state.refused_in_a_row = 0;
  drop(step, name);
}

void Unit::discard(StationStep step, const std::string& name) {
  UnitStep& state = at(step);
  const auto image = state.images.find(name);
  if (image == state.images.end() || image->second.refused.empty()) return;
  state.refused_in_a_row = 0;
  if (image->second.superfluous != Superfluous::no) {
    state.images.erase(image);
  } else {
    image->second.discarded = true;
  }
}

/// What rests on a step is looked at anew with what will come of it.
void Unit::forget_after(StationStep step) {
  for (const StationStep later : kStationSteps) {
    if (later <= step) continue;
    UnitStep& state = at(later);
    for (const auto& [name, image] : state.images) {
      if (!image.discarded) state.waiting.push_back(image.file);
    }
    std::erase_if(state.images, [](const auto& image) { return !image.second.discarded; });
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
        result = solve_boards(config_, camera_id_, views_of(state, config_.board));
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

std::optional<Calibration> Unit::calibration() const {
  std::optional<Calibration> last;
  for (const UnitStep& state : steps_) {
    if (state.result && state.result->ok()) last = state.result->calibration;
  }
  return last;
}

std::vector<CheckedMetric> Unit::figures() const {
  std::vector<Metric> values;
  if (const auto blur_px = typical_blur_px(step(StationStep::boards))) {
    values.push_back({"blur_px", *blur_px});
  }
  for (const UnitStep& state : steps_) {
    if (!state.result) continue;
    values.insert(values.end(), state.result->metrics.begin(), state.result->metrics.end());
  }
  return check_all(config_.gates, values, unit_metrics());
}

}  // namespace vlp
