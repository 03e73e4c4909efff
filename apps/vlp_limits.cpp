// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-limits: what accuracy a room, a camera and their errors allow.
#include <fmt/core.h>

#include <CLI/CLI.hpp>

#include "app.h"
#include "captures/csv_writer.h"
#include "geometry/angles.h"
#include "positioning/floor_limits.h"
#include "positioning/floor_summary.h"
#include "report/plots/floor_plot.h"

namespace vlp {
namespace {

struct Options {
  std::string lamps, calibration, map, picture;
  double height_m = 0;
  double yaw_deg = 0;
  double noise_px = 0, center_px = 0, tilt_deg = 0, lamp_map_mm = 0;
  double step_m = 0.05;
  std::vector<double> floor_m;  // x_min x_max y_min y_max
};

void write_map(const std::string& file, const std::vector<FloorLimit>& limits) {
  constexpr int digits = 6;
  CsvWriter csv(
      file, {"x_m", "y_m", "z_m", "yaw_rad", "lamps", "sd_x_m", "sd_y_m", "sd_z_m", "sd_yaw_rad",
             "noise_m", "center_m", "tilt_m", "lamp_map_m", "horizontal_m"});
  for (const FloorLimit& limit : limits) {
    const auto& [position_m, yaw_rad] = limit.camera;
    const auto at = [](double value) { return significant(value, digits); };
    const std::string x = at(position_m.x()), y = at(position_m.y()), z = at(position_m.z());
    const std::string yaw = at(yaw_rad), lamps = std::to_string(limit.lamps);
    if (!limit.budget) {
      csv.row({x, y, z, yaw, lamps, "", "", "", "", "", "", "", "", ""});
      continue;
    }
    const ErrorBudget& budget = *limit.budget;
    const Eigen::Vector4d sd = budget.total().diagonal().cwiseSqrt();
    const auto horizontal = [&](const Matrix4& covariance) {
      return at(spread_of(covariance).horizontal_m);
    };
    csv.row({x, y, z, yaw, lamps, at(sd[0]), at(sd[1]), at(sd[2]), at(sd[3]),
             horizontal(budget.noise), horizontal(budget.center), horizontal(budget.tilt),
             horizontal(budget.lamp_map), horizontal(budget.total())});
  }
  csv.save();
}

void draw_map(const Options& options, const std::vector<FloorLimit>& limits, const LampMap& lamps) {
  FloorPlot plot{fmt::format("Camera at {} m, yaw {} deg", options.height_m, options.yaw_deg),
                 "horizontal standard deviation (mm)",
                 options.step_m,
                 {}};
  for (const FloorLimit& limit : limits) {
    plot.places.push_back({limit.camera.position_m.head<2>(), {}});
    if (limit.budget) {
      plot.places.back().value = 1e3 * spread_of(limit.budget->total()).horizontal_m;
    }
  }
  draw_floor_plot(options.picture, plot, lamps);
}

void print_summary(const FloorSummary& summary, std::size_t places) {
  fmt::print("places      {}, two lamps or more in view at {}\n\n", places,
             summary.places_with_fix);
  fmt::print("{:11} {:>21} {:>21} {:>21}\n", "one sigma", "horizontal (mm)", "height (mm)",
             "yaw (deg)");
  fmt::print("{:11}", "source");
  for (int i = 0; i < 3; ++i) fmt::print(" {:>10} {:>10}", "median", "worst");
  fmt::print("\n");
  for (const auto& [source, median, worst] : summary.rows) {
    fmt::print("{:11} {:10.3f} {:10.3f} {:10.3f} {:10.3f} {:10.4f} {:10.4f}\n", source,
               1e3 * median.horizontal_m, 1e3 * worst.horizontal_m, 1e3 * median.height_m,
               1e3 * worst.height_m, deg_from_rad(median.yaw_rad), deg_from_rad(worst.yaw_rad));
  }
}

void run(const Options& options) {
  check_output(options.map, {options.lamps, options.calibration});
  check_output(options.picture, {options.lamps, options.calibration});
  if (!options.map.empty() && options.map == options.picture) {
    throw std::invalid_argument("--map and --picture name one file");
  }
  const LampMap lamps = read_lamp_map(options.lamps);
  const Camera camera = read_calibration(options.calibration).camera;
  FloorGrid grid = floor_under(lamps, options.step_m);
  if (const auto& floor = options.floor_m; !floor.empty()) {
    grid = {floor[0], floor[1], floor[2], floor[3], options.step_m};
  }
  const auto limits =
      floor_limits(lamps, camera, grid, options.height_m, rad_from_deg(options.yaw_deg),
                   {options.noise_px, options.center_px, rad_from_deg(options.tilt_deg),
                    1e-3 * options.lamp_map_mm});
  const auto summary = summarize(limits);
  if (!summary) {
    throw Undetermined(
        "two lamps are in view nowhere on this floor: is it under the lamps, and the camera below "
        "them? Otherwise lower the camera, widen the lens, or add lamps");
  }
  if (!options.map.empty()) write_map(options.map, limits);
  if (!options.picture.empty()) draw_map(options, limits, lamps);
  print_summary(*summary, limits.size());
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "The theoretical limit of positioning over a floor, and the error budget: what pixel noise,\n"
      "image centre, tilt and lamp map each do to a fix. Nothing better can be reached with that\n"
      "pixel noise, whatever the method.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-limits --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml --height-m 0 \\\n"
      "    --noise-px 0.05 --tilt-deg 0.01 --lamp-map-mm 0.1 --picture limits.png\n",
      "vlp-limits");
  vlp::Options options;
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.calibration, "Calibration; its camera part is used")
      ->required();
  app.add_option("--height-m", options.height_m, "Height of the camera in the world")
      ->required()
      ->check(vlp::finite());
  app.add_option("--noise-px", options.noise_px,
                 "Standard deviation of each lamp's pixel, per axis")
      ->required()
      ->check(vlp::finite_positive());
  app.add_option("--center-px", options.center_px, "... of the image centre, per axis (default 0)")
      ->check(vlp::finite_not_negative());
  app.add_option("--tilt-deg", options.tilt_deg, "... of the camera's tilt, per axis (default 0)")
      ->check(vlp::finite_not_negative());
  app.add_option("--lamp-map-mm", options.lamp_map_mm,
                 "... of each lamp's position, per axis (default 0)")
      ->check(vlp::finite_not_negative());
  app.add_option("--yaw-deg", options.yaw_deg, "Yaw of the camera (default 0)")
      ->check(vlp::finite());
  app.add_option("--floor-m", options.floor_m,
                 "The floor (default: the rectangle around the lamps)")
      ->expected(4)
      ->check(vlp::finite())
      ->option_text("X_MIN X_MAX Y_MIN Y_MAX");
  app.add_option("--step-m", options.step_m, "Distance between places on the floor (default 0.05)")
      ->check(vlp::finite_positive());
  app.add_option("--map", options.map, "Write the figures of every place to this CSV file");
  app.add_option("--picture", options.picture,
                 "Draw the horizontal standard deviation over the floor, .png or .svg")
      ->check([](const std::string& name) {
        const bool known = name.ends_with(".png") || name.ends_with(".svg");
        return known ? std::string() : "a picture's name should end in .png or .svg";
      });
  return vlp::run_app(app, argc, argv, [&] { vlp::run(options); });
}
