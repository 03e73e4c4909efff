// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/light_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "geometry/frames.h"
#include "lamps/image/background.h"
#include "lamps/image/levels.h"
#include "lamps/image/lines.h"
#include "lamps/image/runs.h"
#include "lamps/shape/glow.h"
#include "lamps/shape/glow_envelope.h"
#include "lamps/shape/rectangle.h"
#include "lamps/shape/rim.h"
#include "lamps/shape/unknown_lens.h"
#include "lamps/signal/coherence.h"
#include "lamps/signal/lamp_rule.h"
#include "rig/detection.h"
#include "rig/find_lamp.h"

namespace vlp {

namespace {

/// How many lines without light a lamp may show between two stripes.
int most_dark_rows_of(const LampMap& lamps, const std::optional<double>& row_time_s) {
  constexpr int unknown = 24, spare = 3;
  if (!row_time_s) return unknown;
  double most = 0;
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) return unknown;
    most = std::max(most, (1 - lamp.duty.value_or(0.5)) / (*lamp.frequency_hz * *row_time_s));
  }
  return static_cast<int>(std::ceil(most)) + spare;
}

/// Whether no pixel can be brighter: full scale of 8 bits, or of a converter of 10 to 16.
bool is_full_scale(double level, int bits_per_pixel) {
  constexpr double nearly = 0.98;
  const int least_bits = bits_per_pixel == 16 ? 10 : 8, most_bits = bits_per_pixel;
  for (int bits = least_bits; bits <= most_bits; bits += 2) {
    const double full = std::exp2(bits) - 1;
    if (level <= full && level >= nearly * full) return true;
  }
  return false;
}

/// Of a steady light, see Light::clipped.
double clipped_share(const ImageView& lines, const Eigen::Vector2d& low,
                     const Eigen::Vector2d& high) {
  const Eigen::Vector2d middle = (low + high) / 2, size = (high - low) / 2;
  const ImageView pixels = lines.part({static_cast<int>(std::lround(middle.x() - size.x() / 2)),
                                       static_cast<int>(std::lround(middle.y() - size.y() / 2)),
                                       static_cast<int>(std::lround(size.x())),
                                       static_cast<int>(std::lround(size.y()))});
  if (pixels.empty()) return 0;
  const int brightest = brightest_level(pixels);
  if (!is_full_scale(brightest, pixels.bits)) return 0;
  return double(count_pixels_at(pixels, brightest)) / (double(pixels.width) * pixels.height);
}

/// To what the outlines say. Which of two lights has the surer centre is not for it to say: it is
/// the smaller one's.
void add_unknown_lens(const ImageSize& size, std::vector<Light>& lights) {
  for (Light& light : lights) {
    if (light.kind == LightKind::formless) continue;
    const double sigma_px = std::hypot(light.sigma_px, unknown_lens_sd_px(light, size));
    light.sigma_px = std::min(sigma_px, kMaxSigma_px);
  }
}

/// How far two centres are apart, per axis.
double apart(const Light& a, const Light& b) {
  return (a.pixel - b.pixel).norm() / std::numbers::sqrt2;
}

}  // namespace

DetectorCamera detector_camera(const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  DetectorCamera result{camera.readout.value_or(Readout::rows), camera.row_time_s,
                        Lens(camera.lens_model, camera.intrinsics)};
  if (calibration.rotation_center) {
    result.level_from_camera = level_from_zenith(calibration.rotation_center->zenith_in_camera);
  }
  return result;
}

LightDetector::LightDetector(const LampMap& lamps, const DetectorCamera& camera,
                             std::optional<LampClassifier> classifier)
    : lamps_(lamps),
      camera_(camera),
      shape_(camera),
      classifier_(std::move(classifier)),
      most_dark_rows_(most_dark_rows_of(lamps, camera.row_time_s)),
      has_rectangles_(std::any_of(lamps.lamps.begin(), lamps.lamps.end(),
                                  [](const Lamp& lamp) { return lamp.rectangle.has_value(); })) {}

LightDetector LightDetector::leaning(
    const std::optional<Eigen::Matrix3d>& level_from_camera) const {
  DetectorCamera camera = camera_;
  if (level_from_camera) {
    camera.level_from_camera = *level_from_camera;
  } else {
    camera.lens.reset();
    camera.most_slender = 12;  // 85 degrees off its axis
  }
  return {lamps_, camera, classifier_};
}

std::vector<LightPart> LightDetector::parts_of(const ImageView& lines, const Blob& blob,
                                               const Background& background) const {
  constexpr double least_roundness = 0.5, softest_edge = 0.3;
  constexpr std::size_t most_lights = 4;
  const PixelBox box = blob.box();
  std::vector<LightPart> parts;
  auto rest = outline_of(lines, blob, background);
  if (has_rectangles_) {
    if (auto light = rectangle_of(lines, blob, rest, background, shape_)) {
      return {{std::move(light), {}, box}};
    }
  }
  while (parts.size() < most_lights) {
    auto light = shape_.light_of(rest, background);
    if (!light && !parts.empty()) break;
    auto outline = std::move(rest);
    rest = light ? shape_.outside(*light, outline) : std::vector<EdgePoint>();
    parts.push_back({std::move(light), std::move(outline), box});
    if (rest.empty()) break;
  }
  for (LightPart& part : parts) {
    if (part.light) part.light->outside = double(rest.size()) / double(part.light->outline.size());
  }
  const auto sharp = [](const LightPart& part) {
    return part.light && part.light->rise_px <= softest_edge * part.light->radius_px;
  };
  const std::optional<Light>& first = parts.front().light;
  const bool edge = sharp(parts.front()) && first->roundness >= least_roundness &&
                    !unevenly_lit(lines, blob, first->outline, background);
  if (edge) return parts;
  // Lights that touch have an edge each, and no rim around all.
  std::optional<Rim> rim;
  if (std::count_if(parts.begin(), parts.end(), sharp) < 2) {
    rim = rim_of(lines, blob, background, shape_);
  }
  if (!rim || !rim->clear) {
    if (auto glow = glow_of(lines, blob, background, shape_)) {
      // Either may be what it is; the other's centre is as far off.
      if (rim) glow->sigma_px = std::hypot(glow->sigma_px, apart(rim->light, *glow));
      return {{std::move(glow), {}, box}};
    }
  }
  if (rim) return {{std::move(rim->light), {}, box}};
  return parts;
}

void LightDetector::measure(const ImageView& lines, const Background& background,
                            Light& light) const {
  const Eigen::Vector2d low = shape_.turned(light.low), high = shape_.turned(light.high);
  const auto judge = [&](const std::vector<double>& signal) {
    const Eigen::Vector2d from = shape_.turned(light.low), to = shape_.turned(light.high);
    light.stripes = stripes_of(signal);
    if (light.stripes.period_lines > 0) {
      const auto chords = is_rectangle(light)
                              ? chords_within(shape_.turned(light.face), lines.size())
                              : chords_of(from, to, lines.size());
      light.coherence = coherence_of(lines, chords, background, light.stripes.period_lines);
    }
    if (light.stripes.contrast < kLeastContrast) light.clipped = clipped_share(lines, from, to);
  };
  if (is_rectangle(light)) {
    const auto chords = chords_within(shape_.turned(light.face), lines.size());
    return judge(line_signal(lines, chords, background.level));
  }
  if (light.glows || light.uneven) {
    // Its stripes reach further than its outline.
    const Eigen::Vector2d beyond(0, light.radius_px);
    const auto chords = chords_of(low - beyond, high + beyond, lines.size());
    const auto signal = line_signal(lines, chords, background.level);
    return judge(striped_part(without_glow(signal)));
  }
  const DiscImage disc{low, high, shape_.turned(light.pixel)};
  auto outline = refined(lines, light.outline, disc, background);
  auto better = shape_.light_of(std::move(outline.points), background, outline.mottled);
  if (better && 2 * better->outline.size() > light.outline.size()) {
    better->roundness = light.roundness;
    better->outside = light.outside;
    light = std::move(*better);
  }
  const auto chords = chords_of(shape_.turned(light.low), shape_.turned(light.high), lines.size());
  judge(line_signal(lines, chords, background.level));
}

void LightDetector::correct_shear(std::vector<Light>& lights) const {
  const auto has_sharp_circle = [](const Light& light) {
    return !light.sums.empty() && !light.glows && !light.uneven;
  };
  std::vector<OutlineSums> sums;
  for (const Light& light : lights) {
    if (has_sharp_circle(light)) sums.push_back(light.sums);
  }
  const auto shear = Shear::common(sums);
  if (!shear) return;
  for (Light& light : lights) {
    if (!has_sharp_circle(light)) continue;
    shape_.shift(shear->oval_of(light.sums), shear->motion_at(light.sums), light);
  }
}

std::vector<Light> LightDetector::detect(const ImageView& image) const {
  const Background background = background_of(image);
  const auto [lines, lit, memory] = lines_of(image, camera_.readout, background);
  const auto blobs = group_runs(find_runs(lines, background.threshold, lit), most_dark_rows_);
  std::vector<LightPart> parts;
  parts.reserve(blobs.size());
  for (const Blob& blob : blobs) {
    for (LightPart& part : parts_of(lines, blob, background)) parts.push_back(std::move(part));
  }
  std::vector<Light> lights = join(parts, shape_, background);
  for (Light& light : lights) measure(lines, background, light);
  correct_shear(lights);
  for (Light& light : formless_lights(std::move(parts), lights, shape_, lines.size())) {
    lights.push_back(std::move(light));
  }
  std::sort(lights.begin(), lights.end(), [](const Light& a, const Light& b) {
    return a.pixel.y() != b.pixel.y() ? a.pixel.y() < b.pixel.y() : a.pixel.x() < b.pixel.x();
  });
  identify(lights, image.size());
  if (!shape_.has_lens()) add_unknown_lens(image.size(), lights);
  return lights;
}

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

bool wholly_in_view(const Light& light, const ImageSize& size) {
  return light.low.minCoeff() > -0.5 && light.high.x() < size.width - 0.5 &&
         light.high.y() < size.height - 0.5;
}

std::optional<int> LightDetector::lamp_of(const Stripes& stripes) const {
  if (classifier_) return vlp::lamp_of(*classifier_, stripes);
  if (!camera_.row_time_s) return std::nullopt;
  return lamp_by_frequency(lamps_, *camera_.row_time_s, stripes);
}

std::optional<double> LightDetector::shape_off(const Light& light, int lamp) const {
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

void LightDetector::identify(std::vector<Light>& lights, const ImageSize& size) const {
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
