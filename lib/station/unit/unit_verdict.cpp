// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_verdict.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "captures/digest.h"
#include "rig/yaml_documents.h"
#include "session/check_outliers.h"
#include "session/lamp_causes.h"
#include "session/row_time_step.h"
#include "session/session_folder.h"
#include "station/unit/guidance.h"
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

/// Returns true if a property of the camera misses its gate by far more than its uncertainty, so
/// that a failed gate of this uncertainty is no excuse.
bool is_clearly_missed(const CheckedMetric& metric, const Unit& unit,
                       const std::vector<Metric>& measured) {
  if (!is_gate_missed(metric)) return false;
  const Camera& type = unit.station_config().nominal_camera;
  const double focal_px = type.focal_px().mean();
  const double half_diagonal_px = std::hypot(type.imager_px[0], type.imager_px[1]) / 2;
  struct Accuracy {
    const char* metric;
    /// Displacement in the image for a unit of the metric.
    double px_per_unit;
    /// Metric of the uncertainty, px.
    const char* uncertainty;
  };
  const auto accuracies =
      std::to_array<Accuracy>({{"focal_percent", half_diagonal_px / 100, "expected_max_error_px"},
                               {"principal_point_px", 1, "expected_max_error_px"},
                               {"nominal_difference_px", 1, "expected_max_error_px"},
                               {"tilt_deg", focal_px * std::numbers::pi / 180, "rotation_sd_px"}});
  const auto accuracy = std::ranges::find(accuracies, metric.name, &Accuracy::metric);
  if (accuracy == accuracies.end()) return false;
  constexpr double sigmas = 5;
  return accuracy->px_per_unit * (*metric.value - metric.acceptance_limit()) >
         sigmas * find_metric_value(measured, accuracy->uncertainty).value_or(0);
}

/// Returns failed gates of a step and its problems: properties of the camera that are measured well
/// enough, also if captures do not fit because of them, then problems and gates of the station,
/// then those of the camera.
std::vector<Cause> list_step_causes(const Unit& unit, StationStep step,
                                    const std::vector<CheckedMetric>& metrics) {
  const UnitStep& state = unit.step_state(step);
  if (!state.result) return list_step_problems(unit, step);
  const std::vector<Metric>& measured = state.result->metrics;
  std::vector<Cause> causes;
  std::set<std::string> listed;
  const auto append_failures = [&](bool of_camera, const auto& is_selected) {
    append_causes(causes, describe_failures(metrics, of_camera, [&](const CheckedMetric& metric) {
                    return find_metric_value(measured, metric.name) && !metric.has_passed_gate() &&
                           find_metric_kind(metric.name)->is_camera_property == of_camera &&
                           is_selected(metric) && listed.insert(metric.name).second;
                  }));
  };
  append_failures(
      true, [&](const CheckedMetric& metric) { return is_clearly_missed(metric, unit, measured); });
  append_causes(causes, list_step_problems(unit, step));
  if (!state.result->has_succeeded()) return causes;
  const auto is_any = [](const CheckedMetric&) { return true; };
  append_failures(false, is_any);
  append_failures(true, is_any);
  return causes;
}

/// Searches the row time by which the lights of all steps are lamps of the map.
RowTimeCheck search_unit_row_time(const Unit& unit, const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  return search_row_time(list_lamp_observations(unit), unit.station_config().lamps,
                         Lens(camera.lens_model, camera.intrinsics),
                         make_given_row_time(unit.station_config()));
}

/// Describes images that were cropped or binned, and scaled: focal length and row time then differ
/// from those of the type by reciprocal factors. Returns an empty string otherwise.
std::string describe_scaled_images(const Unit& unit) {
  const auto known = unit.latest_calibration();
  if (!known) return "";
  const Camera& type = unit.station_config().nominal_camera;
  const double scale = std::sqrt((known->camera.focal_px().cwiseQuotient(type.focal_px())).prod());
  constexpr double min_difference = 0.02, max_mismatch = 0.01, sigmas = 3;
  if (std::abs(scale - 1) < min_difference) return "";
  const std::optional<RowTime> measured = search_unit_row_time(unit, *known).measured;
  if (!measured) return "";
  const double rows = type.row_time_s.value() / measured->row_time_s;
  if (std::abs(rows / scale - 1) > max_mismatch + sigmas * measured->sd_s / measured->row_time_s)
    return "";
  // [STATION-22] `images are scaled`
  return fmt::format(
      "the images are scaled by {:.3f}: focal length and rows per second of the stripes are both "
      "larger by this factor than those of the type; take whole images of full resolution",
      scale);
}

/// Returns faults of the images as such, on which all results depend: levels, defective pixels,
/// images that were scaled.
std::vector<Cause> list_image_causes(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  const auto is_missed = [&](const CheckedMetric& metric, std::string_view name) {
    return metric.name == name && is_gate_missed(metric);
  };
  const auto is_dark = [&](const CheckedMetric& metric) {
    return is_missed(metric, "board_white") || is_missed(metric, "lamp_white");
  };
  std::vector<Cause> causes;
  // [STATION-22] `all images are dark` | settings of the camera or of the
  //   capture tool changed | restore them
  if (std::ranges::count_if(metrics, is_dark) > 1)
    causes.push_back({"all images are dark: the gain of the camera, or each exposure, is too low"});
  if (std::string scaled = describe_scaled_images(unit); !scaled.empty())
    causes.push_back({std::move(scaled)});
  append_causes(causes, describe_failures(metrics, false, [&](const CheckedMetric& metric) {
                  return is_dark(metric) || is_missed(metric, "dark_level") ||
                         is_missed(metric, "lamp_blur_px");
                }));
  append_causes(causes, describe_failures(metrics, true, [&](const CheckedMetric& metric) {
                  return is_missed(metric, "defective_pixels");
                }));
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

/// Returns true if the captures of the lamps contradict each other, the map or known positions: a
/// step failed, or a gate of a residual or of an error.
bool are_lamps_contradicted(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  const bool has_failed_step = std::ranges::any_of(kLampSteps, [&](StationStep step) {
    const auto& result = unit.step_state(step).result;
    return result && !result->has_succeeded();
  });
  constexpr std::array names{"rotation_px", "rotation_spread_px", "dispersion_mm",
                             "dispersion_offset_px", "world_offset_mm"};
  return has_failed_step || std::ranges::any_of(metrics, [&](const CheckedMetric& metric) {
           return is_gate_missed(metric) &&
                  (metric.name.starts_with("check_") || std::ranges::count(names, metric.name) > 0);
         });
}

/// Returns the limit of a gate, m; infinite without the gate.
double find_gate_limit_m(const StationConfig& config, const std::string& metric) {
  const auto gate = std::ranges::find(config.gates, metric, &Gate::metric);
  constexpr double m_per_mm = 1e-3;
  return gate == config.gates.end() ? std::numeric_limits<double>::infinity()
                                    : m_per_mm * gate->limit;
}

/// Returns wrong positions of single captures of the check; empty if there are none.
std::string describe_check_outliers(const Unit& unit, const Calibration& calibration) {
  const UnitStep& check = unit.step_state(StationStep::check);
  if (!is_result_valid(check)) return "";
  const StationConfig& config = unit.station_config();
  return describe_wrong_positions(
      locate_known_points(config, calibration, list_used_detections(check),
                          read_captures_with_truth(check.folder))
          .input,
      std::min(kMinOutlierError_m, find_gate_limit_m(config, "check_worst_mm")));
}

/// Returns faults of the station or of the camera from the captures of lamps of all steps.
std::vector<Cause> list_lamp_faults(const Unit& unit, const std::vector<CheckedMetric>& metrics) {
  const auto known = unit.latest_calibration();
  if (!known) return {};
  const LampMap& lamps = unit.station_config().lamps;
  // Tested first, because a wrong row time confuses or removes lamps.
  std::string row_time = search_unit_row_time(unit, *known).error;
  if (!row_time.empty()) return {{std::move(row_time)}};
  std::vector<StepCaptures> steps = list_lamp_captures(unit);
  std::vector<Frame> frames;
  for (const StepCaptures& step : steps)
    frames.insert(frames.end(), step.frames.begin(), step.frames.end());
  std::vector<Cause> causes;
  for (const auto& faults :
       {list_map_contradictions(frames, lamps, *known), list_missing_lamps(frames, lamps)}) {
    for (const std::string& fault : faults) causes.push_back({fault});
  }
  if (!causes.empty() || !are_lamps_contradicted(unit, metrics)) return causes;
  // A large tilt displaces the centers of the lamps that were detected without it.
  const auto& rotation = unit.step_state(StationStep::rotation).result;
  const bool is_tilted =
      rotation && std::ranges::any_of(metrics, [&](const CheckedMetric& metric) {
        return metric.name == "tilt_deg" && is_clearly_missed(metric, unit, rotation->metrics);
      });
  if (is_tilted) return causes;
  // Single captures with errors can be the effect of another cause, or the cause itself.
  std::vector<LampCause> ranked = rank_lamp_causes(steps, lamps, *known);
  if (!is_contradiction_explained(ranked)) {
    std::string outliers = describe_check_outliers(unit, *known);
    if (!outliers.empty()) causes.push_back({std::move(outliers)});
  }
  for (LampCause& cause : ranked)
    causes.push_back({std::move(cause.text), cause.kind == LampCauseKind::moved_camera});
  return causes;
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
  append_causes(causes, list_image_causes(unit, metrics));
  append_causes(causes,
                board_causes);  // before faults of the lamps: the lens was measured without them
  if (std::string error = unit.row_time_check().error; !error.empty()) {
    causes.push_back({std::move(error)});
  } else if (!board_causes.empty() || !lamp_causes.empty()) {
    append_causes(causes, list_lamp_faults(unit, metrics));
  }
  append_causes(causes, std::move(lamp_causes));
  // Gates of make_row_time_metrics(), which refer to all steps together.
  append_causes(causes, describe_failures(metrics, false, [](const CheckedMetric& metric) {
                  return metric.name.starts_with("row_time_") && is_gate_missed(metric);
                }));
  std::set<std::string> listed;
  std::erase_if(causes, [&](const Cause& cause) { return !listed.insert(cause.text).second; });
  return causes;
}

}  // namespace vlp
