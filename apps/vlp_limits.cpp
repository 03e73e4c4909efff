// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-limits: computes the accuracy limits of a room, a camera and their errors.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "calibration/map/map_errors.h"
#include "evaluation/errors/floor_limits.h"
#include "evaluation/limits_table.h"
#include "geometry/angles.h"
#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_fixes.h"
#include "report/plots/floor_plot.h"
#include "rig/input_error.h"
#include "rig/lamp_map_file.h"
#include "session/lamp_captures.h"
#include "session/locate_step.h"

namespace vlp {
namespace {

struct Options {
  std::string lamps, room, calibration, map, picture;
  double height_m = 0;
  double yaw_deg = 0;
  double noise_px = 0, center_px = 0, tilt_deg = 0, lamp_map_mm = 0;
  bool stated = false;
  MotionOptions motion;
  double roll_pitch_sd_deg = 0;
  double step_m = 0.05;
  std::vector<double> floor_m;  // x_min x_max y_min y_max
};

std::string make_title(const Options& options) {
  std::string title = fmt::format("Camera at {} m, yaw {} deg", options.height_m, options.yaw_deg);
  if (const auto& speed = options.motion.max_speed_m_per_s) {
    title += fmt::format(", up to {} m/s", *speed);
  }
  if (options.roll_pitch_sd_deg > 0)
    title += fmt::format(", roll and pitch sd {} deg", options.roll_pitch_sd_deg);
  return title;
}

/// Returns the errors that calibration and map report.
UnitErrors make_unit_errors(const Options& options, const LampMap& lamps,
                            const Calibration& calibration) {
  UnitErrors unit(lamps, calibration);
  if (!unit.common_errors().has_known_errors()) {
    throw InputError(options.calibration,
                     "has no uncertainties, and " + options.lamps +
                         " has no sd_m; use --principal-point-px, --tilt-deg and --lamp-map-mm "
                         "instead of --from-calibration, or calibrate again");
  }
  constexpr std::array<const char*, kCommonErrorSources.size()> names{"lens", "zenith", "offset",
                                                                      "lamp map"};
  std::string unstated;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (unit.common_errors().is_known_or_absent(kCommonErrorSources[i])) continue;
    unstated.append(unstated.empty() ? "" : ", ").append(names[i]);
  }
  if (!unstated.empty()) {
    // [GATE-4] `count as zero` | no covariances in the calibration, no `sd_m` in the map | state
    //   them
    spdlog::warn("{}: the uncertainties are missing and count as zero", unstated);
  }
  if (const int elsewhere = unit.common_errors().num_lamps_moved_since_calibration();
      elsewhere > 0) {
    spdlog::warn(describe_moved_lamps(elsewhere));
  }
  return unit;
}

/// Returns the prior of velocity, yaw rate, roll and pitch.
BodyPrior make_body_prior(const Options& options, const Camera& camera) {
  BodyPrior prior;
  if (const auto motion = options.motion.make_motion_prior()) {
    check_timing_known(camera);
    prior.set_state_sd(kBodyVelocity, motion->velocity_sd_m_per_s);
    prior.set_state_sd(kBodyYawRate, motion->yaw_rate_sd_rad_per_s);
  }
  prior.set_state_sd(kBodyRoll, rad_from_deg(options.roll_pitch_sd_deg));
  return prior;
}

FloorLimits compute_limits(const Options& options, const LampMap& lamps, const FloorGrid& grid) {
  const Calibration calibration = read_calibration(options.calibration);
  const BodyPrior prior = make_body_prior(options, calibration.camera);
  const double yaw_rad = rad_from_deg(options.yaw_deg);
  if (options.stated) {
    return compute_floor_limits(make_unit_errors(options, lamps, calibration), grid,
                                options.height_m, yaw_rad, options.noise_px, prior);
  }
  return compute_floor_limits(lamps, calibration.camera, grid, options.height_m, yaw_rad,
                              {options.noise_px, options.center_px, rad_from_deg(options.tilt_deg),
                               1e-3 * options.lamp_map_mm},
                              prior);
}

void run(const Options& options) {
  check_outputs_distinct({{"--map", options.map}, {"--picture", options.picture}},
                         {options.lamps, options.calibration});
  const LampMap lamps = read_overhead_lamps(options.lamps, options.room);
  FloorGrid grid = make_floor_grid(lamps, options.step_m);
  if (const auto& floor = options.floor_m; !floor.empty()) {
    grid = {floor[0], floor[1], floor[2], floor[3], options.step_m};
  }
  const FloorLimits limits = compute_limits(options, lamps, grid);
  const auto summary = summarize_limits(limits);
  const bool is_free = options.motion.max_speed_m_per_s || options.roll_pitch_sd_deg > 0;
  if (!summary && is_free &&
      std::any_of(limits.positions.begin(), limits.positions.end(),
                  [](auto& one) { return one.lamps > 1; })) {
    throw Undetermined(
        "motion and tilt cannot be estimated at any position of this floor: an unknown tilt needs "
        "four visible lamps, or three with a unique solution; lower the camera, widen the lens, "
        "add lamps, or limit the unknowns (--roll-pitch-sd-deg, --max-speed-m-per-s)");
  }
  if (!summary) {
    throw Undetermined(
        "two lamps are visible from no position on this floor: is it under the lamps, and the "
        "camera below them? Otherwise lower the camera, widen the lens, or add lamps");
  }
  if (!options.map.empty()) write_floor_limits(options.map, limits);
  if (!options.picture.empty()) {
    write_floor_plot(options.picture, make_floor_plot(limits, make_title(options), options.step_m),
                     lamps);
  }
  print_floor_budget(*summary, limits, is_free);
  if (options.stated) print_largest_source(*summary);
}

void add_options(CLI::App& app, Options& options) {
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  add_room_option(app, options.room);
  app.add_option("--calibration", options.calibration,
                 "Calibration. Only its camera part is used, with --from-calibration all parts")
      ->required();
  app.add_option("--height-m", options.height_m, "Height of the camera in the world, in m")
      ->required()
      ->check(make_finite_validator());
  app.add_option("--noise-px", options.noise_px,
                 "Standard deviation of lamp positions in the image, per axis, in px")
      ->required()
      ->check(make_positive_validator());
  auto* center =
      app.add_option("--principal-point-px", options.center_px,
                     "Standard deviation of the principal point, per axis, in px (default: 0)")
          ->check(make_non_negative_validator());
  auto* tilt =
      app.add_option("--tilt-deg", options.tilt_deg,
                     "Standard deviation of the camera tilt, per axis, in degrees (default: 0)")
          ->check(make_non_negative_validator());
  auto* lamp_map =
      app.add_option(
             "--lamp-map-mm", options.lamp_map_mm,
             "Standard deviation of lamp positions in the map, per axis, in mm (default: 0)")
          ->check(make_non_negative_validator());
  app.add_flag("--from-calibration", options.stated,
               "Use the uncertainties of lens, zenith and dispersion offset in the calibration "
               "instead of these three options. Those of the lamps are sd_m of the map, or from "
               "the adjustment in the calibration")
      ->excludes(center)
      ->excludes(tilt)
      ->excludes(lamp_map);
  add_motion_options(
      app, options.motion,
      "Maximum speed of the camera, in m/s. Adds the contribution of estimating velocity and yaw "
      "rate (default: 0). With odometry of standard deviation S m/s, use 2 S");
  app.add_option("--roll-pitch-sd-deg", options.roll_pitch_sd_deg,
                 "Standard deviation of roll and pitch, in degrees. Adds the contribution of "
                 "estimating both (default: 0, known); 90: unknown")
      ->check(make_non_negative_validator());
  app.add_option("--yaw-deg", options.yaw_deg, "Yaw of the camera, in degrees (default: 0)")
      ->check(make_finite_validator());
  app.add_option("--floor-m", options.floor_m,
                 "Limits of the floor, in m (default: rectangle around the lamps)")
      ->expected(4)
      ->check(make_finite_validator())
      ->option_text("X_MIN X_MAX Y_MIN Y_MAX");
  app.add_option("--step-m", options.step_m, "Grid spacing on the floor, in m (default: 0.05)")
      ->check(make_positive_validator());
  app.add_option("--map", options.map, "Output file of the error budget at each position, CSV");
  app.add_option(
         "--picture", options.picture,
         "Output file of a plot of the horizontal standard deviation over the floor, .png or .svg")
      ->check(make_plot_file_validator());
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Computes the theoretical limit of positioning (CRLB) over a floor, and the error budget. "
      "The budget has the contributions of pixel noise, principal point, tilt and lamp map. With "
      "--from-calibration, the contributions follow from the uncertainties reported by calibration "
      "and lamp map. The limit holds for unbiased fixes from one image of a level camera.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-limits --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml --height-m 0 \\\n"
      "    --noise-px 0.05 --tilt-deg 0.01 --lamp-map-mm 0.1 --picture limits.png\n",
      "vlp-limits");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(options); });
}
