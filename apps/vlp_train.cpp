// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-train: trains the lamp classifier from labeled captures, or estimates the row time.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "captures/detections_table.h"
#include "frontend/image_file.h"
#include "program/app.h"
#include "program/progress.h"
#include "program/steps/capture_options.h"
#include "program/steps/print_training.h"
#include "program/steps/step_outcome.h"
#include "rig/input_error.h"
#include "session/row_time_step.h"
#include "session/train_step.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<std::string> folders;
  std::string lamps, calibration, labels, output;
  bool row_time = false;
  FrontendOptions frontend = make_intake_options();
};

/// Inputs read from the files of the options.
struct Inputs {
  LampMap lamps;
  std::optional<Calibration> calibration;
  /// Labels of each folder; empty without a table.
  std::vector<std::vector<Frame>> labels;
  DetectedLights lights;
};

/// Reads the labels in the folder of the images: the named table. If none is named and labels are
/// needed, reads the first existing one of detections.csv and true_detections.csv.
std::vector<Frame> read_labels(const fs::path& folder, const std::string& table, bool needed) {
  if (!table.empty()) return read_detections(folder / table);
  if (!needed) return {};
  for (const char* name : {"detections.csv", "true_detections.csv"}) {
    if (fs::exists(folder / name)) return read_detections(folder / name);
  }
  throw InputError(folder,
                   "detections.csv is missing; add this table of the lamps in the images: image, "
                   "lamp, u_px, v_px");
}

Inputs read_inputs(const Options& options) {
  check_output_is_no_input(options.output, {options.lamps, options.calibration});
  Inputs inputs;
  inputs.lamps = read_lamps_of_room(options.lamps, options.frontend.room);
  if (!options.calibration.empty()) inputs.calibration = read_calibration(options.calibration);
  for (const std::string& folder : options.folders) {
    for (const fs::path& image : list_images(folder))
      check_output_is_no_input(options.output, {image.string()});
    inputs.labels.push_back(read_labels(folder, options.labels, !options.row_time));
  }
  {
    Progress progress("images");
    inputs.lights = detect_in_folders(
        {options.folders.begin(), options.folders.end()}, inputs.lamps, inputs.calibration,
        !options.row_time, options.frontend,
        [&](std::size_t done, std::size_t total) { progress.update(done, total); });
  }
  StepResult remarks;
  add_intake_remarks(inputs.lights.observations, remarks);
  print_step_remarks(remarks);
  return inputs;
}

void train(const Options& options) {
  const Inputs inputs = read_inputs(options);
  const TrainStepResult result =
      run_train_step(inputs.lights, inputs.labels, inputs.lamps, options.folders.front());
  print_step_remarks(result);
  require_success(result);
  write_classifier(options.output, result.classifier);
  print_training(result);
}

void train_row_time(const CLI::App& app, const Options& options) {
  if (!options.output.empty() && options.calibration.empty()) {
    throw std::invalid_argument(
        "--output: with --row-time it needs a calibration to complete; add --calibration");
  }
  const Inputs inputs = read_inputs(options);
  std::vector<std::string> files = options.folders;
  files.push_back(options.lamps);
  const RowTimeStepResult result =
      run_row_time_step(inputs.lights, inputs.labels, inputs.lamps, options.lamps,
                        inputs.calibration, make_command_entry(app, files));
  print_step_remarks(result);
  require_success(result);
  if (!options.output.empty()) write_calibration(options.output, result.calibration);
  print_row_time(result.row_time, inputs.lights.camera.readout);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  const auto parser = vlp::make_app(
      "Trains a lamp classifier from images with a table of their lamps. With --row-time, "
      "estimates the row time of a camera from images of lamps with known frequencies.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-train datasets/paper-rig/rendered/sample --row-time \\\n"
      "    --lamps datasets/paper-rig/rendered/lamps.yaml \\\n"
      "    --calibration datasets/paper-rig/rendered/true_calibration.yaml \\\n"
      "    -o calibration.yaml\n",
      "vlp-train");
  CLI::App& app = *parser;
  vlp::Options options;
  app.add_option("folders", options.folders,
                 "Folders of images: PNG, JPEG, BMP, TIFF or PGM. More positions and distances "
                 "improve the result")
      ->required();
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  vlp::add_room_option(app, options.frontend.room);
  app.add_option(
      "--calibration", options.calibration,
      "Calibration of the camera, for lens, readout direction and, without --row-time, row time");
  auto* row_time =
      app.add_flag("--row-time", options.row_time,
                   "Estimate the row time. Needs frequencies in the lamp map, but no labels");
  auto* output =
      app.add_option("-o,--output", options.output,
                     "Output file of the classifier, YAML; with --row-time of the calibration with "
                     "its row time (default with --row-time: only print it)");
  app.add_option("--labels", options.labels,
                 "File name of the table of lamps in each folder: image, lamp, u_px, v_px "
                 "(default: detections.csv or true_detections.csv; with --row-time none)")
      ->option_text("NAME");
  vlp::add_readout(app, options.frontend.readout);
  vlp::add_threads_option(app, options.frontend.threads);
  return vlp::parse_and_run(app, argc, argv, [&] {
    if (row_time->count() == 0 && output->count() == 0) throw CLI::RequiredError("--output");
    if (options.row_time) {
      vlp::train_row_time(app, options);
    } else {
      vlp::train(options);
    }
  });
}
