// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lamps/shape/light.h"

namespace vlp {

/// All lights of an image, whatever they are.
struct LightsOfImage {
  std::string image;
  std::vector<Light> lights;
};

/// How many lights are of that kind.
int count_of(std::span<const LightsOfImage> images, LightKind kind);

/// Why lights are no lamps, and how many: most first, but those without form, which are seldom
/// lamps, last. What that means and what would help says explanation_of().
struct CountedReason {
  LightKind kind;
  LightReason reason;
  int lights;
};
std::vector<CountedReason> reasons_of(std::span<const LightsOfImage> images);

/// The enumerator as a word, for example "steady" and "too_few_periods".
std::string_view name_of(LightKind kind);
std::string_view name_of(LightReason reason);

/// What a reason means of a light and what would help, in a clause: "it shows no clear
/// period: ...".
std::string explanation_of(LightReason reason);

/// A line for a person: where the light is, what it is and why, and what was measured.
std::string line_of(const Light& light);

/// Writes `lights.csv`, whole or not at all, a row a light: image, kind, reason (name_of() both),
/// lamp, u_px, v_px, sigma_px, radius_px, outline (edge, rim, glow or rectangle), rise_px,
/// roundness, contrast, period_lines, periods, clarity, coherence, duty; see Light and Stripes.
/// What a light does not have is empty: a lamp, stripes, an outline. Throws InputError.
void write_lights(const std::filesystem::path& file, std::span<const LightsOfImage> images);

}  // namespace vlp
