// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/labeled_lights.h"

#include <array>
#include <unordered_map>

#include "lamps/light_detector.h"

namespace vlp {
namespace {

std::unordered_map<std::string, const Frame*> index_frames(const std::vector<Frame>& labels) {
  std::unordered_map<std::string, const Frame*> frames;
  for (const Frame& frame : labels) frames[frame.image] = &frame;
  return frames;
}

bool may_be_lamp(const Light& light, const std::array<int, 2>& size_px) {
  return is_light_modulated(light) && is_light_fully_in_view(light, {size_px[0], size_px[1]});
}

}  // namespace

const Light* find_light(const Observation& image, const Eigen::Vector2d& pixel) {
  constexpr double max_distance_fraction = 0.5;
  const Light* nearest = nullptr;
  for (const Light& light : image.lights) {
    if (!may_be_lamp(light, image.size_px)) continue;
    const double distance = (light.pixel - pixel).norm();
    if (distance > max_distance_fraction * light.radius_px) continue;
    if (nearest == nullptr || distance < (nearest->pixel - pixel).norm()) nearest = &light;
  }
  return nearest;
}

void add_labeled_lights(std::span<const Observation> images, const std::vector<Frame>& labels,
                        LabeledLights& labeled) {
  const auto frames = index_frames(labels);
  std::size_t number = labeled.lights.empty() ? 0 : labeled.lights.back().image + 1;
  for (const Observation& image : images) {
    const auto frame = frames.find(image.image_file_name());
    if (frame == frames.end() || !image.is_image_kept()) continue;
    for (const Detection& label : frame->second->detections) {
      ++labeled.num_labels;
      if (const Light* light = find_light(image, label.pixel)) {
        labeled.lights.push_back({label.lamp, light->stripes, number});
      } else {
        ++labeled.num_labels_without_light;
      }
    }
    ++number;
  }
}

std::vector<LightPeriod> collect_periods(std::span<const Observation> images,
                                         const std::vector<Frame>& labels) {
  const auto frames = index_frames(labels);
  std::vector<LightPeriod> periods;
  const auto add = [&](std::size_t image, const Light& light, std::optional<int> lamp) {
    const Stripes& stripes = light.stripes;
    if (!are_stripes_reliable(stripes)) return;
    periods.push_back(
        {{stripes.period_lines, lamp, stripes.duty}, image, light.pixel, light.sigma_px});
  };
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Observation& image = images[i];
    // Copies and images of other cameras are no evidence; other rejected images may still be.
    if (image.rejection && (image.rejection->reason == RejectionReason::same_image ||
                            image.rejection->reason == RejectionReason::used_elsewhere)) {
      continue;
    }
    if (labels.empty()) {
      for (const Light& light : image.lights) {
        if (is_light_modulated(light)) add(i, light, std::nullopt);
      }
      continue;
    }
    const auto frame = frames.find(image.image_file_name());
    if (frame == frames.end()) continue;
    for (const Detection& label : frame->second->detections) {
      if (const Light* light = find_light(image, label.pixel)) add(i, *light, label.lamp);
    }
  }
  return periods;
}

}  // namespace vlp
