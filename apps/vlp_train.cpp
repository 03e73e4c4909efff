// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// vlp-train: labelled captures -> the lamp classifier; captures -> the row time.
#include <fmt/core.h>
#include <spdlog/spdlog.h>

#include <opencv2/core/utility.hpp>

#include "app.h"
#include "detect_folder.h"
#include "history.h"
#include "labelled_folders.h"
#include "readout_option.h"
#include "rig/input_error.h"
#include "train_report.h"

namespace vlp {
namespace {

struct Options {
  std::vector<std::string> folders;
  std::string lamps, calibration, labels, output;
  std::optional<Readout> readout;
  bool row_time = false;
  int threads = all_cores();
};

/// What the options name, read.
struct Inputs {
  LampMap lamps;
  std::optional<Calibration> calibration;
  std::vector<LabelledFolder> folders;
  DetectorCamera camera;
  std::vector<std::vector<ImageLights>> lights;
};

std::vector<std::filesystem::path> images_of(const std::vector<LabelledFolder>& folders) {
  std::vector<std::filesystem::path> images;
  for (const LabelledFolder& folder : folders) {
    images.insert(images.end(), folder.images.begin(), folder.images.end());
  }
  return images;
}

Inputs read_inputs(const Options& options) {
  check_output(options.output, {options.lamps, options.calibration});
  Inputs inputs;
  inputs.lamps = read_lamp_map(options.lamps);
  if (!options.calibration.empty()) inputs.calibration = read_calibration(options.calibration);
  inputs.folders = labelled_folders(options.folders, options.labels, !options.row_time);
  const auto images = images_of(inputs.folders);
  for (const auto& image : images) check_output(options.output, {image.string()});
  cv::setNumThreads(1);  // the images themselves go in parallel
  std::optional<std::array<int, 2>> imager_px;
  std::optional<Readout> readout;
  if (inputs.calibration) {
    inputs.camera = detector_camera(*inputs.calibration);
    imager_px = inputs.calibration->camera.imager_px;
    readout = inputs.calibration->camera.readout;
  }
  // What is looked for is not to depend on what is known of it.
  if (options.row_time) inputs.camera.row_time_s.reset();
  inputs.camera.readout = readout_for(options.readout, readout, images);
  const LampDetector detector(inputs.lamps, inputs.camera);
  inputs.lights = lights_of(detector, inputs.folders, imager_px, options.threads);
  return inputs;
}

void train(const Options& options) {
  const Inputs inputs = read_inputs(options);
  Labelled labelled;
  for (std::size_t i = 0; i < inputs.folders.size(); ++i) {
    add_labelled(inputs.lights[i], inputs.folders[i].labels, labelled);
  }
  if (labelled.labels == 0) {
    throw InputError(inputs.folders.front().folder,
                     "the table names none of the images that can be used: image names have to be "
                     "equal, with their endings");
  }
  check_examples(labelled.lights, inputs.lamps);
  LampClassifier classifier = trained(labelled.lights);
  classifier.row_time_s = inputs.camera.row_time_s;
  check_kept(classifier);
  write_lamp_classifier(options.output, classifier);
  print_labelled(labelled, classifier);
  print_confusion(cross_validated(labelled.lights));
  warn_of_inseparable(classifier);
}

void find_row_time(const CLI::App& app, const Options& options) {
  if (!options.output.empty() && options.calibration.empty()) {
    throw std::invalid_argument("-o with --row-time: needs --calibration, which it completes");
  }
  Inputs inputs = read_inputs(options);
  check_frequencies(inputs.lamps, options.lamps);
  std::vector<MeasuredPeriod> periods;
  for (std::size_t i = 0; i < inputs.folders.size(); ++i) {
    const auto more = measured_periods(inputs.lights[i], inputs.folders[i].labels);
    periods.insert(periods.end(), more.begin(), more.end());
  }
  const RowTimeResult result = estimate_row_time(periods, inputs.lamps);
  if (!result.found) throw Undetermined(result.problem);
  if (!options.output.empty()) {
    Camera& camera = inputs.calibration->camera;
    camera.row_time_s = result.found->row_time_s;
    camera.readout = inputs.camera.readout;
    std::vector<std::string> files = options.folders;
    files.push_back(options.lamps);
    auto& history = inputs.calibration->history;
    HistoryEntry entry = history_entry(app, files);
    entry.part = "camera";
    std::erase_if(history, [](const HistoryEntry& other) {
      return other.part == "camera" && other.program == "vlp-train";
    });
    history.push_back(std::move(entry));
    write_calibration(options.output, *inputs.calibration);
  }
  print_row_time(*result.found, inputs.camera.readout);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  CLI::App app(
      "Trains the lamp classifier on images whose lamps a table beside them names; or, with\n"
      "--row-time, finds the row time of the camera from images of lamps with known "
      "frequencies.\n\n"
      "Example, from the project's folder:\n"
      "  build/bin/vlp-train datasets/paper-rig/rendered/sample --row-time \\\n"
      "    --lamps datasets/paper-rig/rendered/lamps.yaml \\\n"
      "    --calibration datasets/paper-rig/rendered/true_calibration.yaml -o calibration.yaml\n",
      "vlp-train");
  vlp::Options options;
  app.add_option(
         "folders", options.folders,
         "Folders of images: PNG, JPEG, BMP, TIFF or PGM; the more places and distances they "
         "show, the better")
      ->required();
  app.add_option("--lamps", options.lamps, "Lamp map, lamps.yaml")->required();
  app.add_option("--calibration", options.calibration,
                 "Calibration: its lens and read-out, when they are known");
  auto* row_time =
      app.add_flag("--row-time", options.row_time,
                   "Find the row time; labels are not needed, the map's frequencies are");
  auto* output =
      app.add_option("-o,--output", options.output,
                     "Where to write the classifier; with --row-time the calibration with its row "
                     "time (default there: only print it)");
  app.add_option("--labels", options.labels,
                 "Table in each folder: image, lamp, u_px, v_px (default: detections.csv or "
                 "true_detections.csv; with --row-time none)")
      ->option_text("NAME");
  vlp::add_readout_option(app, options.readout);
  app.add_option("--threads", options.threads, "Images at a time (default: one a core)")
      ->check(CLI::Range(1, 1024));
  return vlp::run_app(app, argc, argv, [&] {
    if (row_time->count() == 0 && output->count() == 0) throw CLI::RequiredError("--output");
    if (options.row_time) {
      vlp::find_row_time(app, options);
    } else {
      vlp::train(options);
    }
  });
}
