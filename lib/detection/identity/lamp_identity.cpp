// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "detection/identity/coherence.h"
#include "detection/identity/lamp_rule.h"
#include "detection/lamp_detector.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

/// Why a light does not flicker; nothing when it does.
std::optional<LightReason> why_steady(const Light& light) {
  constexpr double least_clarity = 0.5, mostly = 0.5;
  const Stripes& stripes = light.stripes;
  if (!(stripes.contrast >= kLeastContrast)) {
    return light.clipped > mostly ? LightReason::clipped : LightReason::even;
  }
  if (!(stripes.periods >= kLeastPeriods)) return LightReason::few_stripes;
  if (!(stripes.clarity >= least_clarity)) return LightReason::unclear;
  if (!(light.coherence >= kLeastCoherence)) return LightReason::incoherent;
  return std::nullopt;
}

/// What a lean of 5 degrees that nobody knows of changes the logarithm of a rectangle's ratio of
/// sides by, 35 degrees from the axis.
constexpr double kLeanedOff = 0.06;

/// Of a rectangle whose sides have not quite the lamp's ratio something may hide one end: what is
/// left of it has its centre half as far off. That is in its sigma.
void add_hidden_end(double off, double leaned_off, Light& light) {
  constexpr double clear = 3;
  if (!(off > leaned_off + clear * light.aspect_sd)) return;
  const double length_px =
      std::sqrt(std::numbers::pi * light.aspect) * light.radius_px;  // its area has that radius
  light.sigma_px = std::hypot(light.sigma_px, off * length_px / 2 / std::numbers::sqrt2);
}

void refuse(Light& light, LightReason reason) {
  light.lamp.reset();
  light.reason = reason;
}

}  // namespace

bool wholly_in_view(const Light& light, const cv::Size& size) {
  return light.low.minCoeff() > -0.5 && light.high.x() < size.width - 0.5 &&
         light.high.y() < size.height - 0.5;
}

std::optional<int> LampDetector::lamp_of(const Stripes& stripes) const {
  if (classifier_) return vlp::lamp_of(*classifier_, stripes);
  if (!camera_.row_time_s) return std::nullopt;
  return lamp_by_frequency(lamps_, *camera_.row_time_s, stripes);
}

std::optional<double> LampDetector::shape_off(const Light& light, int lamp) const {
  // A lens that nobody knows changes the ratio of the sides by more than a lean.
  const double most_off = shape_.has_lens() ? 2 * kLeanedOff : 0.3;
  const Lamp* mapped = find_lamp(lamps_.lamps, lamp);  // a classifier may know others
  const auto rectangle = mapped != nullptr ? mapped->rectangle : std::nullopt;
  if (rectangle.has_value() != is_rectangle(light)) return std::nullopt;
  if (!rectangle) return 0;
  const double aspect = rectangle->size_m.maxCoeff() / rectangle->size_m.minCoeff();
  const double off = std::abs(std::log(light.aspect / aspect));
  return off < most_off ? std::optional(off) : std::nullopt;
}

void LampDetector::identify(std::vector<Light>& lights, const cv::Size& size) const {
  constexpr double much_softer = 5, least_roundness = 0.45, most_outside = 0.25;
  double sharpest_px = std::numeric_limits<double>::infinity();
  for (Light& light : lights) {
    if (light.kind == LightKind::formless) continue;
    const auto steady = why_steady(light);
    light.kind = steady ? LightKind::steady : LightKind::unknown;
    light.reason = steady.value_or(LightReason::like_no_lamp);
    if (steady) continue;
    if (!light.uneven) sharpest_px = std::min(sharpest_px, light.rise_px);
    light.lamp = lamp_of(light.stripes);
    if (!readable(light.stripes)) light.reason = LightReason::irregular;
    if (!light.lamp) continue;
    const auto off = shape_off(light, *light.lamp);
    if (!off) {
      refuse(light, LightReason::other_shape);
    } else if (is_rectangle(light) && shape_.has_lens()) {
      add_hidden_end(*off, shape_.knows_level() ? 0 : kLeanedOff, light);
    }
  }
  for (Light& light : lights) {
    if (!light.lamp) continue;
    // A lamp's reflection flickers like the lamp. Where most of the edge is not the lamp's, a
    // circle through the rest is not to be trusted.
    const bool strays = light.outside > most_outside;
    if (!light.uneven && light.rise_px > much_softer * sharpest_px) {
      refuse(light, LightReason::soft);
    } else if (strays || light.roundness < least_roundness) {
      refuse(light, LightReason::not_round);
    }
  }
  // Of two lights with one identity the one with the surer centre has it.
  for (const Lamp& lamp : lamps_.lamps) {
    std::vector<Light*> claims;
    for (Light& light : lights) {
      if (light.lamp == lamp.id) claims.push_back(&light);
    }
    const auto best = std::min_element(claims.begin(), claims.end(),
                                       [](auto* a, auto* b) { return a->sigma_px < b->sigma_px; });
    for (Light* claim : claims) {
      if (claim != *best) refuse(*claim, LightReason::seen_better);
    }
  }
  const bool sure = std::any_of(lights.begin(), lights.end(), [](const Light& light) {
    return light.lamp && light.stripes.periods >= kEnoughPeriods;
  });
  for (Light& light : lights) {
    if (light.lamp && !sure) refuse(light, LightReason::alone);
    if (!light.lamp) continue;
    light.kind = wholly_in_view(light, size) ? LightKind::lamp : LightKind::cut;
    light.reason = LightReason::identified;
  }
}

}  // namespace vlp
