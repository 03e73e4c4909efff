// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "captures/digest.h"
#include "rig/yaml_documents.h"
#include "session/check_outliers.h"
#include "session/row_time_step.h"
#include "session/session_folder.h"
#include "station/unit/guidance.h"
#include "station/unit/station_faults.h"
#include "station/unit/unit_metrics.h"

namespace vlp {
namespace {

/// Steps whose images show lamps, in their order.
constexpr std::array kLampSteps{StationStep::rotation, StationStep::dispersion, StationStep::check};

void append_causes(std::vector<Cause>& causes, std::vector<Cause> more) {
  std::move(more.begin(), more.end(), std::back_inserter(causes));
}

bool is_result_valid(const UnitStep& state) {
  return state.result && state.result->has_succeeded();
}

/// Rejected images of an unfinished step.
struct RejectionSummary {
  /// "12 of 36 images refused: 10 blurred, 2 too dark"; empty if most are used.
  std::string text = {};
  /// True if most are blurred, and too many for a shaky hand to be the reason.
  bool are_blurred = false;
};

/// Returns the minimum number of images for a fault of the camera; fewer can be accidental.
int min_images_to_blame(const StationConfig& config) {
  return std::min(config.max_consecutive_rejections, (config.completion.board_views + 1) / 2);
}

RejectionSummary summarize_rejections(const UnitStep& state, const StationConfig& config) {
  std::vector<Observation> rejected;
  for (const auto& [name, image] : state.images) {
    if (image.is_image_used() || image.observation.rejection->reason == RejectionReason::not_needed)
      continue;
    rejected.push_back({image.observation.file});
    rejected.back().rejection = image.observation.rejection;
  }
  if (rejected.empty() || std::cmp_less(rejected.size(), state.count_used_images())) return {};
  const auto blurred = std::ranges::count_if(rejected, [](const Observation& image) {
    return image.rejection->reason == RejectionReason::blurred;
  });
  return {fmt::format("{} of {} images refused: {}", rejected.size(), state.images.size(),
                      summarize_rejected_images(rejected)),
          2 * blurred > std::ssize(rejected) && blurred >= min_images_to_blame(config)};
}

/// Returns the reasons why a step did not finish.
std::vector<Cause> list_step_problems(const Unit& unit, StationStep step) {
  const UnitStep& state = unit.step_state(step);
  if (state.is_step_solved()) return {};
  std::vector<Cause> causes;
  const std::string count = format_image_count(unit, step);
  const RejectionSummary refused = summarize_rejections(state, unit.station_config());
  if (!refused.text.empty()) {
    causes.push_back({fmt::format("{} ({}): {}", station_step_name(step), count, refused.text),
                      refused.are_blurred});
  }
  const bool failed =
      state.result && !state.result->has_succeeded() && state.count_used_images() > 0;
  if (failed)
    causes.push_back({fmt::format("{}: {}", station_step_name(step), state.result->message)});
  const bool is_explained = failed || !refused.text.empty();
  if (state.sufficient || (is_explained && unit.early_end_reason().empty())) return causes;
  // [STATION-16] `before there was`, `too much alike` | INVALID: step ended, or images refused, too
  //   early | repeat it
  causes.push_back({unit.early_end_reason().empty()
                        ? fmt::format("{}: too few images, or too much alike ({})",
                                      station_step_name(step), count)
                        : fmt::format("{}: {} before there was enough ({})",
                                      station_step_name(step), unit.early_end_reason(), count)});
  return causes;
}

/// Returns a cause for each metric that is selected.
template <typename Selects>
std::vector<Cause> describe_failures(const std::vector<CheckedMetric>& metrics, bool of_camera,
                                     const Selects& is_selected) {
  std::vector<Cause> causes;
  for (const CheckedMetric& metric : metrics) {
    if (is_selected(metric)) causes.push_back({describe_failed_gate(metric), of_camera});
  }
  return causes;
}

/// Returns true if a gate is not passed by a measured value.
bool is_gate_missed(const CheckedMetric& metric) {
  return metric.value && !metric.has_passed_gate();
}

/// Returns the problems of a step and its failed gates, those of the station before those of the
/// camera.
std::vector<Cause> list_step_causes(const Unit& unit, StationStep step,
                                    const std::vector<CheckedMetric>& metrics) {
  std::vector<Cause> causes = list_step_problems(unit, step);
  const UnitStep& state = unit.step_state(step);
  if (!is_result_valid(state)) return causes;
  for (const bool of_camera : {false, true}) {
    append_causes(causes, describe_failures(metrics, of_camera, [&](const CheckedMetric& metric) {
                    return find_metric_value(state.result->metrics, metric.name) &&
                           !metric.has_passed_gate() &&
                           find_metric_kind(metric.name)->is_camera_property == of_camera;
                  }));
  }
  return causes;
}

/// Returns true if most of the board images show another board.
bool is_other_board(const UnitStep& boards) {
  const auto other = std::ranges::count_if(boards.images, [](const auto& entry) {
    const auto& board = entry.second.observation.board;
    return board && !board->detection.foreign_tags.empty();
  });
  return 2 * other > static_cast<std::ptrdiff_t>(boards.images.size());
}

/// Returns true if there are enough views to distinguish blur from a shaky hand.
bool is_blur_known(const UnitStep& boards, const StationConfig& config) {
  return boards.sufficient || std::ranges::count_if(boards.images, [](const auto& entry) {
                                return entry.second.observation.blur_px.has_value();
                              }) >= min_images_to_blame(config);
}

/// Returns the causes visible in the board images: another board, blur, and faults of the lens.
std::vector<Cause> list_board_causes(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  std::vector<Cause> causes;
  const UnitStep& boards = unit.step_state(StationStep::boards);
  // [STATION-19] `wrong board:`
  if (is_other_board(boards)) causes.push_back({"wrong board: the tags have other ids"});
  if (is_blur_known(boards, unit.station_config())) {
    append_causes(causes, describe_failures(metrics, true, [](const CheckedMetric& metric) {
                    return metric.name == "blur_px" && is_gate_missed(metric);
                  }));
  }
  append_causes(causes, list_step_causes(unit, StationStep::boards, metrics));
  return causes;
}

/// Returns the causes of the steps with lamps whose previous step is solved.
std::vector<Cause> list_lamp_causes(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  std::vector<Cause> causes;
  StationStep before = StationStep::boards;
  for (const StationStep step : kLampSteps) {
    if (!is_result_valid(unit.step_state(std::exchange(before, step)))) break;
    append_causes(causes, list_step_causes(unit, step, metrics));
  }
  return causes;
}

/// Returns faults of the known points, of the images of the check, or of the camera in the check.
std::vector<Cause> list_check_faults(const Unit& unit, const Calibration& calibration) {
  const UnitStep& check = unit.step_state(StationStep::check);
  if (!is_result_valid(check)) return {};
  const LampMap& lamps = unit.station_config().lamps;
  const CapturesWithPositions captures{list_used_detections(check),
                                       read_captures_with_truth(check.folder)};
  // A common offset is no fault of single captures; one that rotates is a fault of the camera.
  const EvaluationInput input =
      locate_known_points(unit.station_config(), calibration, captures.frames, captures.positions)
          .input;
  const auto offset = find_common_offset(input);
  if (offset && !offset->in_camera) return {{describe_common_offset(*offset)}};
  if (!offset) {
    std::string fault = describe_wrong_positions(input);
    if (!fault.empty()) return {{std::move(fault)}};
  }
  const UnitStep& dispersion = unit.step_state(StationStep::dispersion);
  const CapturesWithPositions reference{list_used_detections(dispersion),
                                        read_captures_with_truth(dispersion.folder)};
  std::string other = explain_focal_difference(captures, reference, lamps, calibration);
  // Without an offset, residuals can be caused by a lens that is inaccurate near the corners.
  if (other.empty() && offset) {
    other = explain_other_lens(captures.frames, reference.frames, lamps, calibration);
  }
  if (!other.empty()) {
    return {{"the images of check are of another camera: " + other + "; take them with this unit"}};
  }
  if (offset) return {{describe_common_offset(*offset), true}};
  return {};
}

/// Returns faults of the lamps and of the lens, from the captures of all steps. Without these,
/// returns faults of the known points or of the camera in the check.
std::vector<Cause> list_station_faults(const Unit& unit) {
  const auto known = unit.latest_calibration();
  if (!known) return {};
  // Tested first, because a wrong row time confuses or removes lamps.
  const Lens lens(known->camera.lens_model, known->camera.intrinsics);
  std::string row_time =
      describe_other_row_time(list_lamp_observations(unit), unit.station_config().lamps, lens,
                              make_given_row_time(unit.station_config()));
  if (!row_time.empty()) return {{std::move(row_time)}};
  std::vector<Frame> frames;
  for (const StationStep step : kLampSteps) {
    for (Frame& frame : list_used_detections(unit.step_state(step)))
      frames.push_back(std::move(frame));
  }
  std::vector<Cause> causes;
  for (const auto& faults : {list_lamp_map_faults(frames, unit.station_config().lamps, *known),
                             list_missing_lamps(frames, unit.station_config().lamps)}) {
    for (const std::string& fault : faults) causes.push_back({fault});
  }
  if (!causes.empty()) return causes;
  if (std::string fault = explain_lens_contradiction(frames, unit.station_config().lamps, *known);
      !fault.empty()) {
    return {{std::move(fault)}};
  }
  return list_check_faults(unit, *known);
}

}  // namespace

std::vector<RunRecord::Image> list_run_images(const Unit& unit) {
  std::vector<RunRecord::Image> images;
  for (const StationStep step : kStationSteps) {
    for (const auto& [name, image] : unit.step_state(step).images) {
      std::string refused = image.rejection_message();
      if (image.discarded) refused.append(" (not kept)");
      images.push_back({.step = station_step_name(step),
                        .name = name,
                        .sha256 = image.sha256,
                        .rejection = std::move(refused)});
    }
    for (const auto& file : unit.step_state(step).pending_images) {
      // [STATION-16] `not looked at:`
      images.push_back({.step = station_step_name(step),
                        .name = file.filename().string(),
                        .sha256 = hash_file(file),
                        .rejection = "not looked at: a step before is not done"});
    }
  }
  return images;
}

RunRecord make_unit_record(const Unit& unit, const std::string& run,
                           const ProgramVersion& program) {
  RunRecord record = make_run_record("unit", unit.station_config(), unit.camera_id(), run, program);
  if (const auto calibration = unit.latest_calibration()) {
    record.calibration = format_calibration(*calibration);
  }
  record.metrics = unit.collect_metrics();
  record.set_causes(list_failure_causes(unit));
  record.images = list_run_images(unit);
  return record;
}

void invalidate_reuse(RunRecord& record, const std::string& earlier,
                      const std::filesystem::path& station_file) {
  // [STATION-6] `no repetition` | images used in the stated run | new images, or void that run if
  //   its serial was wrong
  record.invalidate_verdict(fmt::format(
      "all images are those of run {}, which is no repetition: take new ones, or '{}' if that run "
      "should not count",
      earlier, format_void_command(earlier, station_file)));
}

std::vector<Cause> list_failure_causes(const Unit& unit) {
  const std::vector<CheckedMetric> metrics = unit.collect_metrics();
  const std::vector<Cause> board_causes = list_board_causes(unit, metrics);
  std::vector<Cause> lamp_causes = list_lamp_causes(unit, metrics);
  if (!unit.first_incomplete()) {
    append_causes(lamp_causes, describe_failures(metrics, false, [](const CheckedMetric& metric) {
                    return !metric.value;
                  }));
  }

  std::vector<Cause> causes;
  if (!unit.invalid_reason().empty()) causes.push_back({unit.invalid_reason()});
  append_causes(causes,
                board_causes);  // before faults of the lamps: the lens was measured without them
  if (std::string error = unit.row_time_check().error; !error.empty()) {
    causes.push_back({std::move(error)});
  } else if (!board_causes.empty() || !lamp_causes.empty()) {
    append_causes(causes, list_station_faults(unit));
  }
  append_causes(causes, std::move(lamp_causes));
  // Gates of make_row_time_metrics(), which refer to all steps together.
  append_causes(causes, describe_failures(metrics, false, [](const CheckedMetric& metric) {
                  return metric.name.starts_with("row_time_") && is_gate_missed(metric);
                }));
  return causes;
}

}  // namespace vlp
