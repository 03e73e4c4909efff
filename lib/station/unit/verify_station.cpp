// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/verify_station.h"

#include <fmt/core.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "frontend/image_source.h"
#include "frontend/lamp_intake.h"
#include "frontend/observation.h"
#include "rig/input_error.h"
#include "session/row_time_step.h"
#include "session/session_folder.h"
#include "station/unit/station_faults.h"
#include "station/unit/station_steps.h"
#include "station/unit/unit_step.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

class Verification {
 public:
  Verification(const StationConfig& config, const fs::path& folder, int threads)
      : config_(config), golden_(*config.golden_unit), folder_(folder), threads_(threads) {
    config_.nominal_camera = golden_.calibration.camera;
  }

  void check_boards() {
    const BoardIntake intake(config_.board, config_.frontend, config_.nominal_camera.imager_px);
    const UnitStep step =
        observe_folder(folder_ / "boards", ImageUse::boards,
                       [&](const SourceImage& image) { return intake.detect_board(image); });
    if (step.count_used_images() > 0)
      add_step_result("boards",
                      run_station_lens(config_, golden_.camera_id, list_observations(step)));
    add_images(StationStep::boards, step);
  }

  void check_lamps(StationStep station_step) {
    const fs::path folder = folder_ / station_step_name(station_step);
    const LampIntake intake(
        LightDetector(config_.lamps, make_detector_camera(golden_.calibration)),
        ImageUse::known_positions, config_.frontend, config_.nominal_camera.imager_px,
        compute_level_rotations(read_folder_captures(folder), golden_.calibration, 0));
    const UnitStep step = observe_folder(
        folder, ImageUse::known_positions,
        [&](const SourceImage& image) { return intake.detect_lamps_in_image(image); });
    std::ranges::move(list_observations(step).images, std::back_inserter(lamp_images_));
    const auto frames = list_used_detections(step);
    frames_.insert(frames_.end(), frames.begin(), frames.end());
    const auto places = read_captures_with_truth(step.folder);
    if (station_step == StationStep::check) {
      common_offset_ = find_common_offset(frames, config_.lamps, golden_.calibration, places);
      place_fault_ = explain_wrong_positions(frames, config_.lamps, golden_.calibration, places);
    }
    add_step_result(station_step_name(station_step),
                    station_step == StationStep::check
                        ? run_station_check(config_, golden_.calibration, frames, places)
                        : run_station_dispersion(config_, golden_.calibration, frames, places));
    add_images(station_step, step);
  }

  RunRecord make_record(const std::string& run, const ProgramVersion& program) {
    const GivenRowTime stated{*config_.nominal_camera.row_time_s,
                              "the calibration of the golden unit"};
    const RowTimeCheck row_time = check_row_time(lamp_images_, config_.lamps, stated);
    for (const Metric& metric : make_row_time_metrics(row_time)) values_.push_back(metric);
    RunRecord record = make_run_record("golden", config_, golden_.camera_id, run, program);
    record.metrics = check_against_gates(golden_.gates, values_, list_unit_metrics());
    record.images = images_;
    for (const CheckedMetric& metric : record.metrics) {
      // The station is under test, and fails by its metrics.
      if (!metric.has_passed_gate())
        causes_.push_back({describe_failed_gate(metric), metric.value.has_value()});
    }
    std::vector<Cause> causes = list_station_causes(row_time, stated);
    causes.insert(causes.end(), causes_.begin(), causes_.end());
    record.set_causes(std::move(causes));
    return record;
  }

  std::vector<ReportPlot> collect_plots() const {
    std::vector<ReportPlot> pictures;
    for (const StepPlot& plot : plots_) {
      if (const auto& picture = plot.get()) pictures.push_back(*picture);
    }
    return pictures;
  }

 private:
  /// Returns the causes that precede the failed steps and gates.
  std::vector<Cause> list_station_causes(const RowTimeCheck& row_time, const GivenRowTime& stated) {
    std::string row_time_error = row_time.error;
    if (row_time_error.empty() && !causes_.empty()) {
      const Camera& camera = golden_.calibration.camera;
      row_time_error = describe_other_row_time(lamp_images_, config_.lamps,
                                               Lens(camera.lens_model, camera.intrinsics), stated);
    }
    // Independent of the gates: this camera is known.
    constexpr double min_offset_px = 0.6;
    auto faults = list_lamp_map_faults(frames_, config_.lamps, golden_.calibration, min_offset_px);
    if (!causes_.empty()) {
      // If all gates pass, they decide whether all lamps must be detected.
      std::ranges::move(list_missing_lamps(frames_, config_.lamps), std::back_inserter(faults));
    }
    std::vector<Cause> causes;
    if (!row_time_error.empty()) causes.push_back({row_time_error, false});
    for (const std::string& fault : faults) causes.push_back({fault, true});
    if (!faults.empty()) return causes;
    if (common_offset_ && !causes_.empty()) {
      causes.push_back({describe_common_offset(*common_offset_), true});
    } else if (!place_fault_.empty()) {
      causes.push_back({place_fault_, false});
    }
    return causes;
  }

  /// Observes the images of a folder and rejects the repeated ones.
  template <typename Detect>
  UnitStep observe_folder(const fs::path& folder, ImageUse use, const Detect& detect) const {
    const auto files = list_images(folder);
    std::vector<UnitImage> images(files.size());
    process_images(files.size(), threads_,
                   [&](std::size_t i) { images[i] = observe_unit_image(files[i], detect); });
    UnitStep step;
    step.folder = folder;
    Selection selection(use, config_.frontend);
    for (UnitImage& image : images) {
      selection.add_or_reject(image.observation);
      std::string name = image.observation.image_file_name();
      step.images.emplace(std::move(name), std::move(image));
    }
    return step;
  }
  void add_step_result(const char* step, const StepResult& result) {
    if (!result.has_succeeded()) {
      const bool is_station_fault =
          result.failure == StepFailure::wrong_board || result.failure == StepFailure::wrong_map;
      causes_.push_back({fmt::format("{}: {}", step, result.message), is_station_fault});
    }
    values_.insert(values_.end(), result.metrics.begin(), result.metrics.end());
    if (result.drawing) plots_.push_back(render_plot_async(result.drawing));
  }
  void add_images(StationStep station_step, const UnitStep& step) {
    for (const auto& [name, image] : step.images) {
      images_.push_back({.step = station_step_name(station_step),
                         .name = name,
                         .sha256 = image.sha256,
                         .rejection = image.rejection_message()});
    }
  }

  StationConfig config_;
  const GoldenUnit& golden_;
  fs::path folder_;
  int threads_;
  std::vector<Frame> frames_ = {};
  std::vector<Observation> lamp_images_ = {};
  std::vector<Metric> values_ = {};
  std::vector<StepPlot> plots_ = {};
  std::vector<Cause> causes_ = {};
  std::optional<CommonOffset> common_offset_ = {};
  /// Description of captures of the check at wrong positions.
  std::string place_fault_ = {};
  std::vector<RunRecord::Image> images_ = {};
};

}  // namespace

VerificationResult verify_from_images(const StationConfig& config, const fs::path& folder,
                                      const std::string& run, const ProgramVersion& program,
                                      int threads) {
  Verification verification(config, folder, threads);
  if (fs::is_directory(folder / "boards")) verification.check_boards();
  if (fs::is_directory(folder / "dispersion")) verification.check_lamps(StationStep::dispersion);
  verification.check_lamps(StationStep::check);
  return {verification.make_record(run, program), verification.collect_plots()};
}

void invalidate_if_reused(
    RunRecord& record,
    const std::function<std::string(const std::string& sha256)>& find_golden_user) {
  for (const RunRecord::Image& image : record.images) {
    if (!image.rejection.empty()) continue;
    const std::string run = find_golden_user(image.sha256);
    if (run.empty()) continue;
    record.invalidate_verdict(fmt::format("image {}/{} was used in golden run {}: measure it again",
                                          image.step, image.name, run));
    return;
  }
}

}  // namespace vlp
