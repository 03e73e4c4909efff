// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "frontend/observation.h"
#include "lamps/shape/light.h"
#include "rig/calibration.h"

namespace vlp {

/// Returns the number of lights of this kind in all images.
int count_lights(std::span<const Observation> images, LightKind kind);

/// Number of lights, over all images, that have this kind and this reason.
struct CountedReason {
  LightKind kind;
  LightReason reason;
  int lights;
};

/// Counts the lights that are no lamps, per kind and reason. The most frequent reason comes first.
/// Lights without outline come last, because they are rarely lamps.
std::vector<CountedReason> count_rejected_lights(std::span<const Observation> images);

/// Returns the enumerator as a word, for example "steady" and "too_few_periods".
std::string_view light_kind_name(LightKind kind);
std::string_view light_reason_name(LightReason reason);

/// Describes a reason and its remedy in a clause, for example "it shows no clear period: ...".
std::string describe_light_reason(LightReason reason);

/// Describes a light in one line: its position, its kind with the reason, and its measurements.
std::string describe_light(const Light& light);

/// Writes `lights.csv` atomically, one row per light. Columns: image, kind, reason
/// (light_kind_name(), light_reason_name()), lamp, u_px, v_px, sigma_px, radius_px, outline (edge,
/// rim, rectangle or glow), edge_rise_px, inlier_fraction, contrast, period_lines, periods,
/// periodicity_r2, coherence, duty; see Light and Stripes. Cells are empty for a light without
/// lamp, stripes or outline.
/// @throws InputError if the file cannot be written
void write_lights_table(const std::filesystem::path& file, std::span<const Observation> images);

/// Renders the detected lights into a brightened color copy of an image, for visual inspection.
/// Draws outline points, center, kind and reason of each light. Lamps are green, truncated lights
/// yellow, unknown ones red, unmodulated ones blue, and lights without outline gray.
///
/// @param image  one channel of 8 or 16 bits
cv::Mat annotate_image(const cv::Mat& image, const std::vector<Light>& lights);

/// Writes an annotated image atomically as PNG into `folder`, named like the image with `.png`
/// appended.
/// @throws InputError if the file cannot be written
void write_annotated_image(const std::filesystem::path& folder,
                           const std::filesystem::path& image_file, const cv::Mat& annotated_image);

}  // namespace vlp
