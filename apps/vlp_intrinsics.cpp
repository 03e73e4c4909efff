// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-intrinsics: estimates the lens of a camera from images of a board.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "camera/spline_grid.h"
#include "detection/boards/corner_table.h"
#include "evaluation/gate.h"
#include "frontend/board_intake.h"
#include "frontend/image_file.h"
#include "program/app.h"
#include "program/progress.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_calibration.h"
#include "program/steps/step_outcome.h"
#include "rig/file.h"
#include "session/lens_step.h"

namespace vlp {
namespace {

struct Options {
  std::vector<std::string> images;
  std::string board, output, corners, ros, kalibr, opencv, plot;
  std::optional<std::array<int, 2>> imager_px;
  std::string camera_id = "camera", lens = "LENSMODEL_OPENCV8";
  FrontendOptions frontend = make_intake_options();
  std::optional<double> pixel_pitch_m;
  int held_out = 0;
  WarpChoice warp = WarpChoice::automatic;
  std::vector<std::string> gates;
};

Camera known_camera(const Options& options) {
  Camera camera;
  camera.id = options.camera_id;
  // With --lens auto, the chosen model replaces it later.
  camera.lens_model = lens_model_from_name(options.lens).value_or(LensModel::opencv8);
  camera.pixel_pitch_m = options.pixel_pitch_m;
  camera.row_time_s = options.frontend.row_time_s;
  camera.readout = options.frontend.readout;
  return camera;
}

/// Returns the file of corners that is given instead of images; empty if images are given.
std::string corner_file(const CLI::App& app, const Options& options) {
  const auto found = std::find_if(options.images.begin(), options.images.end(),
                                  [](const auto& name) { return is_corner_file(name); });
  if (found == options.images.end()) {
    if (options.imager_px) {
      throw std::invalid_argument(
          "--imager-px: images have a size already; use it for files of corners only");
    }
    return "";
  }
  if (!options.corners.empty()) {
    throw std::invalid_argument("--corners: " + *found +
                                " is a file of corners already; leave --corners out");
  }
  if (options.images.size() > 1) {
    throw std::invalid_argument(*found + ": a file of corners excludes images; give it alone");
  }
  if (!options.imager_px) {
    throw std::invalid_argument(*found + ": a file of corners has no image size; give --imager-px");
  }
  for (const char* image_option : {"--cache", "--threads", "--max-mpx", "--max-blur-fraction",
                                   "--max-white-fraction", "--every"}) {
    if (app.count(image_option) == 0) continue;
    throw std::invalid_argument(std::string(image_option) + ": only for images, and " + *found +
                                " is a file of corners; leave it out");
  }
  return *found;
}

Observations observe(const std::vector<std::filesystem::path>& images, const Board& board,
                     const std::string& corners, const Options& options) {
  if (!corners.empty()) {
    return read_board_views(corners, board, options.board, *options.imager_px, options.frontend);
  }
  Progress progress("images");
  return detect_boards(images, board, options.board, options.frontend,
                       [&](std::size_t done, std::size_t total) { progress.update(done, total); });
}

/// Replaces the extension: camera.yaml and ".cameramodel" give camera.cameramodel.
std::string replace_extension(const std::string& output, const char* ending) {
  return std::filesystem::path(output).replace_extension(ending).string();
}

void write_exports(const Options& options, const Camera& camera) {
  if (!options.ros.empty()) write_file(options.ros, format_ros(camera));
  if (!options.kalibr.empty()) write_file(options.kalibr, format_camchain(camera));
  if (!options.opencv.empty()) write_file(options.opencv, format_opencv(camera));
}

bool chooses_lens(const Options& options) { return options.lens == kAutomaticLens; }

/// Throws std::invalid_argument if two images have the same name, which identifies an image in a
/// table of corners.
void check_names(const std::vector<std::filesystem::path>& images) {
  std::set<std::string> names;
  for (const auto& image : images) {
    if (names.insert(image.filename().string()).second) continue;
    throw std::invalid_argument(fmt::format(
        "--corners: two images have the name {}; rename one of them", image.filename().string()));
  }
}

/// Throws std::invalid_argument if a format does not support the lens model of the camera, before
/// any output is written.
void check_exports(const Options& options, Camera camera) {
  camera.imager_px = {1, 1};
  camera.intrinsics.assign(num_lens_parameters(camera.lens_model), 1);
  if (!options.ros.empty()) format_ros(camera);
  if (!options.kalibr.empty()) format_camchain(camera);
  if (!options.opencv.empty()) format_opencv(camera);
}

/// Returns the default gates with the changes of the command line.
std::vector<Gate> parse_gates(const Options& options) {
  return merge_gates(make_lens_gates(),
                     parse_gates(options.gates, list_metric_kinds({MetricSource::lens})));
}

/// Returns true if a gate of the lens fails, not only gates of the views.
bool has_failed_gate(const std::vector<CheckedMetric>& gates) {
  return std::ranges::any_of(gates, [](const CheckedMetric& gate) {
    return !gate.has_passed_gate() &&
           (gate.name == "rms_px" || gate.name == "expected_max_error_px" ||
            gate.name == "split_half_px");
  });
}

/// Writes calibration, corners, exports and plot.
void write_results(const Options& options, const LensResult& result) {
  const LensEstimate& lens = result.lens;
  write_calibration(options.output, result.calibration);
  if (can_mrcal_solve(result.calibration.camera.lens_model)) {
    write_cameramodel(replace_extension(options.output, ".cameramodel"), lens.solution,
                      lens.report.region);
  } else {
    // A file of an earlier run would belong to another lens.
    std::filesystem::remove(replace_extension(options.output, ".cameramodel"));
  }
  write_mrcal_corners(replace_extension(options.output, ".corners.vnl"), lens.solution,
                      lens.images);
  write_exports(options, result.calibration.camera);
  if (!options.plot.empty()) write_plot(options.plot, result.drawing());
}

/// Throws GateNotMet with a remedy if a gate fails.
void require_gates_passed(const std::vector<Gate>& gates, const LensResult& result) {
  const LensEstimate& lens = result.lens;
  const auto checked = check_gates(gates, result.metrics);
  const std::string failed = describe_failed_gates(checked);
  if (failed.empty()) return;
  if (lens.better_model && has_failed_gate(checked)) {
    throw GateNotMet(fmt::format("{}; use --lens {}", failed, lens_model_name(*lens.better_model)));
  }
  if (std::isfinite(lens.report.uncertainty_worst_px)) {
    throw GateNotMet(
        fmt::format("{}; add views, next {}", failed, recommend_next_view(lens.coverage)));
  }
  throw GateNotMet(
      fmt::format("{}; the estimated lens has no rays in part of the image: use another lens "
                  "model, for a wide lens --lens OPENCV_FISHEYE",
                  failed));
}

/// Prints the components of the uncertainty other than noise.
void print_uncertainty(const LensEstimate& lens) {
  if (const auto& model = lens.model_uncertainty) {
    fmt::print(
        "model choice  {:.3f} px mean, {:.3f} px worst: differences to models that the views do "
        "not exclude, mainly to {}; focal length sd {:.2f} px; in the uncertainty above and in "
        "the covariance\n",
        model->mean_px, model->worst_px, lens_model_name(model->model),
        std::sqrt(model->intrinsics_covariance(0, 0)));
  } else if (!lens.are_models_compared) {
    fmt::print(
        "model choice  not in the uncertainty above: {}\n",
        is_splined_lens_model(lens.solution.problem.lens_model)
            ? "splined lenses are not compared"
            : fmt::format("needs {} views, and another model that fits", kMinViewsToCompare));
  }
  if (lens.print_px) {
    fmt::print("board print   {:.3f} px, in the uncertainty above and in the covariance\n",
               *lens.print_px);
  }
}

void run(const CLI::App& app, const Options& options) {
  const std::vector<Gate> gates = parse_gates(options);
  if (!chooses_lens(options)) check_exports(options, known_camera(options));
  const std::string corners = corner_file(app, options);
  check_every_option(options.frontend.every, options.images);
  const auto images = corners.empty() ? expand_folders(options.images)
                                      : std::vector<std::filesystem::path>{options.images.front()};
  std::vector<std::string> inputs{options.board};
  for (const auto& image : images) inputs.push_back(image.string());
  check_outputs_distinct(
      {{"--output", options.output},
       {"--output's .cameramodel", replace_extension(options.output, ".cameramodel")},
       {"--output's .corners.vnl", replace_extension(options.output, ".corners.vnl")},
       {"--ros", options.ros},
       {"--kalibr", options.kalibr},
       {"--opencv", options.opencv},
       {"--corners", options.corners},
       {"--plot", options.plot}},
      inputs);
  if (!options.corners.empty()) check_names(images);
  const Board board = read_board(options.board);
  select_board_warp(board, options.warp);  // throws before the images are read
  LensInput input{observe(images, board, corners, options),
                  board,
                  options.board,
                  known_camera(options),
                  options.held_out,
                  options.warp,
                  chooses_lens(options)};
  // After the images: unusable files are not read for their digests.
  const LensResult result = run_lens_step(std::move(input), make_command_entry(app, inputs));
  print_step_remarks(result);
  const LensEstimate& lens = result.lens;
  if (!options.corners.empty() && !lens.views.empty()) {
    write_corner_table(options.corners, lens.views, board);
  }
  require_success(result);
  check_exports(options, result.calibration.camera);  // the selected lens model
  write_results(options, result);
  if (lens.choice) fmt::print("lens model    {}\n", describe_lens_choice(*lens.choice));
  print_lens(lens.solution, lens.report, lens.coverage, lens.held_out);
  print_uncertainty(lens);
  require_gates_passed(gates, result);
}

void add_input_options(CLI::App& app, Options& options) {
  app.add_option("images", options.images,
                 "Images of the board, folders of images, or videos; or one file of corners, .vnl "
                 "of mrcal or .csv of --corners, with --imager-px")
      ->required();
  app.add_option("--board", options.board,
                 "Board description: board.yaml, or Kalibr's YAML of an aprilgrid or checkerboard")
      ->required();
  app.add_option("-o,--output", options.output,
                 "Output file of the calibration with its camera part, YAML. Files of mrcal get "
                 "the same name: .corners.vnl and, if mrcal supports the lens model, .cameramodel")
      ->required();
  app.add_option("--camera-id", options.camera_id,
                 "Camera id in the calibration (default: camera)");
  add_lens_model(app, options.lens);
  app.add_option("--row-time-s", options.frontend.row_time_s,
                 "Row time: time between the readout of successive rows, in s. Needed to identify "
                 "lamps by frequency; vlp-train --row-time estimates it")
      ->check(CLI::Range(1e-8, 1e-3));
  add_readout(app, options.frontend.readout);
  app.add_option("--imager-px", options.imager_px,
                 "Width and height of the images of a corner file, in px")
      ->check(CLI::Range(16, 100000))
      ->option_text("WIDTH HEIGHT");
}

void add_solve_options(CLI::App& app, Options& options) {
  app.add_option("--corners", options.corners,
                 "Output file of the detected corners, .csv. It can replace the images in a later "
                 "calibration")
      ->check(make_extension_validator(".csv"));
  app.add_option("--pixel-pitch-m", options.pixel_pitch_m, "Pixel pitch of the imager, in m")
      ->check(CLI::Range(1e-7, 1e-4));
  app.add_option("--held-out", options.held_out,
                 "Exclude every Nth view from the solve, and report its residuals")
      ->check(CLI::Range(2, 1000))
      ->option_text("N");
  app.add_option_function<std::string>(
         "--warp",
         [&options](const std::string& name) {
           options.warp = name == "on"    ? WarpChoice::on
                          : name == "off" ? WarpChoice::off
                                          : WarpChoice::automatic;
         },
         "Estimate the warp of the board. auto (default): keep it if it reduces the residuals "
         "significantly")
      ->check(CLI::IsMember({"auto", "on", "off"}))
      ->option_text("auto|on|off");
  app.add_option(
         "--gate", options.gates,
         "Change or add a gate of a lens metric. Defaults: rms_px=1, expected_max_error_px=2 (of a "
         "projection in the valid region), split_half_px=1 (RMS difference between the lenses of "
         "two halves of the views), coverage=0.4 (fraction of the image), views=6 (distinct "
         "views), board_tilt_deg=20 (between two views)")
      ->delimiter(',')
      ->option_text("NAME=VALUE,...");
}

void add_output_options(CLI::App& app, Options& options) {
  app.add_option("--ros", options.ros, "Output file of the camera for ROS (camera_info), YAML");
  app.add_option("--kalibr", options.kalibr,
                 "Output file of the camera for Kalibr (camchain), YAML");
  app.add_option("--opencv", options.opencv,
                 "Output file of the camera for OpenCV (FileStorage), YAML");
  app.add_option(
         "--plot", options.plot,
         "Output file of a plot of corners, residuals and uncertainty over the image, .png or .svg")
      ->check(make_plot_file_validator());
  app.add_option("--cache", options.frontend.corner_cache,
                 "Folder for the detected corners of each image, which later runs reuse");
  add_every_option(app, options.frontend.every);
  add_max_mpx_option(app, options.frontend.max_mpx);
  add_quality_options(app, options.frontend);
  add_threads_option(app, options.frontend.threads);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Calibrates the lens of a camera from images of a board: AprilTags (see vlp-board), Kalibr "
      "AprilGrid, ChArUco or chessboard. Reports the uncertainty of the result. Exit code 1 if a "
      "gate fails.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-simulate datasets/paper-rig/scene.yaml --only boards -o out/rig\n"
      "  build/bin/vlp-intrinsics out/rig/boards/*.png --board out/rig/board.yaml \\\n"
      "    --row-time-s 3e-5 --readout rows -o camera.yaml\n",
      "vlp-intrinsics");
  CLI::App& app = *parser;
  vlp::Options options;
  vlp::add_input_options(app, options);
  vlp::add_solve_options(app, options);
  vlp::add_output_options(app, options);
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(app, options); });
}
