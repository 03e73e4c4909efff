// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-dispersion: estimates the dispersion offset from captures at known places.
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "program/app.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_calibration.h"
#include "program/steps/step_outcome.h"
#include "report/plots/gnuplot.h"
#include "rig/input_error.h"
#include "session/dispersion_step.h"
#include "session/session_folder.h"

namespace vlp {
namespace {

const std::map<std::string, DispersionMethod> kMethods{{"camera", DispersionMethod::camera},
                                                       {"chen-guan", DispersionMethod::chen_guan}};
const std::map<std::string, DispersionCircle> kCircles{{"mean", DispersionCircle::mean},
                                                       {"enclosing", DispersionCircle::enclosing}};

struct Options {
  CaptureOptions images;
  std::optional<std::array<double, 2>> reference_point_m;
  /// File captures.csv; empty: the one in the folder.
  std::string captures;
  std::string plot;
  std::string method = "camera", circle = "mean", of = "camera";
};

/// Reads the table of the captures, without their reference points if --reference-point gives them.
CapturesTable read_captures(const Options& options) {
  CapturesTable captures;
  if (!options.captures.empty()) {
    captures = read_captures_csv(options.captures);
  } else if (std::filesystem::is_directory(options.images.images)) {
    captures = read_captures_with_truth(options.images.images);
  }
  if (!options.reference_point_m) return captures;
  for (auto& [image, capture] : captures) capture.x_m = capture.y_m = std::nullopt;
  return captures;
}

KnownPositions collect_known_positions(const Options& options, const std::vector<Frame>& frames,
                                       const CapturesTable& captures) {
  std::optional<Eigen::Vector2d> reference_point_m;
  if (options.reference_point_m)
    reference_point_m = Eigen::Vector2d(options.reference_point_m->data());
  KnownPositions places =
      collect_known_captures(frames, captures, reference_point_m,
                             options.of == "axis" ? MeasuredPoint::axis : MeasuredPoint::camera);
  if (places.captures.empty() && captures.empty()) {
    throw std::invalid_argument(
        "the positions of the captures are unknown; give --reference-point or --captures");
  }
  const std::string table = options.captures.empty() ? options.images.images : options.captures;
  if (places.captures.empty()) {
    throw InputError(table,
                     "no capture has a position; add columns x_m and y_m for these images, or give "
                     "--reference-point");
  }
  return places;
}

void run(const CLI::App& app, Options options) {
  std::vector<std::string> inputs = list_capture_files(options.images);
  if (!options.captures.empty()) inputs.push_back(options.captures);
  for (const char* table : {"captures.csv", "truth.csv"}) {
    const auto beside = std::filesystem::path(options.images.images) / table;
    if (options.captures.empty() && std::filesystem::exists(beside)) inputs.push_back(beside);
  }
  check_outputs_distinct({{"--output", options.images.output}, {"--plot", options.plot}}, inputs);
  const CapturesTable captures = read_captures(options);
  options.images.captures = captures;
  const LampCaptures input = read_lamp_captures(options.images, ImageUse::known_positions);
  check_map_has_lamps(input.frames, input.lamps, input.lamps_file);
  const KnownPositions places = collect_known_positions(options, input.frames, captures);
  const DispersionResult found =
      run_dispersion_step(input, places, kMethods.at(options.method), kCircles.at(options.circle),
                          make_command_entry(app, inputs));
  print_step_remarks(found);
  require_success(found);
  if (!options.plot.empty()) write_plot(options.plot, found.drawing());
  write_calibration(options.images.output, found.calibration);
  print_dispersion(found.fit, found.calibration, places.captures.size());
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Estimates the dispersion offset of a camera, the image offset that remains in fixes at "
      "known positions. Captures at several yaws separate it from errors of lamp map and reference "
      "points.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-dispersion datasets/example/station.csv \\\n"
      "    --lamps datasets/example/lamps.yaml \\\n"
      "    --calibration datasets/example/calibration.yaml --reference-point 0.1 0 \\\n"
      "    -o calibration.yaml\n",
      "vlp-dispersion");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_capture_options(app, options.images,
                           {"Folder of images taken at known positions, or their detections.csv",
                            "Calibration of the camera. Its rotation_center is applied",
                            "Output file of the calibration with its dispersion, YAML"});
  auto* reference_point =
      app.add_option(
             "--reference-point", options.reference_point_m,
             "Known position of all captures in the world, in m. Overrides positions in tables")
          ->check(vlp::make_finite_validator())
          ->option_text("X_M Y_M");
  app.add_option("--position-of", options.of,
                 "Point to which --reference-point refers: camera (default), or axis, the rotation "
                 "axis at the distance of the lever arm")
      ->needs(reference_point)
      ->check(CLI::IsMember({"camera", "axis"}))
      ->option_text("camera|axis");
  app.add_option("--captures", options.captures,
                 "Table of captures, captures.csv: image, x_m, y_m [, reference_point, roll_rad, "
                 "pitch_rad] (default: captures.csv and truth.csv in the folder)")
      ->excludes(reference_point);
  app.add_option("--method", options.method,
                 "Method. camera (default): separates errors that rotate with the camera from "
                 "errors in the world; needs several yaws. chen-guan: moves the circle center to "
                 "the reference point; needs one yaw and an exact lamp map and reference point")
      ->check(CLI::IsMember({"camera", "chen-guan"}))
      ->option_text("camera|chen-guan");
  app.add_option("--circle", options.circle,
                 "Dispersion circle: mean (default), centered at the mean fix; or enclosing, the "
                 "smallest that contains all fixes")
      ->check(CLI::IsMember({"mean", "enclosing"}))
      ->option_text("mean|enclosing");
  app.add_option("--plot", options.plot,
                 "Output file of a plot of fixes and circles, .png or .svg");
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(app, options); });
}
