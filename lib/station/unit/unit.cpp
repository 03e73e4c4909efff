// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/core.h>

#include "captures/digest.h"
#include "frontend/image_source.h"
#include "geometry/median.h"
#include "rig/input_error.h"
#include "session/dispersion_step.h"
#include "session/rotation_step.h"
#include "session/session_folder.h"
#include "station/unit/sensor_metrics.h"
#include "station/unit/unit_metrics.h"

namespace vlp {

namespace {

namespace fs = std::filesystem;

/// Returns UnitImage::level for an image.
Eigen::Matrix3d get_level_rotation(const LevelRotations& levels, const std::string& image) {
  const auto level = levels.find(image);
  return level == levels.end() ? Eigen::Matrix3d::Zero().eval() : level->second.value();
}

/// Returns the use of the images of a step.
ImageUse get_image_use(StationStep step) {
  if (step == StationStep::boards) return ImageUse::boards;
  return step == StationStep::rotation ? ImageUse::rotation : ImageUse::known_positions;
}

std::vector<fs::path> list_used_files(const UnitStep& step) {
  std::vector<fs::path> files;
  for (const UnitImage* image : list_used_images(step)) files.push_back(image->observation.file);
  return files;
}

void append_metrics(const std::vector<Metric>& metrics, StepResult& result) {
  result.metrics.insert(result.metrics.end(), metrics.begin(), metrics.end());
}

/// Returns the metric `lamp_blur_px`; empty without a lamp.
std::vector<Metric> measure_lamp_blur(const std::vector<const UnitImage*>& images) {
  constexpr double px_per_sigma = 1.349;  // from 25 % to 75 % of a Gaussian edge
  std::vector<double> sigmas_px;
  for (const UnitImage* image : images) {
    for (const Light& light : image->observation.lights) {
      if (light.kind == LightKind::lamp && has_outline(light))
        sigmas_px.push_back(light.rise_px / px_per_sigma);
    }
  }
  if (sigmas_px.empty()) return {};
  return {{"lamp_blur_px", upper_median(sigmas_px)}};
}

}  // namespace

Unit::Unit(const StationConfig& config, std::string camera_id, ProgramVersion program, int threads,
           std::optional<Calibration> known_calibration)
    : config_(config),
      camera_id_(std::move(camera_id)),
      program_(std::move(program)),
      threads_(threads),
      known_calibration_(std::move(known_calibration)),
      boards_(config.board, config.frontend, config.nominal_camera.imager_px) {}

void Unit::reprocess_step(StationStep step) {
  if (step != StationStep::dispersion && step != StationStep::check) return;
  reprocess_inclined(step);
  mutable_step_state(step).result.reset();
  reset_steps_after(step);
}

/// Processes the images again whose inclination changed. They are not counted again.
void Unit::reprocess_inclined(StationStep step) {
  const LevelRotations levels = list_level_rotations(step);
  UnitStep& state = mutable_step_state(step);
  std::vector<fs::path> again;
  for (const auto& [name, image] : state.images) {
    if (!image.discarded && get_level_rotation(levels, name) != image.level)
      again.push_back(image.observation.file);
  }
  if (again.empty() || !calibration_before(step)) return;
  const int refused = state.num_rejected_in_batch;
  const bool used = state.is_any_used_in_batch;
  process_files(step, again);
  state.num_rejected_in_batch = refused;
  state.is_any_used_in_batch = used;
}

void Unit::solve_completed(bool all_in) {
  solve_in_order(all_in);
  row_time_ =
      check_row_time(list_lamp_observations(*this), config_.lamps, make_given_row_time(config_));
}

void Unit::solve_in_order(bool all_in) {
  for (const StationStep step : kStationSteps) {
    UnitStep& state = mutable_step_state(step);
    if (!calibration_before(step)) return;
    const auto waiting = std::exchange(state.pending_images, {});
    if (!waiting.empty()) {
      process_files(step, waiting);
      count_rejections(step);
    }
    if (known_calibration_ && state.images.empty()) continue;
    if (state.result && (state.result->has_succeeded() || !all_in)) continue;
    state.sufficient = has_sufficient_images(step);
    if (!state.sufficient && !all_in) return;
    state.result = compute_step_result(step, all_in);
    state.plot = state.result->drawing ? render_plot_async(state.result->drawing) : StepPlot{};
    if (!state.result->has_succeeded() && !known_calibration_) return;
  }
}

std::optional<Calibration> Unit::calibration_before(StationStep step) const {
  if (step == StationStep::boards) return Calibration{};
  if (known_calibration_) return known_calibration_;
  const UnitStep& before = steps_[step_index(step) - 1];
  if (!before.result || !before.result->has_succeeded()) return std::nullopt;
  return before.result->calibration;
}

std::optional<StationStep> Unit::first_incomplete() const {
  for (const StationStep step : kStationSteps) {
    if (!this->step_state(step).is_step_solved()) return step;
  }
  return std::nullopt;
}

std::vector<ReportPlot> Unit::collect_plots() const {
  std::vector<ReportPlot> pictures;
  for (const UnitStep& state : steps_) {
    if (!state.result || !state.plot.valid()) continue;
    if (const auto& picture = state.plot.get()) pictures.push_back(*picture);
  }
  return pictures;
}

bool Unit::can_no_longer_pass() const {
  const auto step = first_incomplete();
  if (!step) return false;
  const UnitStep& state = this->step_state(*step);
  if (state.num_consecutive_rejections >= config_.max_consecutive_rejections) return true;
  const bool stuck = state.sufficient && state.result && !state.result->has_succeeded();
  if (!stuck || *step == StationStep::boards) return false;
  const auto frames = list_used_detections(state);
  const Calibration known = *calibration_before(*step);
  return !list_map_contradictions(frames, config_.lamps, known).empty() ||
         !list_missing_lamps(frames, config_.lamps).empty() ||
         !rank_lamp_causes(list_lamp_captures(*this), config_.lamps, known).empty();
}

void Unit::add_step_images(StationStep step, const std::vector<fs::path>& files,
                           bool more_to_come) {
  UnitStep& state = mutable_step_state(step);
  if (files.empty()) return;
  state.folder = files.front().parent_path();
  if (!calibration_before(step)) {
    state.pending_images.insert(state.pending_images.end(), files.begin(), files.end());
    return;
  }
  process_files(step, files);
  if (!more_to_come) count_rejections(step);
}

/// Updates the number of consecutive rejections after a batch.
void Unit::count_rejections(StationStep step) {
  UnitStep& state = mutable_step_state(step);
  const int refused = std::exchange(state.num_rejected_in_batch, 0);
  const bool used = std::exchange(state.is_any_used_in_batch, false);
  state.num_consecutive_rejections = used ? 0 : state.num_consecutive_rejections + refused;
}

/// Returns the rotations of captures of known inclination. Those of the rotation step have none,
/// because its axis is vertical.
LevelRotations Unit::list_level_rotations(StationStep step) const {
  if (step != StationStep::dispersion && step != StationStep::check) return {};
  const auto calibration = calibration_before(step);
  if (!calibration) return {};
  try {
    return compute_level_rotations(read_folder_captures(this->step_state(step).folder),
                                   *calibration, 0);
  } catch (const InputError&) {  // reported by the step
    return {};
  }
}

void Unit::process_files(StationStep step, const std::vector<fs::path>& files) {
  std::vector<UnitImage> images(files.size());
  const LevelRotations levels = list_level_rotations(step);
  std::optional<LampIntake> lamps;
  if (step != StationStep::boards) {
    lamps.emplace(LightDetector(config_.lamps, make_detector_camera(*calibration_before(step))),
                  get_image_use(step), config_.frontend, config_.nominal_camera.imager_px, levels);
  }
  process_images(files.size(), threads_, [&](std::size_t i) {
    images[i] = observe_unit_image(files[i], [&](const SourceImage& source) {
      return lamps ? lamps->detect_lamps_in_image(source) : boards_.detect_board(source);
    });
    images[i].level = get_level_rotation(levels, images[i].observation.image_file_name());
  });
  for (UnitImage& image : images) {
    const auto owner = owner_ && !image.sha256.empty() ? owner_(image.sha256) : std::nullopt;
    if (owner) {
      image.observation.reject(RejectionReason::used_elsewhere,
                               "already of " + describe_image_user(*owner, config_.file));
    }
    mutable_step_state(step).last_image = image.observation.image_file_name();
    add_image_to_step(step, std::move(image));
  }
}

void Unit::add_image_to_step(StationStep step, UnitImage image) {
  UnitStep& state = mutable_step_state(step);
  const std::string name = image.observation.image_file_name();
  remove_image(step, name);  // it was overwritten
  if (image.is_image_used()) reject_if_redundant(step, image);
  const bool used = image.is_image_used();
  const bool fault = !used && !image.is_image_redundant() && !state.is_step_solved();
  state.num_rejected_in_batch += fault ? 1 : 0;
  state.is_any_used_in_batch = state.is_any_used_in_batch || used;
  state.images.emplace(name, std::move(image));
  if (!used) return;
  state.result.reset();
  reset_steps_after(step);
}

/// Rejects an image without a fault that is redundant. It has the content of an image of any step,
/// shows the same as an image of this step, or the step is complete.
void Unit::reject_if_redundant(StationStep step, UnitImage& image) const {
  for (const UnitStep& any : steps_) {
    for (const UnitImage* other : list_used_images(any)) {
      if (image.sha256.empty() || other->sha256 != image.sha256) continue;
      return image.observation.reject(
          RejectionReason::same_image,
          "is the same image as " + other->observation.image_file_name());
    }
  }
  Selection selection(get_image_use(step), config_.frontend);
  for (const UnitImage* other : list_used_images(this->step_state(step)))
    selection.add_kept_image(other->observation);
  selection.add_or_reject(image.observation);
  if (!image.is_image_used() || !this->step_state(step).is_step_solved()) return;
  image.observation.reject(RejectionReason::not_needed, "not needed: the step has enough");
}

/// Removes an image and the results that depend on it. Images that were redundant because of it are
/// used again.
void Unit::remove_image(StationStep step, const std::string& name) {
  UnitStep& state = mutable_step_state(step);
  const auto image = state.images.find(name);
  if (image == state.images.end()) return;
  const bool used = image->second.is_image_used();
  state.images.erase(image);
  if (!used) return;
  state.result.reset();
  reset_steps_after(step);
  std::vector<UnitImage> again;
  for (const auto& [other, known] : state.images) {
    if (known.is_image_redundant()) again.push_back(known);
  }
  std::erase_if(state.images, [](const auto& known) { return known.second.is_image_redundant(); });
  for (UnitImage& known : again) {
    known.observation.rejection.reset();
    add_image_to_step(step, std::move(known));
  }
}

void Unit::remove_deleted(StationStep step, const std::string& name) {
  UnitStep& state = mutable_step_state(step);
  std::erase_if(state.pending_images,
                [&](const fs::path& file) { return file.filename() == name; });
  if (state.images.contains(name)) state.num_consecutive_rejections = 0;
  remove_image(step, name);
}

void Unit::mark_image_discarded(StationStep step, const std::string& name) {
  UnitStep& state = mutable_step_state(step);
  const auto image = state.images.find(name);
  if (image == state.images.end() || image->second.is_image_used()) return;
  state.num_consecutive_rejections = 0;
  if (image->second.is_image_redundant()) {
    state.images.erase(image);
  } else {
    image->second.discarded = true;
  }
}

/// Resets the later steps; their images are processed again with the new result.
void Unit::reset_steps_after(StationStep step) {
  for (const StationStep later : kStationSteps) {
    if (later <= step) continue;
    UnitStep& state = mutable_step_state(later);
    for (const auto& [name, image] : state.images) {
      if (!image.discarded) state.pending_images.push_back(image.observation.file);
    }
    std::erase_if(state.images, [](const auto& image) { return !image.second.discarded; });
    state.result.reset();
    state.sufficient = false;
  }
}

bool Unit::has_sufficient_images(StationStep step) const {
  const UnitStep& state = this->step_state(step);
  const CompletionCriteria& completion = config_.completion;
  switch (step) {
    case StationStep::boards:
      return state.count_used_images() >= completion.board_views &&
             compute_board_coverage(state, config_.nominal_camera.imager_px).covered_fraction() >=
                 completion.board_coverage;
    case StationStep::rotation:
      return compute_yaw_coverage(list_used_detections(state), config_, *calibration_before(step))
          .sufficient;
    case StationStep::dispersion:
      return state.count_used_images() >= completion.dispersion_captures;
    case StationStep::check:
      return state.count_used_images() >= completion.check_captures;
  }
  return false;
}

StepResult Unit::run_step(StationStep step, const Calibration& before) const {
  const UnitStep& state = this->step_state(step);
  if (step == StationStep::boards) {
    LensInput input{list_observations(state), config_.board, {}, config_.nominal_camera};
    input.camera.id = camera_id_;
    LensResult lens = run_lens_step(std::move(input), make_step_entry(step));
    if (lens.has_succeeded()) add_nominal_differences(config_.nominal_camera, lens);
    append_metrics(measure_board_levels(list_used_files(state)), lens);
    return lens;
  }
  const LampCaptures captures{list_used_detections(state), config_.lamps, "lamp map", before};
  if (step == StationStep::rotation) {
    StepResult result = run_rotation_step(captures, RotationMethod::axis, make_step_entry(step));
    append_metrics(measure_sensor(list_used_files(state),
                                  list_used_files(this->step_state(StationStep::boards))),
                   result);
    append_metrics(measure_lamp_blur(list_used_images(state)), result);
    return result;
  }
  const CapturesTable places = read_captures_with_truth(state.folder);
  if (step == StationStep::check) return run_check_step(config_, before, captures.frames, places);
  const KnownPositions known =
      collect_known_captures(captures.frames, places, config_.dispersion_position_m);
  StepResult result = check_known_positions(known.captures.size(), captures.frames.size(),
                                            config_.completion.dispersion_captures);
  if (!result.has_succeeded()) return result;
  return run_dispersion_step(captures, known, DispersionMethod::camera, DispersionCircle::mean,
                             make_step_entry(step));
}

StepResult Unit::compute_step_result(StationStep step, bool all_in) const {
  StepResult result;
  if (this->step_state(step).count_used_images() == 0) {
    result.set_step_failure(StepFailure::undetermined, "no image can be used");
    return result;
  }
  try {
    result = run_step(step, *calibration_before(step));
  } catch (const InputError& error) {  // the table may be incomplete
    if (all_in) throw;
    result.set_step_failure(StepFailure::bad_input, error.what());
  }
  // The operator has to repeat captures that do not fit, such as those of another camera.
  if (result.has_succeeded() && !result.inconsistent_captures.empty())
    result.set_step_failure(StepFailure::undetermined, result.inconsistent_captures);
  return result;
}

HistoryEntry Unit::make_step_entry(StationStep step) const {
  std::string digests;
  for (const auto& [name, image] : this->step_state(step).images) {
    if (image.is_image_used()) digests += fmt::format("{}  {}\n", image.sha256, name);
  }
  return {"",
          program_.program,
          program_.version,
          "",
          {{"station", config_.sha256}, {station_step_name(step), hash_text(digests)}}};
}

std::vector<Observation> list_lamp_observations(const Unit& unit) {
  std::vector<Observation> images;
  for (const StationStep step : kStationSteps) {
    if (step == StationStep::boards) continue;
    std::ranges::move(list_observations(unit.step_state(step)).images, std::back_inserter(images));
  }
  return images;
}

std::vector<StepCaptures> list_lamp_captures(const Unit& unit) {
  std::vector<StepCaptures> captures;
  for (const StationStep step : kStationSteps) {
    const UnitStep& state = unit.step_state(step);
    if (step == StationStep::boards || state.images.empty()) continue;
    captures.push_back({station_step_name(step), list_used_detections(state)});
    // A table that cannot be read is the step's problem.
    const bool is_read = state.result && state.result->has_succeeded();
    if (step != StationStep::rotation && is_read)
      captures.back().positions = read_captures_with_truth(state.folder);
  }
  return captures;
}

GivenRowTime make_given_row_time(const StationConfig& config) {
  return {config.nominal_camera.row_time_s.value(), config.type_file};
}

std::optional<Calibration> Unit::latest_calibration() const {
  std::optional<Calibration> last;
  for (const UnitStep& state : steps_) {
    if (state.result && state.result->has_succeeded()) last = state.result->calibration;
  }
  return last;
}

std::vector<CheckedMetric> Unit::collect_metrics() const {
  std::vector<Metric> values;
  if (const auto blur_px = compute_median_blur_px(step_state(StationStep::boards))) {
    values.push_back({"blur_px", *blur_px});
  }
  for (const UnitStep& state : steps_) {
    if (!state.result) continue;
    values.insert(values.end(), state.result->metrics.begin(), state.result->metrics.end());
  }
  const auto row_time = make_row_time_metrics(row_time_);
  values.insert(values.end(), row_time.begin(), row_time.end());
  return check_against_gates(config_.gates, values, list_unit_metrics());
}

}  // namespace vlp
