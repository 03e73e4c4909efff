// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/lamp_intake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "frontend/image_file.h"
#include "frontend/image_quality.h"
#include "frontend/lights_table.h"
#include "frontend/mat_view.h"
#include "frontend/video.h"
#include "lamps/readout.h"
#include "lamps/signal/frequency_identification.h"
#include "lamps/signal/lamp_map_check.h"
#include "positioning/inclination_rotation.h"
#include "positioning/lamps_below.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Signal of an image below which nothing in it can be measured, in standard deviations of the
/// noise; noise alone has about 6.
constexpr double kMinSignalToNoise = 12;
/// Darkest level of an image, as a fraction of the full scale, above which it is overexposed.
constexpr double kMaxDarkFraction = 0.85;
/// Fraction of a light's box at full scale above which the light is overexposed: a disc fills pi/4
/// of its box, and a lamp is dark for half of the time.
constexpr double kMaxWhiteFraction = 0.65;
/// Number of lamps that a warning lists one by one.
constexpr std::size_t kMaxLines = 5;

bool is_overexposed(const Light& light, const cv::Mat& image) {
  const cv::Point low(static_cast<int>(light.box.min().x()), static_cast<int>(light.box.min().y()));
  const cv::Point high(static_cast<int>(light.box.max().x()),
                       static_cast<int>(light.box.max().y()));
  return light.kind == LightKind::unknown &&
         compute_saturated_fraction(image, {low, high}) > kMaxWhiteFraction;
}

/// Returns true if the range of the gray levels is small (image uniformly dark or white), so that
/// the signal may be noise. Takes a small part of the time of measure_image_signal().
bool is_image_uniform(const cv::Mat& image) {
  constexpr double max_range = 0.25;  // of the full scale
  double min = 0, max = 0;
  cv::minMaxLoc(image, &min, &max);
  return max - min < max_range * (image.depth() == CV_8U ? 255 : 65535);
}

/// Rejects an image in which nothing exceeds the noise, as too dark or overexposed.
void reject_no_signal(const cv::Mat& image, Observation& result) {
  const ImageSignal signal = measure_image_signal(image);
  if (signal.signal_to_noise < kMinSignalToNoise && signal.dark_fraction > kMaxDarkFraction) {
    return result.reject(
        RejectionReason::overexposed,
        fmt::format("overexposed: all of the image is at {:.0f} % of the full scale or more",
                    100 * signal.dark_fraction));
  }
  if (signal.signal_to_noise < kMinSignalToNoise) {
    return result.reject(
        RejectionReason::too_dark,
        fmt::format("too dark: the brightest is {:.0f} times the noise over the darkest, {:.0f} "
                    "wanted",
                    signal.signal_to_noise, kMinSignalToNoise));
  }
}

/// Rejects an image with too few lamps, with the exposure as the reason if it is one.
void reject_few_lamps(const cv::Mat& image, Observation& result) {
  reject_no_signal(image, result);
  if (!result.is_image_kept()) return;
  const auto count = [&](const auto& condition) {
    return std::count_if(result.lights.begin(), result.lights.end(), condition);
  };
  const auto is_kind = [](LightKind kind) {
    return [kind](const Light& light) { return light.kind == kind; };
  };
  const auto lamps = count(is_kind(LightKind::lamp));
  const auto unknown = count(is_kind(LightKind::unknown));
  const auto white = count([&](const Light& light) { return is_overexposed(light, image); });
  if (white > 0) {
    return result.reject(
        RejectionReason::overexposed,
        fmt::format(
            "overexposed: {} of {} lights are completely at full scale, {} of the visible lamps",
            white, unknown, lamps));
  }
  result.reject(
      RejectionReason::too_few_lamps,
      fmt::format("too few lamps: {} visible, {} cut off by the image border, {} lights unlike any",
                  lamps, count(is_kind(LightKind::truncated)), unknown));
}

LampClassifier read_classifier(const LampImages& images, const fs::path& file,
                               const std::optional<double>& row_time_s,
                               std::vector<std::string>& warnings) {
  LampClassifier classifier = read_lamp_classifier(file);
  for (const auto& lamp : classifier.lamps) {
    if (find_lamp_by_id(images.lamps.lamps, lamp.lamp) != nullptr) continue;
    // [FILE-6] `is not in`, `is unknown to` | files of different rooms or captures | give files of
    //   the same
    throw InputError(file,
                     fmt::format("lamp {} is not in {}", lamp.lamp, images.lamps_file.string()));
  }
  for (const Lamp& lamp : images.lamps.lamps) {
    const bool is_known = std::any_of(classifier.lamps.begin(), classifier.lamps.end(),
                                      [&](const auto& other) { return other.lamp == lamp.id; });
    if (is_known) continue;
    warnings.push_back(fmt::format("lamp {} is unknown to {}", lamp.id, file.string()));
  }
  constexpr double max_relative_difference = 0.005;
  if (classifier.row_time_s && row_time_s &&
      std::abs(*classifier.row_time_s / *row_time_s - 1) > max_relative_difference) {
    throw InputError(
        file, fmt::format("row_time_s is {:.4g}, that of {} is {:.4g}: train it for this camera",
                          *classifier.row_time_s,
                          images.calibration_file.empty() ? "--row-time-s"
                                                          : images.calibration_file.string(),
                          *row_time_s));
  }
  return classifier;
}

void warn_about_findings(std::size_t count, const char* items, std::vector<std::string>& warnings) {
  if (count > kMaxLines) {
    warnings.push_back(fmt::format("and {} more {}", count - kMaxLines, items));
  }
}

/// Warns of lamps in the map that are hard to distinguish, or whose stripes are hard to see.
void warn_about_map(const LampImages& images, const DetectorCamera& camera,
                    const std::optional<double>& exposure_s, std::vector<std::string>& warnings) {
  std::optional<double> focal_px;
  if (images.calibration) {
    focal_px = images.calibration->camera.intrinsics[camera.readout == Readout::rows ? 1 : 0];
  }
  const StripeConditions conditions{*camera.row_time_s, focal_px, 0, exposure_s};
  const auto alike = list_ambiguous_lamps(images.lamps, conditions);
  for (std::size_t i = 0; i < std::min(alike.size(), kMaxLines); ++i) {
    const auto& [first, second, gap, needed] = alike[i];
    warnings.push_back(fmt::format(
        "lamps {} and {} may remain unidentified from z = 0: their frequencies differ by {:.1f} %, "
        "{:.1f} % are needed; change one of the frequencies, or a duty by 0.3",
        first, second, 100 * gap, 100 * needed));
  }
  // [LAMP-11] `too near`, `too fine to be seen` | frequencies unsuitable for row time and exposure
  //   | see [frequencies](ROOM.md#lamps)
  warn_about_findings(alike.size(), "pairs of lamps with frequencies that are too near", warnings);
  const auto unreadable = list_unreadable_lamps(images.lamps, conditions);
  for (std::size_t i = 0; i < std::min(unreadable.size(), kMaxLines); ++i) {
    const auto& [lamp, period_lines, periods, contrast] = unreadable[i];
    if (period_lines < kMinPeriod_lines) {
      warnings.push_back(fmt::format(
          "lamp {} has stripes of {:.2g} lines, too fine to be seen: choose a lower frequency",
          lamp, period_lines));
    } else if (periods < kMinPeriods) {
      warnings.push_back(
          fmt::format("lamp {} shows only {:.1f} stripes from z = 0: choose a higher frequency or "
                      "a larger lamp, or move the camera nearer",
                      lamp, periods));
    } else {
      constexpr double microseconds = 1e6;
      warnings.push_back(fmt::format(
          "lamp {} has {:.0f} % of its stripes left after an exposure of {:.3g} us: expose shorter",
          lamp, 100 * contrast, microseconds * *exposure_s));
    }
  }
  warn_about_findings(unreadable.size(), "lamps with barely visible stripes", warnings);
}

/// Returns the pairs of lamps that have one frequency, for example "1 and 7, 2 and 8"; empty if
/// there are none.
std::string list_shared_frequencies(const LampMap& map) {
  std::vector<std::string> pairs;
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {
    for (std::size_t j = i + 1; j < map.lamps.size(); ++j) {
      const Lamp &a = map.lamps[i], &b = map.lamps[j];
      if (are_indistinguishable(a, b)) pairs.push_back(fmt::format("{} and {}", a.id, b.id));
    }
  }
  const std::size_t more = pairs.size() > kMaxLines ? pairs.size() - kMaxLines : 0;
  pairs.resize(pairs.size() - more);
  const std::string remaining = more > 0 ? fmt::format(" and {} more pairs", more) : "";
  return fmt::format("{}", fmt::join(pairs, ", ")) + remaining;
}

/// Explains that no lamp is identified, with the reason that most of the lights have.
std::string explain_no_lamp(const std::vector<Observation>& images, const LampMap& map) {
  const auto count = [&](LightKind kind) { return count_lights(images, kind); };
  const auto skipped = std::count_if(images.begin(), images.end(), [](const Observation& image) {
    return !image.is_image_kept();
  });
  // [LAMP-1] `no lamp was identified wholly in view` | wrong row time, readout or map; steady or
  //   cut lamps | see the most frequent reason below
  std::string message = fmt::format(
      "no lamp was identified wholly in view in {} images ({} skipped; {} lamps are cut by the "
      "image's edge, {} lights flicker unlike any lamp of the map, {} are steady, {} have no form)",
      images.size(), skipped, count(LightKind::truncated), count(LightKind::unknown),
      count(LightKind::unmodulated), count(LightKind::no_outline));
  const auto reasons = count_rejected_lights(images);
  if (reasons.empty()) {
    return message + ": are lamps lit and in view, and the exposure long enough?";
  }
  const auto& [kind, reason, lights] = reasons.front();
  message += fmt::format("; most often, {} times: {}", lights, describe_light_reason(reason));
  const std::string shared = list_shared_frequencies(map);
  if (reason == LightReason::unknown_period && !shared.empty()) {
    message += "; lamps of the map that share a frequency: " + shared +
               "; the key room of lamps and --room separate those of two rooms";
  }
  return message;
}

/// Describes a readout direction of options or calibration that the images contradict; otherwise
/// empty.
std::string explain_readout(const LampImages& images, const FrontendOptions& options) {
  std::optional<Readout> given = options.readout;
  std::optional<std::array<int, 2>> imager_px;
  if (images.calibration) {
    imager_px = images.calibration->camera.imager_px;
    if (!given) given = images.calibration->camera.readout;
  }
  if (!given) return "";
  const std::string source =
      options.readout ? "--readout" : images.calibration_file.filename().string();
  return describe_wrong_readout(list_lamp_images(images.images), *given, source, options,
                                imager_px);
}

/// Creates the folder for annotated images.
void create_folder(const fs::path& folder, const fs::path& images) {
  std::error_code error;
  fs::create_directories(folder, error);
  // [FILE-1]
  if (error) throw InputError(folder, "cannot be made: " + error.message());
  if (fs::equivalent(folder, images, error)) {
    throw InputError(folder, "contains the images: choose another folder for --annotate");
  }
}

/// Creates the detector of a set of images.
LightDetector make_detector(const LampImages& images, const FrontendOptions& options,
                            Observations& result) {
  DetectorCamera camera = images.calibration
                              ? make_detector_camera(*images.calibration)
                              : DetectorCamera{Readout::rows, options.row_time_s, {}};
  std::optional<LampClassifier> classifier;
  if (options.classifier.empty()) {
    check_frequencies(images.lamps, images.lamps_file);
    if (!camera.row_time_s) {
      throw InputError(
          images.calibration_file,
          "camera.row_time_s is missing, which is needed to identify lamps: give it with "
          "--row-time-s of vlp-intrinsics, or estimate it with vlp-train --row-time");
    }
  } else {
    classifier = read_classifier(images, options.classifier, camera.row_time_s, result.warnings);
  }
  std::optional<Readout> known_readout = options.readout;
  std::optional<std::array<int, 2>> imager_px;
  if (images.calibration) {
    imager_px = images.calibration->camera.imager_px;
    if (!known_readout) known_readout = images.calibration->camera.readout;
  }
  const std::size_t num_warnings = result.warnings.size();
  camera.readout =
      estimate_readout(list_lamp_images(images.images), known_readout, options, imager_px, result);
  // Without a calibration the readout direction is chosen per image.
  if (!images.calibration) result.warnings.resize(num_warnings);
  if (!classifier) warn_about_map(images, camera, options.exposure_s, result.warnings);
  return LightDetector(images.lamps, camera, std::move(classifier));
}

/// Returns the level rotations of a set of images, by its table of captures.
LevelRotations read_level_rotations(const LampImages& images) {
  if (!images.calibration) return {};
  CapturesTable captures = images.captures.value_or(CapturesTable());
  if (!images.captures && !is_video_file_name(images.images))
    captures = read_folder_captures(images.images);
  const bool below = images.lamps.lamps_below_camera;
  for (auto& [image, capture] : captures) {
    if (capture.inclination)
      capture.inclination = rotate_upside_down_if(below, *capture.inclination);
  }
  return compute_level_rotations(captures, *images.calibration,
                                 (below ? -1 : 1) * images.yaw_in_robot_rad);
}

}  // namespace

Eigen::Matrix3d compute_level_rotation(const Inclination& inclination, double yaw_in_robot_rad,
                                       const Eigen::Matrix3d& base_from_camera) {
  const Eigen::Matrix3d level_from_base = compute_level_from_base(inclination, yaw_in_robot_rad);
  return level_rotation_from_zenith((level_from_base * base_from_camera).inverse().col(2));
}

LevelRotations compute_level_rotations(const CapturesTable& captures,
                                       const Calibration& calibration, double yaw_in_robot_rad) {
  const Eigen::Matrix3d base_from_camera = make_detector_camera(calibration).level_from_camera;
  LevelRotations levels;
  for (const auto& [image, capture] : captures) {
    if (!capture.inclination) continue;
    levels.emplace(
        image, compute_level_rotation(*capture.inclination, yaw_in_robot_rad, base_from_camera));
  }
  return levels;
}

LampIntake::LampIntake(LightDetector detector, ImageUse use, const FrontendOptions& options,
                       const std::optional<std::array<int, 2>>& imager_px, LevelRotations levels)
    : levels_(std::move(levels)),
      detector_(std::move(detector)),
      use_(use),
      options_(options),
      imager_px_(imager_px) {}

LampIntake::LampIntake(const LampImages& images, ImageUse use, const FrontendOptions& options)
    : levels_(read_level_rotations(images)),
      detector_(make_detector(images, options, remarks_)),
      use_(use),
      options_(options),
      can_turn_(!options.readout && !images.calibration) {
  if (images.calibration) imager_px_ = images.calibration->camera.imager_px;
  if (!options.annotate.empty()) create_folder(options.annotate, images.images);
}

Observation LampIntake::detect_lamps_in_image(const SourceImage& source) const {
  Observation result{source.file, source.time_s};
  result.readout = detector_.readout_direction();
  cv::Mat pixels;
  read_and_detect(source, options_, imager_px_, result, [&](const cv::Mat& image) {
    pixels = image;
    if (min_lamps_for_use(use_) > 0 && is_image_uniform(image)) reject_no_signal(image, result);
    if (!result.is_image_kept()) return;
    const auto level = levels_.find(result.image_file_name());
    const LightDetector detector =
        level == levels_.end() ? detector_ : detector_.copy_for_tilt(level->second);
    if (can_turn_) {
      auto [readout, lights] = detect_both_readouts(detector, to_image_view(image));
      result.readout = readout;
      result.lights = std::move(lights);
    } else {
      result.lights = detector.detect_lights(to_image_view(image));
    }
    if (repetition_) {
      result.lights = repetition_(
          result.image_file_name(), std::move(result.lights),
          [&](const std::optional<Eigen::Matrix3d>& level_from_camera) {
            return detector.copy_for_tilt(level_from_camera).detect_lights(to_image_view(image));
          });
    }
    if (std::cmp_less(list_identified_lamps(result).size(), min_lamps_for_use(use_)))
      reject_few_lamps(image, result);
  });
  if (!options_.annotate.empty() && !pixels.empty()) {
    write_annotated_image(options_.annotate, source.file, annotate_image(pixels, result.lights));
  }
  for (Light& light : result.lights) std::vector<Eigen::Vector2d>().swap(light.outline);
  return result;
}

Observations LampIntake::detect_lamps_in_images(const std::vector<fs::path>& files,
                                                const IntakeProgress& progress) const {
  ImageSource source(files, options_, imager_px_);
  Observations result = collect_observations(
      source, options_.threads,
      [&](const SourceImage& image) { return detect_lamps_in_image(image); }, progress);
  reject_repeated_images(result.images, use_, options_);
  const auto turned = std::count_if(
      result.images.begin(), result.images.end(),
      [&](const Observation& image) { return image.readout != detector_.readout_direction(); });
  if (turned > 0) {
    result.notes.push_back(fmt::format("{} of {} images show stripes along {}", turned,
                                       result.images.size(),
                                       readout_direction() == Readout::rows ? "columns" : "rows"));
  }
  prepend_messages(remarks_, result);
  return result;
}

std::vector<fs::path> list_lamp_images(const fs::path& images) {
  return is_video_file_name(images) ? std::vector{images} : list_images(images);
}

Observations detect_lamps(const LampImages& images, ImageUse use, const FrontendOptions& options,
                          const IntakeProgress& progress) {
  Observations result = LampIntake(images, use, options)
                            .detect_lamps_in_images(list_lamp_images(images.images), progress);
  check_any_identified(images, options, result);
  return result;
}

void check_any_identified(const LampImages& images, const FrontendOptions& options,
                          Observations& result) {
  check_any_readable(images.images, result.images);
  if (count_lights(result.images, LightKind::lamp) == 0) {
    const std::string wrong_readout = explain_readout(images, options);
    result.failure = {false, wrong_readout.empty() ? explain_no_lamp(result.images, images.lamps)
                                                   : wrong_readout};
  } else if (std::none_of(result.images.begin(), result.images.end(),
                          [](const Observation& image) { return image.is_image_kept(); })) {
    result.failure = {false, explain_no_image(result.images)};
  }
}

Readout estimate_readout(const std::vector<fs::path>& images, const std::optional<Readout>& known,
                         const FrontendOptions& options,
                         const std::optional<std::array<int, 2>>& imager_px, Observations& result) {
  if (known) return *known;
  ImageSource source(images, options, imager_px);
  cv::Mat pixels;
  const auto found = estimate_readout(source.expected_image_count(), [&](std::size_t) {
    const auto image = source.read_next_image();
    pixels.release();
    try {
      if (image) pixels = image->read_gray_image(options);
    } catch (const InputError&) {  // rejected when its lights are detected
    }
    return to_image_view(pixels);
  });
  if (!found) {
    // [LAMP-12] `readout is not stated` | readout estimated, or rows assumed; some images rotated,
    //   as of a phone | `--readout`
    result.warnings.emplace_back(
        "the readout is not stated and not visible in the images: rows are assumed; give "
        "--readout");
    return Readout::rows;
  }
  result.notes.push_back(fmt::format("the readout is not stated: the images show stripes along {}",
                                     *found == Readout::rows ? "rows" : "columns"));
  return *found;
}

std::string describe_wrong_readout(const std::vector<fs::path>& images, Readout given,
                                   const std::string& source, const FrontendOptions& options,
                                   const std::optional<std::array<int, 2>>& imager_px) {
  Observations remarks;
  const Readout shown = estimate_readout(images, {}, options, imager_px, remarks);
  if (shown == given || !remarks.warnings.empty()) return "";
  // [LAMP-15] `stripes along` | wrong readout in an option or file | correct the one that is named
  return fmt::format(
      "the readout is along {} in {}, but the images show stripes along {}; correct it",
      given == Readout::rows ? "rows" : "columns", source,
      shown == Readout::rows ? "rows" : "columns");
}

void check_frequencies(const LampMap& lamps, const fs::path& lamps_file) {
  if (std::any_of(lamps.lamps.begin(), lamps.lamps.end(),
                  [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); })) {
    return;
  }
  throw InputError(lamps_file,
                   "no lamp has a frequency_hz, which is needed to identify lamps; add it");
}

void check_map_has_lamps(std::span<const Frame> frames, const LampMap& lamps,
                         const fs::path& lamps_file) {
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (find_lamp_by_id(lamps.lamps, detection.lamp) != nullptr) return;
    }
  }
  // [FILE-6] `has none of the lamps`
  throw InputError(lamps_file, "has none of the lamps in the captures");
}

}  // namespace vlp
