// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/light_by_modulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "lamps/shape/rim.h"
#include "rig/detection.h"

namespace vlp {
namespace {

/// Maximum distance of the bright part's center from that of the whole area, as a fraction of the
/// area's radius, for a round glow. Applies to lights without a clear rim.
constexpr double kMaxEccentricity = 0.1;

/// Returns the runs within a box, as one blob.
Blob clip(std::span<const Blob> blobs, const PixelBox& box) {
  Blob result;
  for (const Blob& blob : blobs) {
    for (PixelRun run : blob.runs) {
      if (run.row < box.y || run.row >= box.bottom()) continue;
      run.begin = std::max(run.begin, box.x);
      run.end = std::min(run.end, box.right());
      if (run.begin < run.end) result.runs.push_back(run);
    }
  }
  std::sort(result.runs.begin(), result.runs.end(), [](const PixelRun& a, const PixelRun& b) {
    return a.row != b.row ? a.row < b.row : a.begin < b.begin;
  });
  return result;
}

/// Returns the lit pixels of a light: the blob of which the light is the largest part, or the runs
/// near its box.
Blob find_lit_pixels(const PixelBox& box, std::span<const Blob> blobs, const ImageSize& size) {
  constexpr int max_area_ratio = 4;
  for (const Blob& blob : blobs) {
    const PixelBox whole = blob.box();
    const bool is_most = 2 * intersection(whole, box).area() > box.area();
    if (is_most && whole.area() < max_area_ratio * box.area()) return blob;
  }
  return clip(blobs, grow(box, std::max(box.width, box.height) / 4, size));
}

Light make_light_without_outline(const ImageView& lines, const ModulatedLight& found,
                                 const LightShape& shape) {
  Light light{};
  light.pixel = shape.turned(found.center);
  light.sigma_px = std::clamp(found.center_sd_px, kMinSigma_px, kMaxSigma_px);
  light.radius_px = found.radius_px;
  const PixelBox& box = found.box;
  light.low = shape.turned({box.x - 0.5, box.y - 0.5});
  light.high = shape.turned(
      {std::min(box.right(), lines.width) - 0.5, std::min(box.bottom(), lines.height) - 0.5});
  light.rise_px = found.radius_px / 2;
  light.roundness = 1;
  light.is_glow = true;
  return light;
}

}  // namespace

Light make_light_from_modulation(const ImageView& lines, const ModulatedLight& found,
                                 std::span<const Blob> blobs, const Background& background,
                                 const LightShape& shape) {
  const Blob blob = find_lit_pixels(found.box, blobs, lines.size());
  std::optional<Rim> rim;
  if (!blob.runs.empty()) rim = fit_rim(lines, blob, background, shape);
  Light light = make_light_without_outline(lines, found, shape);
  if (rim && rim->light.roundness >= kMinRoundness) {
    // Without a clear rim either center may be correct.
    const double apart_px =
        rim->is_clear ? 0 : (rim->light.pixel - light.pixel).norm() / std::numbers::sqrt2;
    const bool is_round = found.asymmetry_px < kMaxEccentricity * found.radius_px;
    if (rim->is_clear || !is_round) light = std::move(rim->light);
    light.sigma_px = std::min(std::hypot(light.sigma_px, apart_px), kMaxSigma_px);
  }
  light.by_modulation = true;
  light.stripes = found.stripes;
  light.peak = found.peak;
  light.coherence = found.phase_coherence;
  return light;
}

}  // namespace vlp
