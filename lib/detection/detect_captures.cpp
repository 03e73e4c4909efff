// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_captures.h"

#include <utility>

#include "detection/annotate.h"
#include "detection/detect_image.h"
#include "detection/images_in_parallel.h"

namespace vlp {
namespace {

struct CaptureOutcome {
  std::vector<Detection> lamps;
  std::vector<Light> lights;
  std::string refused;
};

CaptureOutcome outcome_of(const LampDetector& detector, const std::filesystem::path& file,
                          const DetectRun& run) {
  ImageLights found = detect_image(detector, file, run.imager_px, run.max_mpx);
  CaptureOutcome outcome;
  outcome.refused = found.refused;
  if (!outcome.refused.empty()) return outcome;
  if (run.annotate) {
    write_annotated(*run.annotate, file, annotated(found.image, found.lights, detector.readout()));
  }
  for (Light& light : found.lights) {
    std::vector<EdgePoint>().swap(light.outline);
    if (light.kind != LightKind::lamp) continue;
    outcome.lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
  }
  outcome.lights = std::move(found.lights);
  return outcome;
}

}  // namespace

CaptureDetections detect_captures(const LampDetector& detector,
                                  const std::vector<std::filesystem::path>& images,
                                  const DetectRun& run,
                                  const std::function<void(std::size_t done)>& progress) {
  std::vector<CaptureOutcome> outcomes(images.size());
  images_in_parallel(
      images.size(), run.threads,
      [&](std::size_t i) { outcomes[i] = outcome_of(detector, images[i], run); }, progress);

  CaptureDetections result;
  result.images = static_cast<int>(images.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    CaptureOutcome& outcome = outcomes[i];
    if (!outcome.refused.empty()) {
      result.refused.push_back(std::move(outcome.refused));
      continue;
    }
    const std::string name = images[i].filename().string();
    result.frames.push_back({name, std::move(outcome.lamps)});
    result.lights.push_back({name, std::move(outcome.lights)});
  }
  return result;
}

}  // namespace vlp
