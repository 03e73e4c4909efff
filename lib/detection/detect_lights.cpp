// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_lights.h"

#include <algorithm>
#include <exception>
#include <mutex>

#include "captures/in_parallel.h"
#include "detection/image_file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

ImageLights lights_of(const LampDetector& detector, const std::filesystem::path& file) {
  ImageLights result{file, {}, {}, {}};
  try {
    const cv::Mat image = read_image(file);
    result.size = image.size();
    result.lights = detector.detect(image);
  } catch (const InputError& error) {
    result.refused = error.what();
  } catch (const std::exception& error) {
    result.refused = file.string() + ": cannot be used: " + error.what();
    std::replace(result.refused.begin(), result.refused.end(), '\n', ' ');
  }
  for (Light& light : result.lights) light.outline = {};
  return result;
}

}  // namespace

std::vector<ImageLights> detect_lights(const LampDetector& detector,
                                       std::span<const std::filesystem::path> images, int threads,
                                       const std::function<void(std::size_t done)>& progress) {
  std::vector<ImageLights> found(images.size());
  std::mutex counting;
  std::size_t done = 0;
  in_parallel(images.size(), threads, [&](std::size_t i) {
    found[i] = lights_of(detector, images[i]);
    const std::lock_guard lock(counting);
    progress(++done);
  });
  return found;
}

}  // namespace vlp
