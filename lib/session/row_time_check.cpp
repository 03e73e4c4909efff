// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_check.h"

#include <fmt/core.h>

#include <cmath>

#include "lamps/signal/frequency_identification.h"
#include "session/row_time_step.h"

namespace vlp {
namespace {

/// Fewer lamps may be wrong in the map instead.
constexpr int kMinRowTimeLamps = 3;
constexpr double kMicrosecondsPerSecond = 1e6;

}  // namespace

std::string compare_row_times(const RowTime& measured, const GivenRowTime& given) {
  constexpr double max_sds = 3;
  const double max_deviation = kLampDrift + max_sds * measured.sd_s / measured.row_time_s;
  const double deviation = std::abs(std::log(measured.row_time_s / given.row_time_s));
  if (measured.lamps < kMinRowTimeLamps || deviation <= max_deviation) return "";
  return fmt::format(
      "row time is {:.6g} us in {}, but the stripes of {} lamps measure {:.2f} +- {:.2f} us; "
      "correct it, or, if it is right, all frequencies of the lamp map by this ratio",
      kMicrosecondsPerSecond * given.row_time_s, given.source, measured.lamps,
      kMicrosecondsPerSecond * measured.row_time_s, kMicrosecondsPerSecond * measured.sd_s);
}

namespace {

/// Collects the periods of identified lamps. A period found by modulation is excluded: its search
/// begins at the given row time.
std::vector<MeasuredPeriod> collect_lamp_periods(const std::vector<Observation>& images) {
  std::vector<MeasuredPeriod> periods;
  for (const Observation& image : images) {
    if (!image.is_kept()) continue;  // excludes copies and images of another camera
    for (const Light& light : image.lights) {
      const bool is_measured = light.kind == LightKind::lamp && light.lamp &&
                               !light.by_modulation && is_reliable(light.stripes);
      if (!is_measured) continue;
      periods.push_back({light.stripes.period_lines, light.lamp});
    }
  }
  return periods;
}

}  // namespace

RowTimeCheck check_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                            const GivenRowTime& given) {
  const auto found = estimate_row_time(collect_lamp_periods(images), lamps);
  if (found.candidates.empty()) return {};
  const RowTime& measured = found.candidates.front().row_time;
  if (measured.lamps < kMinRowTimeLamps) return {};
  return {measured, compare_row_times(measured, given)};
}

std::string find_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                const std::optional<Lens>& lens, const GivenRowTime& given) {
  const auto found = choose_row_time_by_places({&images}, {{}}, lamps, lens).found;
  return found ? compare_row_times(*found, given) : "";
}

std::string describe_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                    const Camera& camera, const std::string& source,
                                    bool has_result) {
  if (!camera.row_time_s) return "";
  const GivenRowTime given{*camera.row_time_s, source};
  if (has_result) {
    std::string error = check_row_time(images, lamps, given).error;
    if (!error.empty()) return error;
  }
  return find_row_time_error(images, lamps, Lens(camera.lens_model, camera.intrinsics), given);
}

std::vector<Metric> row_time_metrics(const RowTimeCheck& check) {
  if (!check.measured) return {};
  return {{"row_time_us", kMicrosecondsPerSecond * check.measured->row_time_s},
          {"row_time_sd_us", kMicrosecondsPerSecond * check.measured->sd_s}};
}

}  // namespace vlp
