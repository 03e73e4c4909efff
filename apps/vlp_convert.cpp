// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-convert: converts the file of a camera from the format of one tool to that of another, and
/// corners of a board to lamps.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/corner_lamps.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/valid_region.h"
#include "captures/printable.h"
#include "detection/boards/corner_table.h"
#include "frontend/board_intake.h"
#include "program/app.h"
#include "program/steps/step_outcome.h"
#include "rig/calibration_builder.h"
#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

struct Options {
  std::string input, output, to = "calibration", lens, camera_id, board;
  std::optional<double> sigma_px, sd_m;
};

std::string format_camera_file(const Options& options, const Camera& camera,
                               const ImageRegion& region) {
  if (options.to == "mrcal") return format_cameramodel(camera, region);
  if (options.to == "opencv") return format_opencv(camera);
  return options.to == "ros" ? format_ros(camera) : format_camchain(camera);
}

/// Returns a report with the calibrated region of the lens only; std::nullopt without a region.
std::optional<IntrinsicsReport> make_region_report(const ImageRegion& region) {
  if (region.empty()) return std::nullopt;
  IntrinsicsReport report{};
  report.region_px = region;
  return report;
}

void print_region(const Options& options, const Camera& camera, const ImageRegion& region) {
  if (region.empty()) return;
  const bool kept = options.to == "calibration" || options.to == "mrcal";
  fmt::print("known         in {:.1f} % of the image, which {}\n",
             100 * compute_area_fraction(region, camera.imager_px),
             kept ? "is kept" : "the format does not support");
}

std::vector<BoardView> read_corners(const std::string& file, const Board& board) {
  constexpr int any = std::numeric_limits<int>::max();  // a conversion needs no image size
  return std::filesystem::path(file).extension() == ".csv"
             ? read_corner_table(file, board, {any, any})
             : read_mrcal_corners(file, board, {any, any});
}

void convert_corners(const Options& options) {
  if (!is_corner_file(options.input) || options.board.empty()) {
    throw std::invalid_argument(
        "--to lamps needs corners of a board (.csv or .vnl) as input, and --board");
  }
  const Board board = read_board(options.board);
  const CornerLamps lamps =
      make_corner_lamps(read_corners(options.input, board), board, options.sigma_px, options.sd_m);
  if (lamps.corners == 0) throw InputError(options.input, "has no corner of the board");
  if (lamps.corners_without_sd > 0 && !lamps.sigma_px) {
    throw InputError(options.input,
                     "too few corners to estimate the sigma_px of those without sd_px; give "
                     "--sigma-px");
  }
  const std::filesystem::path folder = options.output;
  std::filesystem::create_directories(folder);
  for (const char* name : {"lamps.yaml", "detections.csv"})
    check_output_is_no_input((folder / name).string(), {options.input, options.board});
  write_lamp_map(folder / "lamps.yaml", lamps.map);
  write_detections(folder / "detections.csv", lamps.frames);
  fmt::print("lamps         {} corners of the board, in lamps.yaml\n", lamps.map.lamps.size());
  fmt::print("detections    {} in {} images, in detections.csv\n", lamps.corners,
             lamps.frames.size());
  fmt::print("sigma_px      {} from sd_px", lamps.corners - lamps.corners_without_sd);
  if (lamps.corners_without_sd > 0) {
    fmt::print(", {} of {:.3g} px {}", lamps.corners_without_sd, *lamps.sigma_px,
               options.sigma_px ? "from --sigma-px" : "estimated from neighboring corners");
  }
  fmt::print("\n");
  if (lamps.left_out > 0)
    fmt::print("left out      {} corners: a fix takes at most 256\n", lamps.left_out);
  if (board.print_sd > 0) {
    fmt::print("print_sd      {:g} is not in lamps.yaml: distances have this relative error\n",
               board.print_sd);
  }
}

void run(const CLI::App& app, const Options& options) {
  for (const char* option : {"--board", "--sigma-px", "--sd-m"}) {
    if (app.count(option) > 0 && options.to != "lamps")
      throw std::invalid_argument(std::string(option) + ": only with --to lamps; leave it out");
  }
  for (const char* option : {"--lens", "--camera-id"}) {
    if (app.count(option) > 0 && options.to == "lamps")
      throw std::invalid_argument(std::string(option) + ": not with --to lamps; leave it out");
  }
  if (options.to == "lamps") return convert_corners(options);
  check_output_is_no_input(options.output, {options.input});
  const auto [read, region] = read_any_camera(options.input);
  FittedCamera fitted{read, 0, 1};
  const std::string was(lens_model_name(fitted.camera.lens_model));
  if (!options.lens.empty()) {
    fitted = convert_lens_model(fitted.camera, *lens_model_from_name(options.lens));
  }
  Camera& camera = fitted.camera;
  if (!options.camera_id.empty()) camera.id = options.camera_id;
  if (options.to == "calibration") {
    write_calibration(options.output, make_calibration(camera, make_region_report(region),
                                                       make_command_entry(app, {options.input})));
  } else {
    write_file(options.output, format_camera_file(options, camera, region));
  }
  if (options.to == "calibration") {
    fmt::print("kept          the camera alone; vlp-rotation and vlp-dispersion add the rest\n");
  }
  fmt::print("camera        {}, {} x {} px\n", escape_for_line(camera.id), camera.imager_px[0],
             camera.imager_px[1]);
  if (was == lens_model_name(camera.lens_model)) {
    fmt::print("lens          {}, unchanged\n", was);
  } else {
    fmt::print(
        "lens          {}, fitted to {}: {:.3g} px apart at worst, over {:.1f} % of the image\n",
        lens_model_name(camera.lens_model), was, fitted.worst_px, 100 * fitted.common_fraction);
  }
  print_region(options, camera, region);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Converts a camera file between the formats of this toolbox (calibration), mrcal "
      "(.cameramodel), OpenCV (FileStorage, also of cv::fisheye), ROS (camera_info) and Kalibr "
      "(camchain). The format of the input is detected from its content. Parameters stay unchanged "
      "if the output format supports the lens model. Otherwise, fit a supported model with "
      "--lens.\n\n"
      "With --to lamps, converts the corners of a board in images to a lamp map and detections, "
      "with "
      "which vlp-locate computes the pose of the camera in each image.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-convert datasets/paper-rig/rendered/true_calibration.yaml \\\n"
      "    --to ros -o ros.yaml\n",
      "vlp-convert");
  CLI::App& app = *parser;
  vlp::Options options;
  app.add_option("input", options.input,
                 "Input file with a camera; or corners of a board (.csv of vlp-intrinsics "
                 "--corners, .vnl of "
                 "mrcal), with --to lamps")
      ->required();
  app.add_option("-o,--output", options.output,
                 "Output file; with --to lamps a folder, for lamps.yaml and detections.csv")
      ->required();
  app.add_option("--to", options.to, "Output format (default: calibration)")
      ->check(CLI::IsMember({"calibration", "mrcal", "opencv", "ros", "kalibr", "lamps"}))
      ->option_text("calibration|mrcal|opencv|ros|kalibr|lamps");
  auto* board = app.add_option("--board", options.board, "With --to lamps: board of the corners");
  app.add_option("--sigma-px", options.sigma_px,
                 "With --to lamps: standard deviation per axis, in px, of corners whose sd_px is 0 "
                 "or missing (default: estimated from neighboring corners)")
      ->check(CLI::Range(vlp::kMinSigma_px, vlp::kMaxSigma_px))
      ->needs(board);
  app.add_option("--sd-m", options.sd_m,
                 "With --to lamps: standard deviation of the corners on the board per axis, in m "
                 "(default: exact)")
      ->check(CLI::Range(0.0, 1.0))
      ->needs(board);
  app.add_option("--lens", options.lens,
                 "Lens model to fit to the input. The largest difference between both is printed "
                 "(default: lens model of the input)")
      ->check([](const std::string& name) {
        return vlp::lens_model_from_name(name) ? std::string()
                                               : "the models are: " + vlp::list_lens_model_names();
      });
  app.add_option("--camera-id", options.camera_id,
                 "Camera id in the output (default: that of the input)");
  return vlp::parse_and_run(app, argc, argv, [&] { vlp::run(app, options); });
}
