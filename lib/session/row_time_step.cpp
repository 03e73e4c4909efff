// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_step.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "frontend/image_file.h"
#include "frontend/lamp_intake.h"
#include "lamps/signal/frequency_identification.h"
#include "session/position_cost.h"

namespace vlp {

namespace fs = std::filesystem;

namespace {

/// Lights of the images of all folders with their periods, and the sizes of the images.
/// LightPeriod::image is an index into the images of all folders.
struct PeriodsOfImages {
  std::vector<LightPeriod> lights;
  std::vector<std::array<int, 2>> sizes_px;

  PeriodsOfImages(std::span<const std::span<const Observation>> folders,
                  const std::vector<std::vector<Frame>>& labels) {
    for (std::size_t i = 0; i < folders.size(); ++i) {
      for (LightPeriod light : collect_periods(folders[i], labels[i])) {
        light.image += sizes_px.size();
        lights.push_back(std::move(light));
      }
      for (const Observation& image : folders[i]) sizes_px.push_back(image.size_px);
    }
  }

  /// Returns the lights of each image with their groups. Omits a group in an image with several of
  /// its lights, because at most one of them is the lamp.
  std::vector<GroupedLights> group_lights(const std::vector<PeriodGroup>& groups) const {
    std::vector<GroupedLights> images;
    for (const std::array<int, 2>& size_px : sizes_px) images.push_back({size_px, {}});
    for (std::size_t group = 0; group < groups.size(); ++group) {
      std::map<std::size_t, int> count;  // by image
      for (const std::size_t i : groups[group].lights) ++count[lights[i].image];
      for (const std::size_t i : groups[group].lights) {
        const LightPeriod& light = lights[i];
        if (count[light.image] > 1) continue;
        images[light.image].lights.push_back({group, light.pixel, light.sigma_px});
      }
    }
    return images;
  }
};

/// Fewer lamps may be wrong in the map instead.
constexpr int kMinRowTimeLamps = 3;
constexpr double kMicrosecondsPerSecond = 1e6;

/// Collects the periods of identified lamps.
std::vector<MeasuredPeriod> collect_lamp_periods(const std::vector<Observation>& images) {
  std::vector<MeasuredPeriod> periods;
  for (const Observation& image : images) {
    if (!image.is_image_kept()) continue;  // excludes copies and images of another camera
    for (const Light& light : image.lights) {
      const bool is_measured =
          light.kind == LightKind::lamp && light.lamp && are_stripes_reliable(light.stripes);
      if (!is_measured) continue;
      periods.push_back({light.stripes.period_lines, light.lamp});
    }
  }
  return periods;
}

double compute_error_fraction(const RowTime& measured, double given_s) {
  constexpr double max_sds = 3;
  return std::max(0.0, std::abs(std::log(measured.row_time_s / given_s)) -
                           max_sds * measured.sd_s / measured.row_time_s);
}

}  // namespace

std::vector<std::span<const Observation>> DetectedLights::by_folder() const {
  std::vector<std::span<const Observation>> folders;
  std::span<const Observation> remaining = observations.images;
  for (const std::size_t size : folder_sizes) {
    folders.push_back(remaining.first(size));
    remaining = remaining.subspan(size);
  }
  return folders;
}

RowTimeResult estimate_row_time(std::span<const std::span<const Observation>> folders,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const std::optional<Lens>& lens) {
  const PeriodsOfImages periods(folders, labels);
  const RowTimeCandidates found = list_row_time_candidates(
      std::vector<MeasuredPeriod>(periods.lights.begin(), periods.lights.end()), lamps);
  if (found.candidates.size() < 2) return select_row_time(found);
  const auto images = periods.group_lights(found.groups);
  return select_row_time(found, compute_position_costs(found, images, lamps, lens));
}

DetectedLights detect_in_folders(const std::vector<fs::path>& folders, const LampMap& lamps,
                                 const std::optional<Calibration>& calibration, bool with_row_time,
                                 const FrontendOptions& options, const IntakeProgress& progress) {
  DetectedLights lights;
  std::optional<std::array<int, 2>> imager_px;
  std::optional<Readout> readout = options.readout;
  if (calibration) {
    lights.camera = make_detector_camera(*calibration);
    imager_px = calibration->camera.imager_px;
    if (!readout) readout = calibration->camera.readout;
  }
  // The estimate must not depend on the given row time.
  if (!with_row_time) lights.camera.row_time_s.reset();
  std::vector<fs::path> images;
  for (const fs::path& folder : folders) {
    const auto in_folder = list_images(folder);
    lights.folder_sizes.push_back(in_folder.size());
    images.insert(images.end(), in_folder.begin(), in_folder.end());
  }
  Observations remarks;
  lights.camera.readout = estimate_readout(images, readout, options, imager_px, remarks);
  const LampIntake intake(LightDetector(lamps, lights.camera), ImageUse::fixes, options, imager_px);
  lights.observations = intake.detect_lamps_in_images(images, progress);
  prepend_messages(remarks, lights.observations);
  check_any_readable(folders.front(), lights.observations.images);
  return lights;
}

std::string describe_wrong_row_time(const RowTime& measured, const GivenRowTime& given) {
  if (measured.lamps < kMinRowTimeLamps ||
      compute_error_fraction(measured, given.row_time_s) <= kLampDrift) {
    return "";
  }
  // [LAMP-13] `row time is ... us in` | contradicts the frequencies of the map | use the measured
  //   one, if the frequencies are right
  return fmt::format(
      "row time is {:.6g} us in {}, but the stripes of {} lamps measure {:.2f} +- {:.2f} us; "
      "correct it, or, if it is right, all frequencies of the lamp map by this ratio",
      kMicrosecondsPerSecond * given.row_time_s, given.source, measured.lamps,
      kMicrosecondsPerSecond * measured.row_time_s, kMicrosecondsPerSecond * measured.sd_s);
}

RowTimeCheck check_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                            const GivenRowTime& given) {
  const auto found = list_row_time_candidates(collect_lamp_periods(images), lamps);
  if (found.candidates.empty()) return {};
  const RowTime& measured = found.candidates.front().row_time;
  if (measured.lamps < kMinRowTimeLamps) return {};
  return {measured, describe_wrong_row_time(measured, given),
          compute_error_fraction(measured, given.row_time_s)};
}

RowTimeCheck search_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                             const std::optional<Lens>& lens, const GivenRowTime& given) {
  const auto found = estimate_row_time(std::array{std::span(images)}, {{}}, lamps, lens).row_time;
  if (!found) return {};
  return {*found, describe_wrong_row_time(*found, given),
          compute_error_fraction(*found, given.row_time_s)};
}

void add_row_time_remark(const std::vector<Observation>& images, const LampMap& lamps,
                         const DetectorCamera& camera, const std::string& source,
                         StepResult& result) {
  if (!camera.row_time_s) return;
  const GivenRowTime given{*camera.row_time_s, source};
  std::string error;
  if (result.has_succeeded()) error = check_row_time(images, lamps, given).error;
  if (error.empty()) error = search_row_time(images, lamps, camera.lens, given).error;
  if (error.empty()) return;
  if (result.has_succeeded()) {
    result.warnings.push_back(std::move(error));
  } else {
    result.set_step_failure(StepFailure::bad_input, std::move(error));
  }
}

std::vector<Metric> make_row_time_metrics(const RowTimeCheck& check) {
  if (!check.measured) return {};
  std::vector<Metric> metrics{{"row_time_us", kMicrosecondsPerSecond * check.measured->row_time_s},
                              {"row_time_sd_us", kMicrosecondsPerSecond * check.measured->sd_s}};
  if (check.error_fraction)
    metrics.push_back({"row_time_error_percent", 100 * *check.error_fraction});
  return metrics;
}

RowTimeStepResult run_row_time_step(const DetectedLights& seen,
                                    const std::vector<std::vector<Frame>>& labels,
                                    const LampMap& lamps, const fs::path& lamps_file,
                                    const std::optional<Calibration>& calibration,
                                    HistoryEntry entry) {
  check_frequencies(lamps, lamps_file);
  RowTimeStepResult result;
  const RowTimeResult estimate =
      estimate_row_time(seen.by_folder(), labels, lamps, seen.camera.lens);
  if (!estimate.row_time) {
    result.set_step_failure(StepFailure::undetermined, estimate.problem);
    return result;
  }
  result.row_time = *estimate.row_time;
  result.metrics = make_row_time_metrics({result.row_time});
  if (!calibration) return result;
  if (const auto& stated_s = calibration->camera.row_time_s) {
    std::string error = describe_wrong_row_time(result.row_time, {*stated_s, "the calibration"});
    if (!error.empty()) result.warnings.push_back(std::move(error));
  }
  result.calibration = *calibration;
  result.calibration.camera.row_time_s = result.row_time.row_time_s;
  result.calibration.camera.readout = seen.camera.readout;
  entry.part = "camera";
  auto& history = result.calibration.history;
  std::erase_if(history, [&](const HistoryEntry& other) {  // entry of an earlier search
    return other.part == "camera" && other.program == entry.program &&
           other.options.find("--row-time") != std::string::npos;
  });
  history.push_back(std::move(entry));
  return result;
}

}  // namespace vlp
