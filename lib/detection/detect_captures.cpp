// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_captures.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <optional>
#include <utility>

#include "captures/in_parallel.h"
#include "detection/annotate.h"
#include "detection/image_file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

struct Outcome {
  std::vector<Detection> lamps;
  std::array<int, 4> lights{};
  std::optional<std::string> refused;
};

cv::Mat image_of_size(const std::filesystem::path& file, const std::array<int, 2>& imager_px) {
  cv::Mat image = read_image(file);
  if (image.cols != imager_px[0] || image.rows != imager_px[1]) {
    throw InputError(file, "is " + std::to_string(image.cols) + " x " + std::to_string(image.rows) +
                               ", the calibration's camera has " + std::to_string(imager_px[0]) +
                               " x " + std::to_string(imager_px[1]) + " px");
  }
  return image;
}

/// One bad image does not end a run, whatever is bad about it.
Outcome outcome_of(const LampDetector& detector, const std::filesystem::path& file,
                   const std::array<int, 2>& imager_px, const DetectRun& run) {
  cv::Mat image;
  std::vector<Light> lights;
  try {
    image = image_of_size(file, imager_px);
    lights = detector.detect(image);
  } catch (const InputError& error) {
    return {{}, {}, error.what()};
  } catch (const std::exception& error) {
    std::string reason = file.string() + ": cannot be used: " + error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
    return {{}, {}, reason};
  }
  if (run.annotate) {
    write_annotated(*run.annotate, file, annotated(image, lights, detector.readout()));
  }
  Outcome outcome;
  for (const Light& light : lights) {
    ++outcome.lights[static_cast<std::size_t>(light.kind)];
    if (light.kind != LightKind::lamp) continue;
    outcome.lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
  }
  return outcome;
}

}  // namespace

CaptureDetections detect_captures(const LampDetector& detector,
                                  const std::vector<std::filesystem::path>& images,
                                  const std::array<int, 2>& imager_px, const DetectRun& run,
                                  const std::function<void(std::size_t done)>& progress) {
  std::vector<Outcome> outcomes(images.size());
  std::mutex counting;
  std::size_t done = 0;
  in_parallel(images.size(), run.threads, [&](std::size_t i) {
    outcomes[i] = outcome_of(detector, images[i], imager_px, run);
    const std::lock_guard lock(counting);
    progress(++done);
  });

  CaptureDetections result;
  result.images = static_cast<int>(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    Outcome& outcome = outcomes[i];
    if (outcome.refused) {
      result.refused.push_back(std::move(*outcome.refused));
      continue;
    }
    for (std::size_t kind = 0; kind < outcome.lights.size(); ++kind) {
      result.lights[kind] += outcome.lights[kind];
    }
    result.frames.push_back({images[i].filename().string(), std::move(outcome.lamps)});
  }
  return result;
}

}  // namespace vlp
