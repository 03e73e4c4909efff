// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/light_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "geometry/frames.h"
#include "geometry/median.h"
#include "lamps/image/background.h"
#include "lamps/image/pixel_runs.h"
#include "lamps/image/scanlines.h"
#include "lamps/shape/inverse_height.h"
#include "lamps/shape/light_center_noise.h"
#include "lamps/shape/outline_fit.h"
#include "lamps/shape/rectangle.h"
#include "lamps/shape/rim.h"
#include "lamps/signal/frequency_identification.h"
#include "lamps/signal/modulated_lights.h"
#include "rig/detection.h"
#include "rig/find_lamp.h"

namespace vlp {

namespace {

/// Function that fits a light to a blob with the outline of find_blob_outline(), for lamps of one
/// shape with the sizes `sizes_m`. Returns std::nullopt if the blob has another shape. See
/// fit_rectangular_light().
using ShapeDetector = decltype(&fit_rectangular_light);

/// Detectors of all shapes but discs, see LightShape, in the order in which they are tried.
constexpr auto kShapeDetectors = std::to_array<std::pair<ShapeKind, ShapeDetector>>(
    {{ShapeKind::rectangle, &fit_rectangular_light}});

/// Returns the largest number of lines without light between two stripes of a lamp.
int compute_max_dark_rows(const LampMap& lamps, const std::optional<double>& row_time_s) {
  constexpr int unknown = 24, spare = 3;
  if (!row_time_s) return unknown;
  double max_rows = 0;
  for (const Lamp& lamp : lamps.lamps) {
    if (!lamp.frequency_hz) return unknown;
    max_rows =
        std::max(max_rows, (1 - lamp.duty.value_or(0.5)) / (*lamp.frequency_hz * *row_time_s));
  }
  return static_cast<int>(std::ceil(max_rows)) + spare;
}

/// Returns true if no pixel can be brighter: full scale of 8 bits, or of a converter of 10 to 16
/// bits.
bool is_full_scale_level(double level, int bits_per_pixel) {
  constexpr double nearly = 0.98;
  const int min_bits = bits_per_pixel == 16 ? 10 : 8;
  for (int bits = min_bits; bits <= bits_per_pixel; bits += 2) {
    const double full = std::exp2(bits) - 1;
    if (level <= full && level >= nearly * full) return true;
  }
  return false;
}

/// Returns Light::clipped_fraction of a steady light.
double clipped_fraction(const ImageView& lines, const Eigen::Vector2d& low,
                        const Eigen::Vector2d& high) {
  const Eigen::Vector2d middle = (low + high) / 2, size = (high - low) / 2;
  const ImageView pixels = lines.crop_to_box(
      {static_cast<int>(std::lround(middle.x() - size.x() / 2)),
       static_cast<int>(std::lround(middle.y() - size.y() / 2)),
       static_cast<int>(std::lround(size.x())), static_cast<int>(std::lround(size.y()))});
  if (pixels.empty()) return 0;
  int brightest = 0, count = 0;
  for (int row = 0; row < pixels.height; ++row) {
    for (int column = 0; column < pixels.width; ++column) {
      const int level = pixels.gray_level_at_pixel(column, row);
      if (level > brightest) count = 0;
      brightest = std::max(brightest, level);
      count += level == brightest ? 1 : 0;
    }
  }
  if (!is_full_scale_level(brightest, pixels.bits)) return 0;
  return double(count) / (double(pixels.width) * pixels.height);
}

/// Adds the error of an unknown lens to the sigma of the lights. Must be called last, because
/// keep_best_light_of_lamp() compares sigmas without this error.
void add_error_of_unknown_lens(const ImageSize& size, std::vector<Light>& lights) {
  for (Light& light : lights) {
    if (light.kind == LightKind::no_outline) continue;
    add_error_to_center_sigma(predict_center_sd_without_lens_px(light, size), light);
  }
}

/// Maximum width of a sharp edge, as a fraction of the radius.
constexpr double kMaxRise = 0.3;

bool is_outline_sharp(const Light& light) { return light.rise_px <= kMaxRise * light.radius_px; }

bool has_clear_outline(const Light& light) {
  return !light.is_glow && !light.is_doubtful && is_outline_sharp(light) &&
         light.inlier_fraction >= kMinInlierFraction;
}

/// Returns true if the center of one light is within the radius of the larger light.
bool are_at_same_position(const Light& a, const Light& b) {
  return (a.pixel - b.pixel).norm() < std::max(a.radius_px, b.radius_px);
}

/// Returns the reason why a light is steady; std::nullopt if it is modulated.
std::optional<LightReason> find_reason_for_steady_light(const Light& light) {
  constexpr double min_clarity = 0.5, min_clipped = 0.5;
  const Stripes& stripes = light.stripes;
  if (!(stripes.contrast >= kMinContrast)) {
    return light.clipped_fraction > min_clipped ? LightReason::overexposed
                                                : LightReason::unmodulated;
  }
  if (!(stripes.periods >= kMinPeriods)) return LightReason::too_few_periods;
  if (!(stripes.periodicity_r2 >= min_clarity)) return LightReason::no_clear_period;
  if (!(light.coherence >= kMinCoherence)) return LightReason::no_clear_period;
  return std::nullopt;
}

/// Standard deviation of the centroid of a light, in radii: its core may be anywhere in the lamp.
constexpr double kCentroidSd = 0.5;
/// The same for the center of a rim. It is larger than that of the fit, because one wrong
/// light must not outweigh the others.
constexpr double kRimCenterSd = 0.1;

/// Returns the runs within a box, as one blob.
Blob clip(std::span<const Blob> blobs, const PixelBox& box) {
  Blob result;
  for (const Blob& blob : blobs) {
    for (PixelRun run : blob.runs) {
      if (run.row < box.y || run.row >= box.end_row()) continue;
      run.begin = std::max(run.begin, box.x);
      run.end = std::min(run.end, box.end_column());
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
Blob find_lit_pixels_of_light(const PixelBox& box, std::span<const Blob> blobs,
                              const ImageSize& size) {
  constexpr int max_area_ratio = 4;
  for (const Blob& blob : blobs) {
    const PixelBox whole = blob.blob_bounding_box();
    const bool is_most = 2 * intersect_boxes(whole, box).area_px() > box.area_px();
    if (is_most && whole.area_px() < max_area_ratio * box.area_px()) return blob;
  }
  return clip(blobs, expand_and_clip_box(box, std::max(box.width, box.height) / 4, size));
}

Light make_light_without_outline(const ImageView& lines, const ModulatedLight& found,
                                 const LightShape& shape) {
  Light light{};
  light.pixel = shape.swap_image_and_scanline_axes(found.center);
  light.sigma_px = std::clamp(found.center_sd_px, kMinSigma_px, kMaxSigma_px);
  light.radius_px = found.radius_px;
  const PixelBox& box = found.box;
  light.box_min = shape.swap_image_and_scanline_axes({box.x - 0.5, box.y - 0.5});
  light.box_max = shape.swap_image_and_scanline_axes(
      {std::min(box.end_column(), lines.width) - 0.5, std::min(box.end_row(), lines.height) - 0.5});
  light.rise_px = found.radius_px / 2;
  light.inlier_fraction = 1;
  light.is_glow = true;
  return light;
}

/// Converts a light that was found by its modulation to a Light. Without a rim the light has no
/// outline, and its center is the centroid of the lit area. Kind, reason and lamp are not set.
///
/// @param lines  image whose rows are the scanlines
Light make_light_from_modulation(const ImageView& lines, const ModulatedLight& found,
                                 std::optional<Light> rim, const LightShape& shape) {
  Light light = make_light_without_outline(lines, found, shape);
  // The rim of another object, for example of a letter, does not enclose the light's center.
  if (rim && (rim->pixel - light.pixel).norm() < rim->radius_px) light = std::move(*rim);
  light.is_found_by_modulation = true;
  light.stripes = found.stripes;
  light.peak_level = found.peak_level;
  light.coherence = found.phase_coherence;
  return light;
}

/// Merges boxes that overlap, until none do.
std::vector<PixelBox> merge_overlapping_boxes(std::vector<PixelBox> boxes) {
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = 0; j < boxes.size(); ++j) {
      if (j == i || intersect_boxes(boxes[i], boxes[j]).area_px() == 0) continue;
      boxes[i] = enclosing_box(boxes[i], boxes[j]);
      boxes.erase(boxes.begin() + std::ptrdiff_t(j));
      if (j < i) --i;
      j = std::size_t(-1);  // the larger box may also overlap earlier boxes
    }
  }
  return boxes;
}

}  // namespace

std::vector<Detection> select_lamps(std::span<const Light> lights) {
  std::vector<Detection> lamps;
  for (const Light& light : lights) {
    if (light.kind == LightKind::lamp) lamps.push_back({*light.lamp, light.pixel, light.sigma_px});
  }
  return lamps;
}

DetectorCamera make_detector_camera(const Calibration& calibration) {
  const Camera& camera = calibration.camera;
  DetectorCamera result{camera.readout.value_or(Readout::rows), camera.row_time_s,
                        Lens(camera.lens_model, camera.intrinsics)};
  if (calibration.rotation_center) {
    result.level_from_camera =
        level_rotation_from_zenith(calibration.rotation_center->zenith_in_camera);
  }
  return result;
}

LightDetector::LightDetector(const LampMap& lamps, const DetectorCamera& camera,
                             std::optional<LampClassifier> classifier)
    : lamps_(lamps),
      camera_(camera),
      shape_(camera),
      classifier_(std::move(classifier)),
      max_dark_rows_(compute_max_dark_rows(lamps, camera.row_time_s)) {
  for (const Lamp& lamp : lamps_.lamps) {
    if (lamp.shape.size_m) sizes_m_[lamp.shape.kind].push_back(*lamp.shape.size_m);
  }
  if (!camera_.row_time_s || classifier_) return;
  for (const Lamp& lamp : lamps_.lamps) {
    if (!lamp.frequency_hz) continue;
    const double period = 1 / (*lamp.frequency_hz * *camera_.row_time_s);
    const auto is_same = [&](double other) {
      return std::abs(period / other - 1) < 2 * kLampDrift;
    };
    const auto other = std::find_if(lamp_periods_.begin(), lamp_periods_.end(), is_same);
    if (other == lamp_periods_.end()) {
      lamp_periods_.push_back(period);
      lamps_by_period_.push_back(lamp.id);
    } else {  // several lamps: their duties decide
      lamps_by_period_[std::size_t(other - lamp_periods_.begin())].reset();
    }
  }
}

LightDetector LightDetector::copy_detector_for_camera_tilt(
    const std::optional<Eigen::Matrix3d>& level_from_camera) const {
  DetectorCamera camera = camera_;
  if (level_from_camera) {
    camera.level_from_camera = *level_from_camera;
  } else {
    camera.lens.reset();
    camera.max_axis_ratio = 12;  // 85 degrees off its axis
  }
  return {lamps_, camera, classifier_};
}

LightDetector LightDetector::copy_detector_with_readout_direction(Readout readout) const {
  DetectorCamera camera = camera_;
  camera.readout = readout;
  return {lamps_, camera, classifier_};
}

std::vector<LightPart> LightDetector::find_light_parts(const ImageView& lines, const Blob& blob,
                                                       const Background& background) const {
  constexpr std::size_t max_lights = 4;
  const PixelBox box = blob.blob_bounding_box();
  std::vector<LightPart> parts;
  auto remaining = find_blob_outline(lines, blob, background);
  for (const auto& [kind, detect] : kShapeDetectors) {
    const auto sizes_m = sizes_m_.find(kind);
    if (sizes_m == sizes_m_.end()) continue;
    if (auto light = detect(lines, blob, remaining, background, shape_, sizes_m->second)) {
      light->shape = kind;
      return {{std::move(light), {}, box}};
    }
  }
  while (parts.size() < max_lights) {
    auto light = shape_.fit_light_to_outline(remaining, background);
    if (!light && !parts.empty()) break;
    auto outline = std::move(remaining);
    remaining = light ? shape_.find_outline_points_outside_light(*light, outline)
                      : std::vector<EdgePoint>();
    parts.push_back({std::move(light), std::move(outline), box});
    if (remaining.empty()) break;
  }
  for (LightPart& part : parts) {
    if (part.light)
      part.light->outside_ratio = double(remaining.size()) / double(part.light->outline.size());
  }
  constexpr double min_edge_roundness = 0.5;
  // Each of several touching lights has an edge; their brightness may differ.
  const auto sharp_parts = std::count_if(parts.begin(), parts.end(), [](const LightPart& part) {
    return part.light && is_outline_sharp(*part.light);
  });
  const std::optional<Light>& first = parts.front().light;
  const bool has_edge =
      sharp_parts > 1 || (sharp_parts == 1 && first && is_outline_sharp(*first) &&
                          first->inlier_fraction >= min_edge_roundness &&
                          !is_blob_unevenly_lit(lines, blob, first->outline, background));
  for (LightPart& part : parts) {
    if (part.light) part.light->is_doubtful = !has_edge;
  }
  return parts;
}

void LightDetector::add_lights_found_by_modulation(const ImageView& lines,
                                                   const std::vector<Blob>& blobs,
                                                   const Background& background,
                                                   std::vector<Light>& lights) const {
  const auto is_conclusive = [&](const Light& light) {
    if (!has_clear_outline(light)) return false;
    const auto steady = find_reason_for_steady_light(light);
    if (steady) return *steady == LightReason::unmodulated || *steady == LightReason::overexposed;
    return identify_lamp_by_stripes(light.stripes).has_value();
  };
  std::vector<PixelBox> boxes;
  for (const Blob& blob : blobs) {
    const PixelBox box = blob.blob_bounding_box();
    const Eigen::Vector2d middle(box.x + box.width / 2.0, box.y + box.height / 2.0);
    const bool is_known = std::any_of(lights.begin(), lights.end(), [&](const Light& light) {
      return is_conclusive(light) &&
             (shape_.swap_image_and_scanline_axes(light.pixel) - middle).norm() <
                 light.radius_px / 2 &&
             std::max(box.width, box.height) < 3 * light.radius_px;
    });
    if (is_known) continue;
    // Stripes with a long dark part are blobs of their own.
    const int margin_px = std::max(std::max(box.width, box.height) / 2, max_dark_rows_);
    boxes.push_back(expand_and_clip_box(box, margin_px, lines.size()));
  }
  const auto modulated_lights = find_modulated_lights(
      lines, merge_overlapping_boxes(std::move(boxes)), background, lamp_periods_);
  const auto find_identified_lamp = [&](const Light& light) {
    const auto id = is_conclusive(light) ? identify_lamp_by_stripes(light.stripes) : std::nullopt;
    return id ? find_lamp_by_id(lamps_.lamps, *id) : nullptr;
  };
  std::vector<LampInPlane> lamps;
  for (const Light& light : lights) {
    const auto lamp = make_lamp_in_plane(find_identified_lamp(light), light.pixel, kCentroidSd);
    if (lamp) lamps.push_back(*lamp);
  }
  RimFits fitted = fit_rims(lines, modulated_lights, blobs, background, lamps);
  std::vector<std::optional<Light>>& rims = fitted.rims;
  // The edge of a source in a reflector is a clear outline with another radius than its lamp.
  const auto has_other_radius = [&](const Light& light) {
    const auto radius = predict_radius(find_identified_lamp(light), fitted.inverse_height);
    return radius && !radius->agrees_with(light);
  };
  const auto num_others = std::count_if(lights.begin(), lights.end(), has_other_radius);
  const auto num_clear =
      std::count_if(rims.begin(), rims.end(), [](const auto& rim) { return rim.has_value(); });
  const bool are_sizes_correct = 2 * num_others <= std::ptrdiff_t(lamps.size()) + num_clear;
  for (Light& light : lights) {
    if (!are_sizes_correct || !has_other_radius(light)) continue;
    const auto radius = predict_radius(find_identified_lamp(light), fitted.inverse_height);
    const Eigen::Vector2d low = shape_.swap_image_and_scanline_axes(light.box_min),
                          high = shape_.swap_image_and_scanline_axes(light.box_max);
    const PixelBox box{static_cast<int>(low.x()), static_cast<int>(low.y()),
                       static_cast<int>(high.x() - low.x()), static_cast<int>(high.y() - low.y())};
    const Blob blob = find_lit_pixels_of_light(box, blobs, lines.size());
    std::optional<Light> rim;
    if (!blob.runs.empty()) {
      rim = fit_rim_of_light(lines, blob, light.stripes.period_lines, background, shape_, radius);
    }
    if (!rim) {
      add_error_to_center_sigma(light.radius_px, light);
      light.outline_equations.reset();  // their center is not that of the lamp
      continue;
    }
    rim->stripes = light.stripes;
    rim->peak_level = light.peak_level;
    rim->coherence = light.coherence;
    light = std::move(*rim);
  }
  for (std::size_t i = 0; i < modulated_lights.size(); ++i) {
    const ModulatedLight& found = modulated_lights[i];
    const auto is_at_found = [&](const Light& other) {
      return (other.pixel - shape_.swap_image_and_scanline_axes(found.center)).norm() <
             std::max(other.radius_px, found.radius_px);
    };
    if (!found.lamp && std::any_of(lights.begin(), lights.end(), is_at_found)) continue;
    Light light = make_light_from_modulation(lines, found, std::move(rims[i]), shape_);
    if (found.lamp) light.lamp = lamps_by_period_[*found.lamp];
    // Lamps with the same period differ in duty; without known periods a classifier decides.
    const bool has_choice = found.lamp ? !light.lamp : lamp_periods_.empty();
    if (has_choice) light.lamp = identify_lamp_by_stripes(light.stripes);
    const auto is_at_it = [&](const Light& other) { return are_at_same_position(other, light); };
    const auto is_better = [&](const Light& other) {
      return is_at_it(other) &&
             (!found.lamp || other.is_found_by_modulation || is_conclusive(other));
    };
    if (std::any_of(lights.begin(), lights.end(), is_better)) continue;
    std::erase_if(lights, is_at_it);
    lights.push_back(std::move(light));
  }
}

LightDetector::RimFits LightDetector::fit_rims(const ImageView& lines,
                                               const std::vector<ModulatedLight>& found,
                                               const std::vector<Blob>& blobs,
                                               const Background& background,
                                               const std::vector<LampInPlane>& lamps) const {
  constexpr int num_passes = 3;
  constexpr double start_blur_px = 1;
  std::vector<std::optional<Light>> rims(found.size());
  std::optional<InverseHeight> before;
  for (int pass = 0; pass < num_passes; ++pass) {
    const bool is_last = pass + 1 == num_passes;
    const auto inverse_height =
        is_last ? estimate_inverse_height_from_radii(find_radii(found, rims))
                : estimate_inverse_height(find_lamps_in_plane(found, rims, lamps));
    if (pass > 0 && (!inverse_height || !(inverse_height->log_sd < before->log_sd))) continue;
    before = inverse_height;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double period_lines = found[i].fit.period_lines;
      const auto radius = predict_radius(find_lamp_of_period(found[i]), inverse_height);
      if (!rims[i] || (radius && !radius->agrees_with(*rims[i]))) {
        const Blob blob = find_lit_pixels_of_light(found[i].box, blobs, lines.size());
        if (blob.runs.empty()) continue;
        rims[i] = fit_rim_of_light(lines, blob, period_lines, background, shape_, radius);
      } else if (is_last && radius) {
        const auto fit = fit_disc_outline(lines, rims[i]->plane_outline, start_blur_px,
                                          period_lines, background, shape_, radius);
        if (fit && set_fitted_outline(*fit, shape_, *rims[i]))
          rims[i]->inlier_fraction = fit->inlier_fraction;
      }
    }
    if (!inverse_height) break;  // without a lens, or with fewer than two lamps
  }
  return {std::move(rims), before};
}

std::vector<LampInPlane> LightDetector::find_lamps_in_plane(
    const std::vector<ModulatedLight>& found, const std::vector<std::optional<Light>>& rims,
    std::vector<LampInPlane> lamps) const {
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto lamp = make_lamp_in_plane(
        find_lamp_of_period(found[i]),
        rims[i] ? rims[i]->pixel : shape_.swap_image_and_scanline_axes(found[i].center),
        rims[i] ? kRimCenterSd : kCentroidSd);
    if (lamp) lamps.push_back(*lamp);
  }
  return lamps;
}

std::vector<LampRadius> LightDetector::find_radii(
    const std::vector<ModulatedLight>& found, const std::vector<std::optional<Light>>& rims) const {
  std::vector<LampRadius> radii;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Lamp* lamp = find_lamp_of_period(found[i]);
    if (!rims[i] || lamp == nullptr || !lamp->shape.size_m || lamp->shape.kind != ShapeKind::disc)
      continue;
    radii.push_back({rims[i]->plane_outline.radius(), lamp->shape.size_m->x() / 2,
                     compute_height_beyond_first_lamp_m(*lamp)});
  }
  return radii;
}

std::optional<KnownRadius> LightDetector::predict_radius(
    const Lamp* lamp, const std::optional<InverseHeight>& inverse_height) const {
  if (!inverse_height || !lamp || !lamp->shape.size_m || lamp->shape.kind != ShapeKind::disc)
    return std::nullopt;
  const double radius = inverse_height->compute_radius_in_plane(
      lamp->shape.size_m->x() / 2, compute_height_beyond_first_lamp_m(*lamp));
  if (!(radius > 0) || !std::isfinite(radius)) return std::nullopt;
  return KnownRadius{radius, inverse_height->log_sd};
}

std::optional<LampInPlane> LightDetector::make_lamp_in_plane(const Lamp* lamp,
                                                             const Eigen::Vector2d& pixel,
                                                             double center_sd) const {
  const auto position = shape_.level_plane_point_from_pixel(pixel);
  if (lamp == nullptr || !lamp->shape.size_m || !position || !shape_.has_known_lens())
    return std::nullopt;
  return LampInPlane{*position, lamp->position_m.head<2>(),
                     compute_height_beyond_first_lamp_m(*lamp),
                     center_sd * lamp->shape.size_m->maxCoeff() / 2};
}

const Lamp* LightDetector::find_lamp_of_period(const ModulatedLight& found) const {
  const auto id = found.lamp ? lamps_by_period_[*found.lamp] : std::nullopt;
  return id ? find_lamp_by_id(lamps_.lamps, *id) : nullptr;
}

double LightDetector::compute_height_beyond_first_lamp_m(const Lamp& lamp) const {
  const double rise_m = lamp.position_m.z() - lamps_.lamps.front().position_m.z();
  return lamps_.lamps_below_camera ? -rise_m : rise_m;
}

void LightDetector::measure_stripes_and_fit_outline(const ImageView& lines,
                                                    const Background& background,
                                                    Light& light) const {
  constexpr double max_start_blur_px = 3;
  const auto find_chords = [&] {
    const auto swap = [&](const auto& at) { return shape_.swap_image_and_scanline_axes(at); };
    return is_light_disc_shaped(light)
               ? find_chords_in_ellipse(swap(light.box_min), swap(light.box_max), lines.size())
               : find_chords_in_polygon(swap(light.inner_polygon), lines.size());
  };
  if (is_light_disc_shaped(light)) {
    const auto stripes =
        measure_stripes(compute_scanline_signal(lines, find_chords(), background.level));
    const auto fit = fit_disc_outline(lines, light.plane_outline,
                                      std::min(light.rise_px / kRisePerBlur, max_start_blur_px),
                                      stripes.period_lines, background, shape_);
    if (fit) set_fitted_outline(*fit, shape_, light);
  }
  const auto chords = find_chords();
  const auto signal = compute_scanline_signal(lines, chords, background.level);
  light.stripes = measure_stripes(signal);
  light.peak_level = signal.empty() ? 0 : *std::max_element(signal.begin(), signal.end());
  if (light.stripes.period_lines > 0) {
    light.coherence = compute_stripe_coherence_between_parts(lines, chords, background,
                                                             light.stripes.period_lines);
  }
  if (light.stripes.contrast < kMinContrast) {
    light.clipped_fraction =
        clipped_fraction(lines, shape_.swap_image_and_scanline_axes(light.box_min),
                         shape_.swap_image_and_scanline_axes(light.box_max));
  }
}

void LightDetector::correct_light_centers_for_motion(const ImageView& lines,
                                                     const Background& background,
                                                     std::vector<Light>& lights) const {
  constexpr int num_passes = 2;  // the fit of a circle to a strongly sheared outline is inaccurate
  constexpr double start_blur_px = 0.5, rim_log_radius_sd = 0.02;
  std::vector<std::optional<Oval>> ovals(lights.size());
  std::vector<Eigen::Vector2d> motions(lights.size(), Eigen::Vector2d::Zero());
  std::vector<bool> is_fitted(lights.size(), true);
  for (int pass = 0; pass < num_passes; ++pass) {
    std::vector<OutlineEquations> outlines;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      if (lights[i].outline_equations && is_fitted[i])
        outlines.push_back(*lights[i].outline_equations);
    }
    const auto shear = Shear::estimate_shear_from_outlines(outlines);
    if (!shear) break;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      Light& light = lights[i];
      if (!light.outline_equations || !is_fitted[i]) continue;
      Oval oval = shear->predict_oval_from_motion(*light.outline_equations);
      const Eigen::Vector2d motion = shear->motion_per_scanline(*light.outline_equations);
      std::optional<KnownRadius> radius;
      if (light.is_uneven) {
        radius = {light.plane_outline.radius(), rim_log_radius_sd};
      }
      const auto fit = fit_disc_outline(
          lines,
          {light.plane_outline.center, oval.unit_from_oval() * light.plane_outline.unit_from_plane},
          start_blur_px, light.stripes.period_lines, background, shape_, radius);
      is_fitted[i] = fit && set_fitted_outline(*fit, shape_, light);
      if (is_fitted[i]) oval.oval.setZero();
      motions[i] += motion;
      ovals[i] = oval;
    }
  }
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (ovals[i]) shape_.correct_light_for_motion(*ovals[i], motions[i], lights[i]);
  }
}

std::vector<Light> LightDetector::detect_lights(const ImageView& image) const {
  Background background = estimate_image_background(image);
  ScanlineImage scanlines = make_scanline_image(image, camera_.readout, background);
  if (!scanlines.lit.has_nonzero_tile()) {
    const auto behind_lights = estimate_background_behind_lights(image);
    if (!behind_lights) return {};
    background = *behind_lights;
    scanlines = make_scanline_image(image, camera_.readout, background);
  }
  const auto& [lines, lit, memory] = scanlines;
  const auto blobs = group_pixel_runs_into_blobs(find_pixel_runs(lines, background.threshold, lit),
                                                 max_dark_rows_);
  std::vector<LightPart> parts;
  parts.reserve(blobs.size());
  for (const Blob& blob : blobs) {
    for (LightPart& part : find_light_parts(lines, blob, background))
      parts.push_back(std::move(part));
  }
  std::vector<Light> lights = join_parts_of_one_light(parts, shape_, background);
  for (Light& light : lights) measure_stripes_and_fit_outline(lines, background, light);
  add_lights_found_by_modulation(lines, blobs, background, lights);
  correct_light_centers_for_motion(lines, background, lights);
  for (Light& light : make_lights_without_outline(std::move(parts), lights, shape_, lines.size())) {
    lights.push_back(std::move(light));
  }
  std::sort(lights.begin(), lights.end(), [](const Light& a, const Light& b) {
    return a.pixel.y() != b.pixel.y() ? a.pixel.y() < b.pixel.y() : a.pixel.x() < b.pixel.x();
  });
  identify_lamps_of_lights(lights, image.size());
  if (!shape_.has_known_lens()) add_error_of_unknown_lens(image.size(), lights);
  return lights;
}

namespace {

void reject(Light& light, LightReason reason) {
  light.lamp.reset();
  light.reason = reason;
}

/// Rejects lights whose period contradicts that of their lamp under the row time of the other
/// lights of the image. A wrong row time changes the ratio of measured and expected period of all
/// lights by the same factor, which is the median over the lights with clear stripes. At least
/// three such lights are required. Other periods may differ by kMaxUnclearDrift from those of their
/// lamps.
void reject_contradicting_periods(const LampMap& lamps, double row_time_s,
                                  std::vector<Light>& lights) {
  constexpr std::size_t min_lights = 3;
  const auto has_clear_period = [](const Light& light) {
    return !light.is_found_by_modulation && are_stripes_reliable(light.stripes);
  };
  std::vector<std::pair<Light*, double>> log_values;
  std::vector<double> clear_ones;
  for (Light& light : lights) {
    const Lamp* lamp = light.lamp ? find_lamp_by_id(lamps.lamps, *light.lamp) : nullptr;
    if (lamp == nullptr || !lamp->frequency_hz) continue;
    const double log_value =
        std::log(light.stripes.period_lines * row_time_s * *lamp->frequency_hz);
    log_values.emplace_back(&light, log_value);
    if (has_clear_period(light)) clear_ones.push_back(log_value);
  }
  if (clear_ones.size() < min_lights) return;
  const double estimate = (lower_median(clear_ones) + upper_median(clear_ones)) / 2;
  for (const auto& [light, log_value] : log_values) {
    const double max_off = kLampDrift + (has_clear_period(*light) ? kLampDrift : kMaxUnclearDrift);
    if (std::abs(log_value - estimate) > max_off) reject(*light, LightReason::unknown_period);
  }
}

/// Keeps one of the lights that are identified as the same lamp; the others are mirror images. A
/// light with an outline takes precedence over one without. Among lights with an outline the one
/// with the smallest sigma is kept, among lights without the largest one. Rejects all if two of
/// them have similar size and brightness. A mirror reflects less than all light, and lenses darken
/// the corners of an image.
void keep_best_light_of_lamp(int lamp, std::vector<Light>& lights) {
  constexpr double min_area_ratio = 2, min_peak_ratio = 2;
  std::vector<Light*> claims;
  for (Light& light : lights) {
    if (light.lamp == lamp) claims.push_back(&light);
  }
  if (claims.size() < 2) return;
  std::sort(claims.begin(), claims.end(), [](const Light* a, const Light* b) {
    if (a->is_glow != b->is_glow) return b->is_glow;
    return a->is_glow ? a->radius_px > b->radius_px : a->sigma_px < b->sigma_px;
  });
  const double ratio = std::pow(claims[0]->radius_px / claims[1]->radius_px, 2);
  const bool is_apart =
      (claims[0]->pixel - claims[1]->pixel).norm() > claims[0]->radius_px + claims[1]->radius_px;
  const bool are_alike = claims[0]->is_glow == claims[1]->is_glow;
  bool is_clear = !are_alike || ratio > min_area_ratio ||
                  (!claims[0]->is_glow && (!is_apart || 1 / ratio > min_area_ratio));
  if (!is_clear) {
    const auto alike_end = std::find_if(claims.begin(), claims.end(), [&](const Light* claim) {
      return claim->is_glow != claims[0]->is_glow;
    });
    std::sort(claims.begin(), alike_end,
              [](const Light* a, const Light* b) { return a->peak_level > b->peak_level; });
    // The level of scanlines and the amplitude of cells are not comparable.
    is_clear = claims[0]->is_found_by_modulation == claims[1]->is_found_by_modulation &&
               claims[0]->peak_level > min_peak_ratio * claims[1]->peak_level;
  }
  for (std::size_t i = is_clear ? 1 : 0; i < claims.size(); ++i) {
    reject(*claims[i], LightReason::reflection);
  }
}

}  // namespace

bool is_light_fully_in_view(const Light& light, const ImageSize& size) {
  return light.box_min.minCoeff() > -0.5 && light.box_max.x() < size.width - 0.5 &&
         light.box_max.y() < size.height - 0.5;
}

std::optional<int> LightDetector::identify_lamp_by_stripes(const Stripes& stripes) const {
  if (classifier_) return vlp::identify_lamp_by_classifier(*classifier_, stripes);
  if (!camera_.row_time_s) return std::nullopt;
  return identify_lamp_by_frequency(lamps_, *camera_.row_time_s, stripes);
}

std::optional<double> LightDetector::compute_log_aspect_ratio_difference(const Light& light,
                                                                         int lamp) const {
  // An unknown lens changes the aspect ratio by more than an unknown tilt.
  const double max_off = shape_.has_known_lens() ? 2 * kUnknownTiltSd : 0.3;
  const Lamp* mapped = find_lamp_by_id(lamps_.lamps, lamp);  // a classifier may have other lamps
  const LampShape shape = mapped != nullptr ? mapped->shape : LampShape();
  if (shape.kind != light.shape) return std::nullopt;
  const double aspect = shape.size_m ? shape.size_m->maxCoeff() / shape.size_m->minCoeff() : 1;
  const double off = std::abs(std::log(light.aspect / aspect));
  return off < max_off ? std::optional(off) : std::nullopt;
}

void LightDetector::identify_lamps_of_lights(std::vector<Light>& lights,
                                             const ImageSize& size) const {
  // A surface that blurs the image of a lamp reflects less than 5 % of its light in one direction.
  // A tone curve of gamma 2.2 displays this as a quarter of the level.
  constexpr double min_peak_ratio = 0.25;
  constexpr double max_rise_ratio = 3, min_rise_px = 1, max_outside = 0.25;
  double sharpest_px = std::numeric_limits<double>::infinity(), brightest = 0;
  for (Light& light : lights) {
    if (light.kind == LightKind::no_outline) continue;
    const auto steady = find_reason_for_steady_light(light);
    light.kind = steady ? LightKind::unmodulated : LightKind::unknown;
    light.reason = steady.value_or(LightReason::unknown_period);
    if (steady) {
      light.lamp.reset();
      continue;
    }
    if (!light.is_glow) sharpest_px = std::min(sharpest_px, light.rise_px);
    if (!light.is_found_by_modulation) light.lamp = identify_lamp_by_stripes(light.stripes);
    if (!are_stripes_readable(light.stripes)) light.reason = LightReason::no_clear_period;
    if (!light.lamp) continue;
    const auto off = compute_log_aspect_ratio_difference(light, *light.lamp);
    if (!off) {
      reject(light, LightReason::wrong_shape);
    } else if (shape_.has_known_lens()) {
      add_hidden_end_error_to_center_sigma(*off, shape_.is_camera_tilted() ? 0 : kUnknownTiltSd,
                                           light);
    }
    if (light.lamp && !light.is_glow) brightest = std::max(brightest, light.peak_level);
  }
  for (Light& light : lights) {
    if (!light.lamp) continue;
    // The reflection of a lamp is modulated like the lamp. If too many edge points are not on the
    // lamp's outline, a circle through the others is not reliable.
    const bool has_other_outline = light.outside_ratio > max_outside;
    const bool is_soft = light.is_glow
                             ? light.peak_level < min_peak_ratio * brightest
                             : light.rise_px > max_rise_ratio * std::max(sharpest_px, min_rise_px);
    if (is_soft) {
      reject(light, LightReason::reflection);
    } else if (has_other_outline || light.inlier_fraction < kMinInlierFraction) {
      reject(light, LightReason::wrong_shape);
    }
  }
  // A classifier does not use the frequencies of the map.
  if (camera_.row_time_s && !classifier_) {
    reject_contradicting_periods(lamps_, *camera_.row_time_s, lights);
  }
  for (const Lamp& lamp : lamps_.lamps) keep_best_light_of_lamp(lamp.id, lights);
  const bool sure = std::any_of(lights.begin(), lights.end(), [](const Light& light) {
    return light.lamp && light.stripes.periods >= kMinReliablePeriods;
  });
  for (Light& light : lights) {
    if (light.lamp && !sure) reject(light, LightReason::too_few_periods);
    if (!light.lamp) continue;
    light.kind = is_light_fully_in_view(light, size) ? LightKind::lamp : LightKind::truncated;
    light.reason = LightReason::identified;
  }
}

}  // namespace vlp
