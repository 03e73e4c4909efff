// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-dispersion: captures at a known station -> what their fixes still lack.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <map>
#include <string>

#include "app.h"
#include "calibration/dispersion/dispersion.h"
#include "calibration/plots/calibration_plots.h"
#include "capture_options.h"
#include "check_map.h"
#include "history.h"
#include "rig/stage.h"
#include "station_captures.h"

namespace vlp {
namespace {

const std::map<std::string, DispersionMethod> kMethods{{"camera", DispersionMethod::camera},
                                                       {"paper", DispersionMethod::paper}};
const std::map<std::string, DispersionCircle> kCircles{{"mean", DispersionCircle::mean},
                                                       {"enclosing", DispersionCircle::enclosing}};

struct Options {
  DetectOptions detect;
  StationOptions station;
  std::string plot;
  std::string method = "camera", circle = "mean";
};

void check(const DispersionFit& fit) {
  switch (fit.status) {
    case DispersionStatus::ok:
      return;
    case DispersionStatus::no_fix:
      throw Undetermined(fmt::format("{}; the first: {}", explanation_of(fit.status),
                                     explanation_of(fit.no_fix_status)));
    case DispersionStatus::station_far:
      throw std::invalid_argument(std::string(explanation_of(fit.status)));
    default:
      throw Undetermined(std::string(explanation_of(fit.status)));
  }
}

void print_circle(const char* name, const Circle& circle) {
  fmt::print("{:12}radius {:.3f} mm, centre {:.3f} {:.3f} mm from the station\n", name,
             1e3 * circle.radius, 1e3 * circle.center.x(), 1e3 * circle.center.y());
}

void print_summary(const DispersionFit& fit, std::size_t captures) {
  const Dispersion& found = fit.dispersion;
  fmt::print("captures    {}, {} used, {} left out as outliers, {} without a fix\n", captures,
             found.captures, static_cast<int>(fit.fixes.size()) - found.captures,
             fit.captures_without_fix);
  print_circle("before", fit.before);
  print_circle("after", fit.after);
  fmt::print("offset      {:.4f} {:.4f} px", found.offset_px.x(), found.offset_px.y());
  if (found.covariance) {
    fmt::print(", sd {:.4f} {:.4f} px", std::sqrt((*found.covariance)(0, 0)),
               std::sqrt((*found.covariance)(1, 1)));
  }
  fmt::print(", fixed in the camera\n");
  if (const auto& world_m = fit.world_offset_m) {
    fmt::print(
        "world       {:.3f} {:.3f} mm, sd {:.3f} {:.3f} mm, fixed in the world: lamp map or "
        "station; not corrected\n",
        1e3 * world_m->x(), 1e3 * world_m->y(), 1e3 * std::sqrt(fit.world_covariance(0, 0)),
        1e3 * std::sqrt(fit.world_covariance(1, 1)));
  } else {
    fmt::print("world       supposed right: an error of lamp map or station is in the offset\n");
  }
}

void run(const CLI::App& app, const Options& options) {
  const std::string table = captures_file(options.station, options.detect.folder);
  std::vector<std::string> inputs = inputs_of(options.detect);
  inputs.push_back(table);
  check_output(options.detect.output, inputs);
  check_plot(options.plot, options.detect.output, inputs);
  const CaptureInput input = read_captures_of(options.detect);
  const auto& [lamps, calibration, frames] = input;
  check_lamps(frames, lamps, options.detect.lamps);
  Calibration levelled = calibration;
  levelled.dispersion.reset();
  check_map(input, levelled, options.detect);
  const auto captures = at_station(frames, options.station, table);
  const DispersionFit fit = fit_dispersion(
      captures, lamps, calibration, kMethods.at(options.method), kCircles.at(options.circle));
  if (fit.status == DispersionStatus::no_fix) check_map_of_failure(input, levelled, options.detect);
  check(fit);
  HistoryEntry entry = history_entry(app, inputs);
  if (!options.plot.empty()) {
    draw_dispersion_plot(options.plot, plot_of("Fixes at a known station", fit));
  }
  write_calibration(options.detect.output,
                    with_dispersion(calibration, fit.dispersion, std::move(entry)));
  if (!calibration.rotation_center) {
    spdlog::warn("the calibration has no rotation_center: run vlp-rotation first");
  }
  print_summary(fit, captures.size());
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "What a camera's fixes at a known station still lack: an offset of the image centre, told\n"
      "apart from errors of lamp map and station by captures at different yaws.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-dispersion datasets/example/station.csv \\\n"
      "    --lamps datasets/example/lamps.yaml --calibration datasets/example/calibration.yaml \\\n"
      "    --station 0.1 0 -o calibration.yaml\n",
      "vlp-dispersion");
  vlp::Options options;
  vlp::add_capture_options(app, options.detect,
                           {"A folder of images taken at the station, or their detections.csv",
                            "Calibration of the camera; its rotation_center is applied",
                            "Where to write the calibration with its dispersion"});
  vlp::add_station_options(app, options.station);
  app.add_option(
         "--method", options.method,
         "camera (default): captures at different yaws; paper: the circle's centre, captures "
         "at one yaw, lamp map and station supposed right")
      ->check(CLI::IsMember({"camera", "paper"}))
      ->option_text("camera|paper");
  app.add_option("--circle", options.circle,
                 "The dispersion circle: around the mean fix (default), or the smallest enclosing")
      ->check(CLI::IsMember({"mean", "enclosing"}))
      ->option_text("mean|enclosing");
  app.add_option("--plot", options.plot, "Draw the fixes and their circles, .png or .svg");
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
