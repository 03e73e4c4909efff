// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/light_detector.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
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

/// Returns the fraction of the pixels in the middle of a box that have the level of its brightest
/// pixel; 0 if this level is not full scale.
double compute_clipped_fraction(const ImageView& lines, const Eigen::Vector2d& low,
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
/// keep_best_light() compares sigmas without this error.
void add_lens_error(const ImageSize& size, std::vector<MeasuredLight>& lights) {
  for (MeasuredLight& light : lights) {
    if (light.kind == LightKind::no_outline) continue;
    add_center_error(sd_without_lens_px(light, size), light);
  }
}

/// Maximum width of a sharp edge, as a fraction of the radius.
constexpr double kMaxRise = 0.3;

/// Returns true if the light is evenly lit and has a sharp outline, in which its stripes can be
/// measured.
bool has_clear_outline(const Light& light) {
  return has_even_outline(light) && light.rise_px <= kMaxRise * light.radius_px &&
         light.inlier_fraction >= kMinInlierFraction;
}

/// Returns true if the center of one light is within the radius of the larger light.
bool are_at_same_position(const Light& a, const Light& b) {
  return (a.pixel - b.pixel).norm() < std::max(a.radius_px, b.radius_px);
}

/// Returns the reason why a light is steady; std::nullopt if it is modulated.
std::optional<LightReason> find_steady_reason(const Stripes& stripes) {
  constexpr double min_clarity = 0.5;
  if (!(stripes.contrast >= kMinContrast)) return LightReason::unmodulated;
  if (!(stripes.periods >= kMinPeriods)) return LightReason::too_few_periods;
  if (!(stripes.periodicity_r2 >= min_clarity)) return LightReason::no_clear_period;
  if (!(stripes.coherence >= kMinCoherence)) return LightReason::no_clear_period;
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

int count_pixels(const Blob& blob) {
  int count = 0;
  for (const PixelRun& run : blob.runs) count += run.pixel_run_width_px();
  return count;
}

/// Returns the lit pixels of a light: the blob with most lit pixels in its box, or the runs near
/// its box if there are several blobs or if the blob is larger.
Blob collect_lit_pixels(const PixelBox& box, std::span<const Blob> blobs, const ImageSize& size) {
  constexpr double min_fraction = 0.8, max_area_ratio = 1.4;
  const Blob* best = nullptr;
  int most = 0, total = 0;
  for (const Blob& blob : blobs) {
    const int count = count_pixels(clip({&blob, 1}, box));
    total += count;
    if (count > most) best = &blob, most = count;
  }
  if (best != nullptr && most > min_fraction * total &&
      best->blob_bounding_box().area_px() < max_area_ratio * box.area_px())
    return *best;
  return clip(blobs, expand_and_clip_box(box, std::max(box.width, box.height) / 4, size));
}

MeasuredLight make_plain_light(const PixelBox& box, const LightShape& shape) {
  MeasuredLight light{};
  light.reason = LightReason::unknown_period;
  light.box = {shape.swap_axes({box.x - 0.5, box.y - 0.5}),
               shape.swap_axes({box.end_column() - 0.5, box.end_row() - 0.5})};
  light.pixel = light.box.center();
  light.radius_px = light.box.sizes().mean() / 2;
  light.inlier_fraction = 1;
  return light;
}

/// Converts a light that was found by its modulation. Without an outline its center is the centroid
/// of the lit area. Kind and lamp are not set.
MeasuredLight make_light_from_modulation(const ModulatedLight& found,
                                         std::optional<MeasuredLight> outline,
                                         const LightShape& shape) {
  MeasuredLight light = make_plain_light(found.box, shape);
  light.pixel = shape.swap_axes(found.center);
  light.sigma_px = std::clamp(found.center_sd_px, kMinSigma_px, kMaxSigma_px);
  light.radius_px = found.radius_px;
  light.rise_px = found.radius_px / 2;
  // The outline of another object, for example of a letter, does not enclose the light's center.
  const bool is_around =
      outline && (outline->outline_kind == LightOutline::rectangle
                      ? outline->box.contains(light.pixel)
                      : (outline->pixel - light.pixel).norm() < outline->radius_px);
  if (is_around) light = std::move(*outline);
  light.reason = LightReason::unknown_period;
  light.stripes = found.stripes;
  light.peak_level = found.peak_level;
  return light;
}

/// Returns the profile of a signal of consecutive scanlines; levels below the dark level are 0.
LineProfile make_profile(const std::vector<PixelRun>& chords, const std::vector<double>& signal) {
  LineProfile profile{chords.empty() ? 0.0 : chords.front().row, 1, signal};
  for (double& level : profile.levels) level = std::max(0.0, level);
  return profile;
}

/// Returns true if the image border cuts no part of a box.
bool is_box_inside_image(const PixelBox& box, const ImageSize& size) {
  return box.x > 0 && box.y > 0 && box.end_column() < size.width && box.end_row() < size.height;
}

/// Merges boxes that overlap, until none do.
std::vector<PixelBox> merge_boxes(std::vector<PixelBox> boxes) {
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
    if (lamp.shape.size_m && lamp.shape.kind == ShapeKind::rectangle)
      rectangle_sizes_m_.push_back(*lamp.shape.size_m);
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

LightDetector LightDetector::copy_for_tilt(
    const std::optional<Eigen::Matrix3d>& level_from_camera) const {
  DetectorCamera camera = camera_;
  if (level_from_camera) {
    camera.level_from_camera = *level_from_camera;
  } else {
    camera.lens.reset();
  }
  return {lamps_, camera, classifier_};
}

LightDetector LightDetector::copy_with_readout(Readout readout) const {
  DetectorCamera camera = camera_;
  camera.readout = readout;
  return {lamps_, camera, classifier_};
}

std::vector<PixelBox> LightDetector::list_search_boxes(const std::vector<Blob>& blobs,
                                                       const ImageSize& size) const {
  std::vector<PixelBox> boxes;
  for (const Blob& blob : blobs) {
    const PixelBox box = blob.blob_bounding_box();
    // Stripes with a long dark part are blobs of their own.
    const int margin_px = std::max(std::max(box.width, box.height) / 2, max_dark_rows_);
    boxes.push_back(expand_and_clip_box(box, margin_px, size));
  }
  return merge_boxes(std::move(boxes));
}

void LightDetector::add_striped_blobs(const ImageView& lines, const std::vector<Blob>& blobs,
                                      const Background& background,
                                      std::vector<ModulatedLight>& found) const {
  const std::span<const ModulatedLight> others(found.data(), found.size());
  std::vector<ModulatedLight> added;
  for (const Blob& blob : blobs) {
    ModulatedLight light{};
    light.box = blob.blob_bounding_box();
    light.center = {light.box.x + light.box.width / 2.0, light.box.y + light.box.height / 2.0};
    light.radius_px = light.center_sd_px = (light.box.width + light.box.height) / 4.0;
    const bool is_found = std::ranges::any_of(others, [&](const ModulatedLight& other) {
      return (other.center - light.center).norm() < std::max(other.radius_px, light.radius_px);
    });
    if (is_found) continue;
    light.stripes = measure_stripes_in_box(lines, light.box, background);
    if (!(light.stripes.period_lines > 0) || light.stripes.contrast < kMinContrast) continue;
    light.fit.period_lines = light.stripes.period_lines;
    light.requires_outline = true;
    added.push_back(std::move(light));
  }
  std::ranges::move(added, std::back_inserter(found));
}

std::optional<MeasuredLight> LightDetector::fit_outline(
    const ImageView& lines, const ModulatedLight& found, const std::vector<Blob>& blobs,
    const Background& background, const std::optional<InverseHeight>& inverse_height) const {
  const Blob blob = collect_lit_pixels(found.box, blobs, lines.size());
  if (blob.runs.empty()) return std::nullopt;
  const Lamp* lamp = find_lamp(found);
  if (!rectangle_sizes_m_.empty() && (!lamp || lamp->shape.kind == ShapeKind::rectangle)) {
    auto light =
        fit_rectangular_light(lines, blob, trace_blob_outline(lines, blob, background),
                              found.fit.period_lines, background, shape_, rectangle_sizes_m_);
    if (light) return light;
  }
  return fit_rim_of_light(lines, blob, found.fit.period_lines, background, shape_,
                          predict_radius(lamp, inverse_height));
}

std::vector<MeasuredLight> LightDetector::measure_lights(const ImageView& lines,
                                                         const std::vector<ModulatedLight>& found,
                                                         OutlineFits fits,
                                                         const Background& background) const {
  std::vector<MeasuredLight> lights;
  for (std::size_t i = 0; i < found.size(); ++i) {
    MeasuredLight light = make_light_from_modulation(found[i], std::move(fits.outlines[i]), shape_);
    const auto is_taken = [&] {
      return std::ranges::any_of(
          lights, [&](const Light& other) { return are_at_same_position(other, light); });
    };
    // Lights that touch may have found the same outline.
    if (is_taken()) light = make_light_from_modulation(found[i], {}, shape_);
    if (is_taken() || (found[i].requires_outline && !has_outline(light))) continue;
    if (found[i].lamp) light.lamp = lamps_by_period_[*found[i].lamp];
    measure_in_outline(lines, background, light);
    // Lamps with the same period differ in duty; without known periods a classifier decides.
    if (!light.lamp) light.lamp = identify_by_stripes(light.stripes);
    lights.push_back(std::move(light));
  }
  return lights;
}

void LightDetector::add_remaining_blobs(const ImageView& lines, const std::vector<Blob>& blobs,
                                        const Background& background,
                                        std::vector<MeasuredLight>& lights) const {
  constexpr int min_px = 5, min_outline_px = 12;
  constexpr double min_clipped = 0.5;
  std::vector<MeasuredLight> added;
  for (const Blob& blob : blobs) {
    const PixelBox box = blob.blob_bounding_box();
    if (std::min(box.width, box.height) < min_px) continue;
    MeasuredLight light = make_plain_light(box, shape_);
    const bool is_found = std::ranges::any_of(lights, [&](const Light& other) {
      return other.box.contains(light.pixel) || are_at_same_position(other, light);
    });
    if (is_found) continue;
    light.sigma_px = std::min(light.radius_px, kMaxSigma_px);
    light.stripes = measure_stripes_in_box(lines, box, background);
    const auto steady_reason = find_steady_reason(light.stripes);
    light.kind = steady_reason ? LightKind::unmodulated : LightKind::unknown;
    light.reason = steady_reason.value_or(LightReason::wrong_shape);
    if (steady_reason == LightReason::unmodulated) {
      if (compute_clipped_fraction(lines, {box.x, box.y}, {box.end_column(), box.end_row()}) >
          min_clipped)
        light.reason = LightReason::overexposed;
    } else if (!steady_reason && (std::min(box.width, box.height) < min_outline_px ||
                                  !is_box_inside_image(box, lines.size()))) {
      light.kind = LightKind::no_outline;
      light.reason = LightReason::incomplete;
    } else if (!steady_reason) {
      const auto lamp = identify_by_stripes(light.stripes);
      const bool is_lamp_found = lamp && std::ranges::any_of(lights, [&](const Light& other) {
                                   return other.lamp == lamp;
                                 });
      if (is_lamp_found) light.reason = LightReason::reflection;
    }
    added.push_back(std::move(light));
  }
  std::ranges::move(added, std::back_inserter(lights));
}

LightDetector::OutlineFits LightDetector::fit_outlines(const ImageView& lines,
                                                       const std::vector<ModulatedLight>& found,
                                                       const std::vector<Blob>& blobs,
                                                       const Background& background) const {
  constexpr int num_passes = 3;
  constexpr double start_blur_px = 1;
  OutlineFits fits{std::vector<std::optional<MeasuredLight>>(found.size()), {}};
  for (int pass = 0; pass < num_passes; ++pass) {
    const bool is_last = pass + 1 == num_passes;
    const auto inverse_height = is_last ? fit_inverse_height(list_disc_radii(found, fits))
                                        : estimate_inverse_height(list_lamps_in_plane(found, fits));
    const bool is_better = inverse_height && (!fits.inverse_height ||
                                              inverse_height->log_sd < fits.inverse_height->log_sd);
    if (pass > 0 && !is_better) continue;
    fits.inverse_height = inverse_height;
    for (std::size_t i = 0; i < found.size(); ++i) {
      auto& outline = fits.outlines[i];
      const auto radius = predict_radius(find_lamp(found[i]), inverse_height);
      const bool is_disc = outline && outline->outline_kind != LightOutline::rectangle;
      if (!outline || (is_disc && radius && !radius->is_radius_of(*outline))) {
        outline = fit_outline(lines, found[i], blobs, background, inverse_height);
      } else if (is_last && is_disc && radius && radius->improves_fit(*outline)) {
        const auto fit = fit_disc_outline(lines, outline->plane_outline, start_blur_px,
                                          found[i].fit.period_lines, background, shape_, radius);
        if (fit) set_fitted_outline(*fit, shape_, *outline);
      }
    }
    if (!inverse_height) break;  // without a lens, or with fewer than two lamps
  }
  return fits;
}

std::vector<LampInPlane> LightDetector::list_lamps_in_plane(
    const std::vector<ModulatedLight>& found, const OutlineFits& fits) const {
  std::vector<LampInPlane> lamps;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Lamp* lamp = find_lamp(found[i]);
    const auto& outline = fits.outlines[i];
    const auto position =
        shape_.plane_from_pixel(outline ? outline->pixel : shape_.swap_axes(found[i].center));
    if (lamp == nullptr || !lamp->shape.size_m || !position || !shape_.has_known_lens()) continue;
    lamps.push_back({*position, lamp->position_m.head<2>(), compute_height_beyond_first_m(*lamp),
                     (outline ? kRimCenterSd : kCentroidSd) * lamp->shape.size_m->maxCoeff() / 2});
  }
  return lamps;
}

std::vector<LampRadius> LightDetector::list_disc_radii(const std::vector<ModulatedLight>& found,
                                                       const OutlineFits& fits) const {
  std::vector<LampRadius> radii;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Lamp* lamp = find_lamp(found[i]);
    const auto& outline = fits.outlines[i];
    if (!outline || outline->outline_kind == LightOutline::rectangle || lamp == nullptr ||
        !lamp->shape.size_m || lamp->shape.kind != ShapeKind::disc)
      continue;
    radii.push_back({outline->plane_outline.radius(), lamp->shape.size_m->x() / 2,
                     compute_height_beyond_first_m(*lamp)});
  }
  return radii;
}

std::optional<KnownRadius> LightDetector::predict_radius(
    const Lamp* lamp, const std::optional<InverseHeight>& inverse_height) const {
  constexpr double max_ratio = 1.15;
  if (!inverse_height || lamps_.lamps.empty()) return std::nullopt;
  double min_radius = std::numeric_limits<double>::infinity(), max_radius = 0;
  for (const Lamp& candidate : lamp ? std::span(lamp, 1) : std::span<const Lamp>(lamps_.lamps)) {
    if (!candidate.shape.size_m || candidate.shape.kind != ShapeKind::disc) return std::nullopt;
    const double radius = inverse_height->compute_radius_in_plane(
        candidate.shape.size_m->x() / 2, compute_height_beyond_first_m(candidate));
    if (!(radius > 0) || !std::isfinite(radius)) return std::nullopt;
    min_radius = std::min(min_radius, radius);
    max_radius = std::max(max_radius, radius);
  }
  if (max_radius > max_ratio * min_radius) return std::nullopt;
  return KnownRadius{std::sqrt(min_radius * max_radius),
                     inverse_height->log_sd + std::log(max_radius / min_radius) / 2};
}

const Lamp* LightDetector::find_lamp(const ModulatedLight& found) const {
  const auto id = found.lamp ? lamps_by_period_[*found.lamp] : std::nullopt;
  return id ? find_lamp_by_id(lamps_.lamps, *id) : nullptr;
}

double LightDetector::compute_height_beyond_first_m(const Lamp& lamp) const {
  const double rise_m = lamp.position_m.z() - lamps_.lamps.front().position_m.z();
  return lamps_.lamps_below_camera ? -rise_m : rise_m;
}

Stripes LightDetector::measure_stripes_in_box(const ImageView& lines, const PixelBox& box,
                                              const Background& background) const {
  const auto chords =
      list_chords_in_ellipse({box.x, box.y}, {box.end_column(), box.end_row()}, lines.size());
  Stripes stripes = measure_stripes(compute_scanline_signal(lines, chords, background.level));
  if (stripes.period_lines > 0) {
    stripes.coherence = measure_part_coherence(lines, chords, background, stripes.period_lines);
  }
  return stripes;
}

void LightDetector::measure_in_outline(const ImageView& lines, const Background& background,
                                       MeasuredLight& light) const {
  if (!has_outline(light)) return;
  const auto swap = [&](const auto& at) { return shape_.swap_axes(at); };
  const auto chords =
      light.outline_kind == LightOutline::rectangle
          ? list_chords_in_polygon(swap(light.inner_polygon), lines.size())
          : list_chords_in_ellipse(swap(light.box.min()), swap(light.box.max()), lines.size());
  const auto signal =
      compute_scanline_signal(lines, chords, background.level, light.has_bright_core);
  const LineProfile profile = make_profile(chords, signal);
  const auto period = identify_lamp_period(profile, lamp_periods_);
  Stripes stripes =
      period ? measure_stripes_of_period(profile, lamp_periods_[*period]) : measure_stripes(signal);
  if (!are_stripes_readable(stripes)) return;
  const auto lamp = period && lamps_by_period_[*period] ? lamps_by_period_[*period]
                                                        : identify_by_stripes(stripes);
  if (light.lamp && (!lamp || !(period || has_clear_outline(light)))) return;
  // An object may hide a part of the outline; the box of a slanted tube may contain other lights.
  stripes.coherence =
      std::max(light.stripes.coherence,
               measure_part_coherence(lines, chords, background, stripes.period_lines));
  light.lamp = lamp;
  light.stripes = stripes;
  light.peak_level = *std::max_element(signal.begin(), signal.end());
}

void LightDetector::correct_for_motion(const ImageView& lines, const Background& background,
                                       std::vector<MeasuredLight>& lights) const {
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
    const auto shear = Shear::estimate_shear(outlines);
    if (!shear) break;
    for (std::size_t i = 0; i < lights.size(); ++i) {
      MeasuredLight& light = lights[i];
      if (!light.outline_equations || !is_fitted[i]) continue;
      Oval oval = shear->predict_oval(*light.outline_equations);
      const Eigen::Vector2d motion = shear->motion_per_line(*light.outline_equations);
      std::optional<KnownRadius> radius;
      if (light.outline_kind == LightOutline::rim) {
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
    if (ovals[i]) shape_.correct_center_for_motion(*ovals[i], motions[i], lights[i]);
  }
}

std::vector<Light> LightDetector::detect_lights(const ImageView& image) const {
  Background background = estimate_background_of(image);
  ScanlineImage scanlines = make_scanlines(image, camera_.readout, background);
  if (!scanlines.lit.has_nonzero_tile()) {
    const auto behind_lights = estimate_dark_background(image);
    if (!behind_lights) return {};
    background = *behind_lights;
    scanlines = make_scanlines(image, camera_.readout, background);
  }
  const auto& [lines, lit, memory] = scanlines;
  const auto blobs =
      group_into_blobs(list_pixel_runs(lines, background.threshold, lit), max_dark_rows_);
  auto found = detect_modulated_lights(lines, list_search_boxes(blobs, lines.size()), background,
                                       lamp_periods_);
  add_striped_blobs(lines, blobs, background, found);
  OutlineFits fits = fit_outlines(lines, found, blobs, background);
  const auto inverse_height = fits.inverse_height;
  auto lights = measure_lights(lines, found, std::move(fits), background);
  correct_for_motion(lines, background, lights);
  identify_lamps(inverse_height, image.size(), lights);
  add_remaining_blobs(lines, blobs, background, lights);
  if (!shape_.has_known_lens()) add_lens_error(image.size(), lights);
  std::sort(lights.begin(), lights.end(), [](const Light& a, const Light& b) {
    return a.pixel.y() != b.pixel.y() ? a.pixel.y() < b.pixel.y() : a.pixel.x() < b.pixel.x();
  });
  return {lights.begin(), lights.end()};
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
void reject_periods(const LampMap& lamps, double row_time_s, std::vector<MeasuredLight>& lights) {
  constexpr std::size_t min_lights = 3;
  const auto has_clear_period = [](const Light& light) {
    return has_clear_outline(light) && are_stripes_reliable(light.stripes);
  };
  std::vector<std::pair<MeasuredLight*, double>> log_values;
  std::vector<double> clear_ones;
  for (MeasuredLight& light : lights) {
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

/// Keeps one of the lights that are identified as the same lamp; the others are mirror images.
/// Prefers lights with an outline, of these the one with the smallest sigma; without an outline the
/// largest light. Rejects all if two of them have similar size and brightness. A mirror reflects
/// less than all light, and lenses darken the corners of an image.
void keep_best_light(int lamp, std::vector<MeasuredLight>& lights) {
  constexpr double min_area_ratio = 2, min_peak_ratio = 2;
  std::vector<MeasuredLight*> claims;
  for (MeasuredLight& light : lights) {
    if (light.lamp == lamp) claims.push_back(&light);
  }
  if (claims.size() < 2) return;
  const auto outlines_end = std::partition(
      claims.begin(), claims.end(), [](const MeasuredLight* claim) { return has_outline(*claim); });
  std::sort(claims.begin(), outlines_end, [](const MeasuredLight* a, const MeasuredLight* b) {
    return a->sigma_px < b->sigma_px;
  });
  std::sort(outlines_end, claims.end(), [](const MeasuredLight* a, const MeasuredLight* b) {
    return a->radius_px > b->radius_px;
  });
  const auto alike_end = outlines_end == claims.begin() ? claims.end() : outlines_end;
  bool is_clear = claims.begin() + 1 == alike_end;
  if (!is_clear) {
    const double ratio = std::pow(claims[0]->radius_px / claims[1]->radius_px, 2);
    const bool is_apart =
        (claims[0]->pixel - claims[1]->pixel).norm() > claims[0]->radius_px + claims[1]->radius_px;
    is_clear = ratio > min_area_ratio ||
               (has_outline(*claims[0]) && (!is_apart || 1 / ratio > min_area_ratio));
  }
  if (!is_clear) {
    std::sort(claims.begin(), alike_end, [](const MeasuredLight* a, const MeasuredLight* b) {
      return a->peak_level > b->peak_level;
    });
    is_clear = claims[0]->peak_level > min_peak_ratio * claims[1]->peak_level;
  }
  for (std::size_t i = is_clear ? 1 : 0; i < claims.size(); ++i) {
    reject(*claims[i], LightReason::reflection);
  }
}

}  // namespace

bool is_light_fully_in_view(const Light& light, const ImageSize& size) {
  return light.box.min().minCoeff() > -0.5 && light.box.max().x() < size.width - 0.5 &&
         light.box.max().y() < size.height - 0.5;
}

std::optional<int> LightDetector::identify_by_stripes(const Stripes& stripes) const {
  if (classifier_) return vlp::identify_by_classifier(*classifier_, stripes);
  if (!camera_.row_time_s) return std::nullopt;
  return identify_by_frequency(lamps_, *camera_.row_time_s, stripes);
}

std::optional<double> LightDetector::compute_log_aspect_difference(const MeasuredLight& light,
                                                                   int lamp) const {
  // An unknown lens changes the aspect ratio by more than an unknown tilt.
  const double max_off = shape_.has_known_lens() ? 2 * kUnknownTiltSd : 0.3;
  const Lamp* mapped = find_lamp_by_id(lamps_.lamps, lamp);  // a classifier may have other lamps
  const LampShape shape = mapped != nullptr ? mapped->shape : LampShape();
  if ((shape.kind == ShapeKind::rectangle) != (light.outline_kind == LightOutline::rectangle))
    return std::nullopt;
  const double aspect = shape.size_m ? shape.size_m->maxCoeff() / shape.size_m->minCoeff() : 1;
  const double off = std::abs(std::log(light.aspect / aspect));
  return off < max_off ? std::optional(off) : std::nullopt;
}

void LightDetector::reject_lights_of_other_size(const std::optional<InverseHeight>& inverse_height,
                                                std::vector<MeasuredLight>& lights) const {
  constexpr double max_outline_off = 0.1, max_sds = 4, max_centroid_off = 0.35;
  constexpr int min_lamps = 3;
  struct Size {
    MeasuredLight* light;
    double log_ratio;
  };
  std::vector<Size> sizes;
  int num_agreeing = 0, num_even = 0;
  for (MeasuredLight& light : lights) {
    const Lamp* lamp = light.lamp ? find_lamp_by_id(lamps_.lamps, *light.lamp) : nullptr;
    if (!lamp) continue;
    const auto radius = predict_radius(lamp, inverse_height);
    const auto measured = measure_radius(light);
    if (!radius || !measured) continue;
    sizes.push_back({&light, std::log(*measured / radius->radius)});
    if (!has_outline(light) || std::abs(sizes.back().log_ratio) > max_outline_off) continue;
    ++num_agreeing;
    num_even += light.outline_kind == LightOutline::edge ? 1 : 0;
  }
  if (num_agreeing < min_lamps) return;
  const double max_off = std::max(max_outline_off, max_sds * inverse_height->log_sd);
  const bool are_even = 2 * num_even > num_agreeing;
  for (const auto& [light, log_ratio] : sizes) {
    const bool is_other = has_outline(*light) ? std::abs(log_ratio) > max_off
                          : are_even          ? std::abs(log_ratio) > max_centroid_off
                                              : log_ratio > max_centroid_off;
    if (is_other) {
      reject(*light, LightReason::reflection);
    } else if (!has_outline(*light) && are_even && light->stripes.periods < kMinReliablePeriods) {
      reject(*light, LightReason::too_few_periods);
    }
  }
}

void LightDetector::reject_misplaced_lights(const std::optional<InverseHeight>& inverse_height,
                                            std::vector<MeasuredLight>& lights) const {
  constexpr int min_lamps = 2;
  constexpr double max_off_fraction = 0.1;
  if (!inverse_height) return;
  using Complex = std::complex<double>;
  struct Place {
    MeasuredLight* light;
    double size_m;
    Complex at_m, in_map_m;  // horizontal position in the level frame, and in the map
  };
  std::vector<Place> reliable, others;
  Complex mean_m, mean_in_map_m;
  const double y_sign = lamps_.lamps_below_camera ? -1 : 1;  // a camera that looks down
  for (MeasuredLight& light : lights) {
    const Lamp* lamp = light.lamp ? find_lamp_by_id(lamps_.lamps, *light.lamp) : nullptr;
    const auto at = shape_.plane_from_pixel(light.pixel);
    if (!lamp || !at) continue;
    const double height_m =
        1 / inverse_height->compute_radius_in_plane(1, compute_height_beyond_first_m(*lamp));
    const double size_m = lamp->shape.size_m ? lamp->shape.size_m->maxCoeff() : 0;
    const Place place{&light, size_m, height_m * Complex(at->x(), at->y()),
                      Complex(lamp->position_m.x(), y_sign * lamp->position_m.y())};
    if (light.stripes.periods < kMinReliablePeriods) {
      others.push_back(place);
    } else {
      reliable.push_back(place);
      mean_m += place.at_m;
      mean_in_map_m += place.in_map_m;
    }
  }
  const auto count = std::ssize(reliable);
  if (count < min_lamps) return;
  mean_m /= double(count);
  mean_in_map_m /= double(count);
  Complex turn;
  for (const Place& place : reliable)
    turn += (place.at_m - mean_m) * std::conj(place.in_map_m - mean_in_map_m);
  if (!(std::abs(turn) > 0)) return;
  turn /= std::abs(turn);
  const auto is_misplaced = [&](const Place& place) {
    const Complex expected_m = turn * (place.in_map_m - mean_in_map_m);
    const double center_error_m = has_outline(*place.light) ? 0 : place.size_m / 2;
    return std::abs(place.at_m - mean_m - expected_m) >
           center_error_m + max_off_fraction * (place.size_m + std::abs(expected_m));
  };
  if (std::ranges::any_of(reliable, is_misplaced)) return;
  for (const Place& place : others) {
    if (is_misplaced(place)) reject(*place.light, LightReason::unknown_period);
  }
}

std::optional<double> LightDetector::measure_radius(const MeasuredLight& light) const {
  if (light.outline_kind == LightOutline::rectangle) return std::nullopt;
  if (has_outline(light)) return light.plane_outline.radius();
  const Eigen::Vector2d half(light.radius_px, 0);
  const auto before = shape_.plane_from_pixel(light.pixel - half),
             after = shape_.plane_from_pixel(light.pixel + half);
  if (!before || !after) return std::nullopt;
  return (*after - *before).norm() / 2;
}

void LightDetector::identify_lamps(const std::optional<InverseHeight>& inverse_height,
                                   const ImageSize& size,
                                   std::vector<MeasuredLight>& lights) const {
  // A surface that blurs the image of a lamp reflects less than 5 % of its light in one direction.
  // A tone curve of gamma 2.2 displays this as a quarter of the level.
  constexpr double min_peak_ratio = 0.25;
  constexpr double max_rise_ratio = 3, min_rise_px = 1;
  double sharpest_px = std::numeric_limits<double>::infinity(), brightest = 0;
  for (MeasuredLight& light : lights) {
    const auto steady = find_steady_reason(light.stripes);
    light.kind = steady ? LightKind::unmodulated : LightKind::unknown;
    if (steady) {
      reject(light, *steady);
      continue;
    }
    if (has_outline(light)) sharpest_px = std::min(sharpest_px, light.rise_px);
    if (!are_stripes_readable(light.stripes)) light.reason = LightReason::no_clear_period;
    if (!light.lamp) continue;
    const auto off = compute_log_aspect_difference(light, *light.lamp);
    if (!off) {
      reject(light, LightReason::wrong_shape);
    } else if (shape_.has_known_lens()) {
      add_hidden_end_error(*off, shape_.is_camera_tilted() ? 0 : kUnknownTiltSd, light);
    }
    if (light.lamp && has_outline(light)) brightest = std::max(brightest, light.peak_level);
  }
  for (MeasuredLight& light : lights) {
    if (!light.lamp) continue;
    // The reflection of a lamp is modulated like the lamp.
    const bool is_soft = has_outline(light)
                             ? light.rise_px > max_rise_ratio * std::max(sharpest_px, min_rise_px)
                             : light.peak_level < min_peak_ratio * brightest;
    if (is_soft) {
      reject(light, LightReason::reflection);
    } else if (light.inlier_fraction < kMinInlierFraction) {
      reject(light, LightReason::wrong_shape);
    }
  }
  reject_lights_of_other_size(inverse_height, lights);
  // A classifier does not use the frequencies of the map.
  if (camera_.row_time_s && !classifier_) {
    reject_periods(lamps_, *camera_.row_time_s, lights);
  }
  for (const Lamp& lamp : lamps_.lamps) keep_best_light(lamp.id, lights);
  reject_misplaced_lights(inverse_height, lights);
  const bool sure = std::ranges::any_of(lights, [](const Light& light) {
    return light.lamp && light.stripes.periods >= kMinReliablePeriods;
  });
  for (MeasuredLight& light : lights) {
    if (light.lamp && !sure) reject(light, LightReason::too_few_periods);
    if (!light.lamp) continue;
    light.kind = is_light_fully_in_view(light, size) ? LightKind::lamp : LightKind::truncated;
    light.reason = LightReason::identified;
  }
}

}  // namespace vlp
