// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/verify_station.h"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>

#include "detection/detect_captures.h"
#include "detection/image_file.h"
#include "detection/images_in_parallel.h"
#include "rig/input_error.h"
#include "session/leaning_captures.h"
#include "session/session_folder.h"
#include "station/unit/lamp_faults.h"
#include "station/unit/station_step.h"
#include "station/unit/station_steps.h"
#include "station/unit/step_picture.h"
#include "station/unit/unit_step.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

template <typename Look>
UnitStep step_of(const fs::path& folder, int threads, const Look& look) {
  const auto files = images_in(folder);
  std::vector<UnitImage> images(files.size());
  images_in_parallel(files.size(), threads, [&](std::size_t i) { images[i] = look(files[i]); });
  UnitStep step;
  step.folder = folder;
  for (UnitImage& image : images) {
    std::string name = image.file.filename().string();
    step.images.emplace(std::move(name), std::move(image));
  }
  return step;
}

class Verification {
 public:
  Verification(const StationConfig& config, const fs::path& folder, int threads)
      : config_(config), golden_(*config.golden), folder_(folder), threads_(threads) {
    config_.type = golden_.calibration.camera;
  }

  void boards() {
    const BoardDetector detector(config_.board);
    UnitStep step = step_of(folder_ / "boards", threads_, [&](const fs::path& file) {
      return look_at_board(file, config_, detector);
    });
    const auto views = views_of(step, config_.board);
    if (!views.empty()) add("boards", solve_boards(config_, golden_.camera_id, views));
    note(StationStep::boards, step);
  }

  void lamps(StationStep each) {
    const LightDetector detector(config_.lamps, detector_camera(golden_.calibration));
    const fs::path folder = folder_ / name_of(each);
    const auto levels = levels_told(captures_table(folder), golden_.calibration, 0);
    UnitStep step = step_of(folder, threads_, [&](const fs::path& file) {
      const auto leaning = leaning_detector(detector, levels, file.filename().string());
      return look_at_lamps(file, config_, leaning ? *leaning : detector);
    });
    const auto frames = frames_of(step);
    frames_.insert(frames_.end(), frames.begin(), frames.end());
    const auto places = captures_in(step.folder);
    if (each == StationStep::check) {
      places_ = place_faults(frames, config_.lamps, golden_.calibration, places);
    }
    add(name_of(each), each == StationStep::check
                           ? check_fixes(config_, golden_.calibration, frames, places)
                           : solve_dispersion(config_, golden_.calibration, frames, places));
    note(each, step);
  }

  RunRecord record(const std::string& run, const ProgramVersion& program) {
    const auto figures = check_all(golden_.gates, values_, unit_metrics());
    for (const CheckedMetric& figure : figures) {
      // It is the station that is measured, and fails by its figures.
      if (!figure.met()) causes_.push_back({cause_of(figure), figure.value.has_value()});
    }
    // Whatever the gates are of: this camera is known.
    constexpr double fits_px = 0.25;
    auto faults = lamp_faults(frames_, config_.lamps, golden_.calibration, fits_px);
    if (!causes_.empty()) {
      // Where all gates are met it is for them to say whether all lamps have to be seen.
      auto unseen = unseen_lamps(frames_, config_.lamps);
      std::move(unseen.begin(), unseen.end(), std::back_inserter(faults));
    }
    std::vector<Cause> first;
    first.reserve(faults.size() + places_.size());
    for (const std::string& fault : faults) first.push_back({fault, true});
    if (first.empty()) {
      for (const std::string& fault : places_) first.push_back({fault, false});
    }
    causes_.insert(causes_.begin(), first.begin(), first.end());
    RunRecord record = new_record("golden", config_, golden_.camera_id, run, program);
    record.figures = figures;
    record.images = images_;
    record.judge(causes_);
    return record;
  }

  std::vector<ReportPicture> pictures() const {
    std::vector<ReportPicture> pictures;
    for (const StepPicture& drawn : drawn_) {
      if (const auto& picture = drawn.get()) pictures.push_back(*picture);
    }
    return pictures;
  }

 private:
  void add(const char* step, const StepResult& result) {
    if (!result.ok()) {
      const bool of_station =
          result.failure == StepFailure::wrong_board || result.failure == StepFailure::wrong_map;
      causes_.push_back({fmt::format("{}: {}", step, result.why), of_station});
    }
    values_.insert(values_.end(), result.metrics.begin(), result.metrics.end());
    if (result.drawing) drawn_.push_back(draw_aside(result.drawing));
  }
  void note(StationStep each, const UnitStep& step) {
    for (const auto& [name, image] : step.images) {
      images_.push_back(
          {.step = name_of(each), .name = name, .sha256 = image.sha256, .refused = image.refused});
    }
  }

  StationConfig config_;
  const GoldenUnit& golden_;
  fs::path folder_;
  int threads_;
  std::vector<Frame> frames_ = {};
  std::vector<Metric> values_ = {};
  std::vector<StepPicture> drawn_ = {};
  std::vector<Cause> causes_ = {};
  /// Captures of the check that were taken elsewhere.
  std::vector<std::string> places_ = {};
  std::vector<RunRecord::Image> images_ = {};
};

}  // namespace

Verified verify_station(const StationConfig& config, const fs::path& folder, const std::string& run,
                        const ProgramVersion& program, int threads) {
  Verification verification(config, folder, threads);
  if (fs::is_directory(folder / "boards")) verification.boards();
  if (fs::is_directory(folder / "dispersion")) verification.lamps(StationStep::dispersion);
  verification.lamps(StationStep::check);
  return {verification.record(run, program), verification.pictures()};
}

void refuse_used_images(
    RunRecord& record, const std::function<std::string(const std::string& sha256)>& golden_run_of) {
  for (const RunRecord::Image& image : record.images) {
    if (!image.refused.empty()) continue;
    const std::string run = golden_run_of(image.sha256);
    if (run.empty()) continue;
    record.verdict = name_of(Verdict::invalid);
    record.causes = fmt::format("image {}/{} was used in golden run {}: measure it anew\n{}",
                                image.step, image.name, run, record.causes);
    return;
  }
}

}  // namespace vlp
