// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-convert: converts the file of a camera from the format of one tool to that of another.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "calibration/intrinsics/camera_exports.h"
#include "calibration/intrinsics/camera_imports.h"
#include "calibration/intrinsics/valid_region.h"
#include "captures/printable.h"
#include "program/app.h"
#include "program/steps/step_outcome.h"
#include "rig/calibration_builder.h"
#include "rig/file.h"

namespace vlp {
namespace {

struct Options {
  std::string input, output, to = "calibration", lens, camera_id;
};

std::string format_camera_file(const Options& options, const Camera& camera,
                               const ImageRegion& region) {
  if (options.to == "mrcal") return format_mrcal_cameramodel(camera, region);
  if (options.to == "opencv") return format_opencv_camera(camera);
  return options.to == "ros" ? format_ros_camera_info(camera) : format_kalibr_camchain(camera);
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
             100 * compute_region_fraction_of_image_area(region, camera.imager_px),
             kept ? "is kept" : "the format does not support");
}

void run(const CLI::App& app, const Options& options) {
  check_output_is_not_input(options.output, {options.input});
  const auto [read, region] = read_camera_of_any_format(options.input);
  FittedCamera fitted{read, 0, 1};
  const std::string was(lens_model_name(fitted.camera.lens_model));
  if (!options.lens.empty()) {
    fitted = convert_camera_to_lens_model(fitted.camera, *lens_model_from_name(options.lens));
  }
  Camera& camera = fitted.camera;
  if (!options.camera_id.empty()) camera.id = options.camera_id;
  if (options.to == "calibration") {
    write_calibration(
        options.output,
        make_camera_only_calibration(camera, make_region_report(region),
                                     make_history_entry_from_command_line(app, {options.input})));
  } else {
    write_file(options.output, format_camera_file(options, camera, region));
  }
  if (options.to == "calibration") {
    fmt::print("kept          the camera alone; vlp-rotation and vlp-dispersion add the rest\n");
  }
  fmt::print("camera        {}, {} x {} px\n", escape_text_for_single_line(camera.id),
             camera.imager_px[0], camera.imager_px[1]);
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
  CLI::App app(
      "Converts a camera file between the formats of this toolbox (calibration), mrcal "
      "(.cameramodel), OpenCV (FileStorage, also of cv::fisheye), ROS (camera_info) and Kalibr "
      "(camchain). The format of the input is detected from its content. Parameters stay unchanged "
      "if the output format supports the lens model. Otherwise, fit a supported model with "
      "--lens.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-convert datasets/paper-rig/rendered/true_calibration.yaml \\\n"
      "    --to ros -o ros.yaml\n",
      "vlp-convert");
  vlp::Options options;
  app.add_option("input", options.input, "Input file with a camera")->required();
  app.add_option("-o,--output", options.output, "Output file")->required();
  app.add_option("--to", options.to, "Output format (default: calibration)")
      ->check(CLI::IsMember({"calibration", "mrcal", "opencv", "ros", "kalibr"}))
      ->option_text("calibration|mrcal|opencv|ros|kalibr");
  app.add_option("--lens", options.lens,
                 "Lens model to fit to the input. The largest difference between both is printed "
                 "(default: lens model of the input)")
      ->check([](const std::string& name) {
        return vlp::lens_model_from_name(name) ? std::string()
                                               : "the models are: " + vlp::list_lens_model_names();
      });
  app.add_option("--camera-id", options.camera_id,
                 "Camera id in the output (default: that of the input)");
  return vlp::parse_arguments_and_run(app, argc, argv, [&] { vlp::run(app, options); });
}
