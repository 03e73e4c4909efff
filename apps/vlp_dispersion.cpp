// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <map>

#include "app.h"
#include "calibration/dispersion/dispersion.h"
#include "captures/captures_table.h"
#include "detect_folder.h"
#include "evaluation/dispersion_plot.h"
#include "history.h"
#include "rig/input_error.h"
#include "rig/stage.h"

namespace vlp {
namespace {

const std::map<std::string, DispersionMethod> kMethods{{"camera", DispersionMethod::camera},
                                                       {"paper", DispersionMethod::paper}};
const std::map<std::string, DispersionCircle> kCircles{{"mean", DispersionCircle::mean},
                                                       {"enclosing", DispersionCircle::enclosing}};

struct Options {
  DetectOptions detect;
  std::string captures, plot;
  std::string method = "camera", circle = "mean";
  std::optional<std::array<double, 2>> station_m;
};

/// captures.csv: the one named, or that in the folder of the images; empty when there is none.
std::string captures_file(const Options& options) {
  if (!options.captures.empty()) return options.captures;
  const auto beside = std::filesystem::path(options.detect.folder) / "captures.csv";
  return std::filesystem::exists(beside) ? beside.string() : "";
}

/// The captures whose place is known.
std::vector<StationCapture> at_station(const std::vector<Frame>& frames, const Options& options,
                                       const std::string& file) {
  const CapturesTable table = file.empty() ? CapturesTable{} : read_captures(file);
  std::vector<StationCapture> captures;
  for (const Frame& frame : frames) {
    const auto entry = table.find(frame.image);
    const Capture known = entry == table.end() ? Capture{} : entry->second;
    if (const auto& station_m = options.station_m) {
      captures.push_back({frame.detections, {(*station_m)[0], (*station_m)[1]}, known.inclination});
    } else if (known.x_m && known.y_m) {
      captures.push_back({frame.detections, {*known.x_m, *known.y_m}, known.inclination});
    }
  }
  if (captures.empty()) {
    const char* problem =
        "tells no place of these captures: it needs x_m and y_m, and the names of the images; "
        "or give --station";
    if (file.empty())
      throw std::invalid_argument("where is the station? Give --station or --captures");
    throw InputError(file, problem);
  }
  if (captures.size() < frames.size()) {
    spdlog::warn("{} of {} captures left out: {} does not tell their place",
                 frames.size() - captures.size(), frames.size(), file);
  }
  return captures;
}

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

void draw(const std::string& picture, const DispersionFit& fit) {
  DispersionPlot plot{"Fixes at a known station", {{}, fit.before}, {{}, fit.after}, {}};
  for (const auto& fix : fit.fixes) {
    if (fix.used) {
      plot.before.errors_m.push_back(fix.before_m);
      plot.after.errors_m.push_back(fix.after_m);
    } else {
      plot.outliers_m.push_back(fix.before_m);
    }
  }
  draw_dispersion_plot(picture, plot);
}

void run(const CLI::App& app, const Options& options) {
  const std::string table = captures_file(options);
  std::vector<std::string> inputs = inputs_of(options.detect);
  inputs.push_back(table);
  check_output(options.detect.output, inputs);
  check_plot(options.plot, options.detect.output, inputs);
  const LampMap lamps = read_lamp_map(options.detect.lamps);
  const Calibration calibration = read_calibration(options.detect.calibration);
  const auto frames = frames_of(options.detect, lamps, calibration);
  check_lamps(frames, lamps, options.detect.lamps);
  const auto captures = at_station(frames, options, table);
  const DispersionFit fit = fit_dispersion(
      captures, lamps, calibration, kMethods.at(options.method), kCircles.at(options.circle));
  check(fit);
  HistoryEntry entry = history_entry(app, inputs);
  if (!options.plot.empty()) draw(options.plot, fit);
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
  app.add_option("captures", options.detect.folder,
                 "A folder of images taken at the station, or their detections.csv")
      ->required();
  app.add_option("--lamps", options.detect.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.detect.calibration,
                 "Calibration of the camera; its rotation_center is applied")
      ->required();
  app.add_option("-o,--output", options.detect.output,
                 "Where to write the calibration with its dispersion")
      ->required();
  auto* station = app.add_option("--station", options.station_m, "Where the camera is in the world")
                      ->check(vlp::finite())
                      ->option_text("X_M Y_M");
  app.add_option("--captures", options.captures,
                 "captures.csv: image, x_m, y_m (where the camera is) [, roll_rad, pitch_rad]; "
                 "default: captures.csv in the folder")
      ->excludes(station);
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
  vlp::add_detect_options(app, options.detect);
  return vlp::run_app(app, argc, argv, [&] { vlp::run(app, options); });
}
