// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/row_time_check.h"

#include <fmt/core.h>

#include <cmath>

#include "lamps/signal/lamp_rule.h"
#include "session/row_time_step.h"

namespace vlp {
namespace {

/// Fewer lamps may be wrong in the map instead.
constexpr int kMinRowTimeLamps = 3;
constexpr double kMicrosecondsPerSecond = 1e6;

bool contradicts(const RowTime& measured, double stated_s) {
  constexpr double max_sds = 3;
  return measured.lamps >= kMinRowTimeLamps &&
         std::abs(std::log(measured.row_time_s / stated_s)) >
             kLampDrift + max_sds * measured.sd_s / measured.row_time_s;
}

std::string describe_contradiction(const RowTime& measured, const StatedRowTime& stated) {
  return fmt::format(
      "row time is {:.6g} us in {}, but the stripes of {} lamps measure {:.2f} +- {:.2f} us; "
      "correct it, or, if it is right, all frequencies of the lamp map by this ratio",
      kMicrosecondsPerSecond * stated.row_time_s, stated.source, measured.lamps,
      kMicrosecondsPerSecond * measured.row_time_s, kMicrosecondsPerSecond * measured.sd_s);
}

/// Collects the periods of identified lamps. A period found by modulation is excluded: its search
/// begins at the stated row time.
std::vector<MeasuredPeriod> collect_lamp_periods(const std::vector<Observation>& images) {
  std::vector<MeasuredPeriod> periods;
  for (const Observation& image : images) {
    if (!image.is_kept()) continue;  // copies, and images of another camera
    for (const Light& light : image.lights) {
      const bool is_measured = light.kind == LightKind::lamp && light.lamp &&
                               !light.by_modulation && trustworthy(light.stripes);
      if (!is_measured) continue;
      periods.push_back({light.stripes.period_lines, light.lamp});
    }
  }
  return periods;
}

}  // namespace

RowTimeCheck check_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                            const StatedRowTime& stated) {
  const auto found = estimate_row_time(collect_lamp_periods(images), lamps);
  if (found.candidates.empty()) return {};
  const RowTime& measured = found.candidates.front().row_time;
  if (measured.lamps < kMinRowTimeLamps) return {};
  if (!contradicts(measured, stated.row_time_s)) return {measured};
  return {measured, describe_contradiction(measured, stated)};
}

std::string find_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                const std::optional<Lens>& lens, const StatedRowTime& stated) {
  const auto found = choose_row_time_by_places({&images}, {{}}, lamps, lens).found;
  if (!found || !contradicts(*found, stated.row_time_s)) return "";
  return describe_contradiction(*found, stated);
}

std::string describe_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                    const Camera& camera, const std::string& source,
                                    bool has_result) {
  if (!camera.row_time_s) return "";
  const StatedRowTime stated{*camera.row_time_s, source};
  if (has_result) return check_row_time(images, lamps, stated).error;
  return find_row_time_error(images, lamps, Lens(camera.lens_model, camera.intrinsics), stated);
}

std::vector<Metric> row_time_metrics(const RowTimeCheck& check) {
  if (!check.measured) return {};
  return {{"row_time_us", kMicrosecondsPerSecond * check.measured->row_time_s},
          {"row_time_sd_us", kMicrosecondsPerSecond * check.measured->sd_s}};
}

}  // namespace vlp
