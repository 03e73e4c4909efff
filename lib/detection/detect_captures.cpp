// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/detect_captures.h"

#include <mutex>
#include <utility>

#include "detection/annotate.h"
#include "detection/detect_image.h"

namespace vlp {
namespace {

struct CaptureOutcome {
  std::filesystem::path file;
  std::optional<double> time_s;
  std::vector<Detection> lamps;
  std::vector<Light> lights;
  std::string refused;
  bool is_other_readout;
};

CaptureOutcome outcome_of(const LightDetector& detector, const SourceImage& source,
                          const DetectRun& run) {
  const auto leaning = leaning_detector(detector, run.levels, source.file.filename().string());
  ImageLights found = detect_image(leaning ? *leaning : detector, source, run.imager_px,
                                   run.max_mpx, run.any_readout);
  CaptureOutcome outcome{};
  outcome.file = source.file;
  outcome.time_s = source.time_s;
  outcome.refused = found.refused;
  if (!outcome.refused.empty()) return outcome;
  outcome.is_other_readout = found.readout != detector.readout();
  if (run.annotate) {
    write_annotated(*run.annotate, source.file,
                    annotated(found.image, found.lights, found.readout));
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

std::optional<LightDetector> leaning_detector(const LightDetector& detector,
                                              const LevelsOfImages& levels,
                                              const std::string& image) {
  const auto level = levels.find(image);
  if (level == levels.end()) return std::nullopt;
  return detector.leaning(level->second);
}

CaptureDetections detect_captures(const LightDetector& detector, ImageSource& images,
                                  const DetectRun& run,
                                  const std::function<void(std::size_t done)>& progress) {
  std::vector<CaptureOutcome> outcomes;
  std::mutex counting;
  std::size_t done = 0;
  for_each_image(images, run.threads, [&](const SourceImage& image) {
    CaptureOutcome outcome = outcome_of(detector, image, run);
    const std::lock_guard lock(counting);
    if (outcomes.size() <= image.index) outcomes.resize(image.index + 1);
    outcomes[image.index] = std::move(outcome);
    progress(++done);
  });

  CaptureDetections result;
  for (CaptureOutcome& outcome : outcomes) {
    result.images.push_back(outcome.file);
    if (!outcome.refused.empty()) {
      result.refused.push_back(std::move(outcome.refused));
      continue;
    }
    if (outcome.is_other_readout) ++result.other_readouts;
    const std::string name = outcome.file.filename().string();
    if (outcome.time_s) result.times_s.emplace(name, *outcome.time_s);
    result.frames.push_back({name, std::move(outcome.lamps)});
    result.lights.push_back({name, std::move(outcome.lights)});
  }
  return result;
}

}  // namespace vlp
