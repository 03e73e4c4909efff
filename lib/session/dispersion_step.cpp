// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/dispersion_step.h"

#include <fmt/core.h>

#include <utility>

#include "report/plots/calibration_plots.h"
#include "rig/stage.h"

namespace vlp {

KnownPlaces at_known_places(std::span<const Frame> frames, const CapturesTable& table,
                            const std::optional<Eigen::Vector2d>& place_m) {
  KnownPlaces places;
  for (const Frame& frame : frames) {
    const auto entry = table.find(frame.image);
    const Capture known = entry == table.end() ? Capture{} : entry->second;
    if (known.x_m && known.y_m) {
      places.captures.push_back({frame.detections, {*known.x_m, *known.y_m}, known.inclination});
    } else if (place_m) {
      places.captures.push_back({frame.detections, *place_m, known.inclination});
    } else {
      ++places.without;
    }
  }
  return places;
}

DispersionResult solve_dispersion(const LampCaptures& input, const KnownPlaces& places,
                                  DispersionMethod method, DispersionCircle circle,
                                  HistoryEntry entry) {
  DispersionResult result;
  Calibration levelled = input.calibration;
  levelled.dispersion.reset();
  if (doubts_map(input, levelled, result)) return result;
  result.fit = fit_dispersion(places.captures, input.lamps, input.calibration, method, circle);
  const DispersionFit& fit = result.fit;
  std::string why(explanation_of(fit.status));
  switch (fit.status) {
    case DispersionStatus::ok:
      break;
    case DispersionStatus::no_fix:
      why += fmt::format("; the first: {}", explanation_of(fit.no_fix_status));
      result.fail(StepFailure::undetermined, std::move(why));
      blame_map(input, levelled, result);
      return result;
    case DispersionStatus::station_far:
      result.fail(StepFailure::wrong_place, std::move(why));
      return result;
    default:
      result.fail(StepFailure::undetermined, std::move(why));
      return result;
  }
  if (!input.calibration.rotation_center) {
    result.warnings.emplace_back("the calibration has no rotation_center: run vlp-rotation first");
  }
  constexpr double millimetres = 1e3;
  result.metrics = {{"dispersion_mm", millimetres * fit.dispersion.radius_m},
                    {"dispersion_offset_px", fit.dispersion.offset_px.norm()}};
  if (const auto& world_m = fit.world_offset_m) {
    result.metrics.push_back({"world_mm", millimetres * world_m->norm()});
  }
  result.calibration = with_dispersion(input.calibration, fit.dispersion, std::move(entry));
  result.drawing = [fit] { return drawing_of(plot_of("Fixes at a known station", fit)); };
  return result;
}

}  // namespace vlp
