// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/lamp_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "detection/detect_captures.h"
#include "detection/mat_view.h"
#include "detection/video.h"
#include "lamps/readout.h"
#include "lamps/signal/lamp_map_check.h"
#include "rig/find_lamp.h"
#include "rig/input_error.h"
#include "session/leaning_captures.h"
#include "session/session_folder.h"
#include "session/skipped_images.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

/// Nothing for what is no image: it is reported when the lights are looked for.
cv::Mat next_or_nothing(ImageSource& images, double max_mpx) {
  const auto image = images.next();
  if (!image) return {};
  try {
    return image->read(max_mpx);
  } catch (const InputError&) {
    return {};
  }
}

void check_row_time(const LampImages& input, const DetectorCamera& camera) {
  if (!camera.row_time_s) {
    throw InputError(
        input.camera_file,
        "camera.row_time_s is missing: without it no stripe tells its lamp; --row-time-s of "
        "vlp-intrinsics states it, vlp-train --row-time finds it");
  }
}

LampClassifier classifier_for(const LampImages& input, const DetectorCamera& camera,
                              std::vector<std::string>& warnings) {
  LampClassifier classifier = read_lamp_classifier(input.classifier_file);
  for (const auto& lamp : classifier.lamps) {
    if (find_lamp(input.lamps.lamps, lamp.lamp) != nullptr) continue;
    throw InputError(input.classifier_file,
                     fmt::format("lamp {} is not in {}", lamp.lamp, input.lamps_file.string()));
  }
  for (const Lamp& lamp : input.lamps.lamps) {
    const bool known = std::any_of(classifier.lamps.begin(), classifier.lamps.end(),
                                   [&](const auto& other) { return other.lamp == lamp.id; });
    if (known) continue;
    warnings.push_back(
        fmt::format("lamp {} is unknown to {}", lamp.id, input.classifier_file.string()));
  }
  constexpr double same = 0.005;
  if (classifier.row_time_s && camera.row_time_s &&
      std::abs(*classifier.row_time_s / *camera.row_time_s - 1) > same) {
    throw InputError(
        input.classifier_file,
        fmt::format("row_time_s is {:.4g}, that of {} is {:.4g}: train it for this camera",
                    *classifier.row_time_s,
                    input.camera_file.empty() ? "--row-time-s" : input.camera_file.string(),
                    *camera.row_time_s));
  }
  return classifier;
}

constexpr std::size_t kMostLines = 5;

void warn_of_rest(std::size_t count, const char* what, std::vector<std::string>& warnings) {
  if (count > kMostLines) {
    warnings.push_back(fmt::format("and {} more {}", count - kMostLines, what));
  }
}

/// Of lamps of the map that cannot be told apart for certain, or whose stripes can hardly be seen.
void warn_of_map(const LampImages& input, const DetectorCamera& detector,
                 std::vector<std::string>& warnings) {
  std::optional<double> focal_px;
  if (input.camera) {
    focal_px = input.camera->camera.intrinsics[detector.readout == Readout::rows ? 1 : 0];
  }
  const StripeConditions conditions{*detector.row_time_s, focal_px, 0, input.exposure_s};
  const auto alike = lamps_alike(input.lamps, conditions);
  for (std::size_t i = 0; i < std::min(alike.size(), kMostLines); ++i) {
    const auto& [first, second, gap, needed] = alike[i];
    warnings.push_back(fmt::format(
        "lamps {} and {} may be left unknown, seen from z = 0: their frequencies differ by {:.1f} "
        "%, {:.1f} % would be enough; change one of the two frequencies, or a duty by 0.3",
        first, second, 100 * gap, 100 * needed));
  }
  warn_of_rest(alike.size(), "pairs of lamps with frequencies that are too near", warnings);
  const auto unreadable = lamps_unreadable(input.lamps, conditions);
  for (std::size_t i = 0; i < std::min(unreadable.size(), kMostLines); ++i) {
    const auto& [lamp, period_lines, periods, contrast] = unreadable[i];
    if (period_lines < kShortestPeriod_lines) {
      warnings.push_back(fmt::format(
          "lamp {} has stripes of {:.2g} lines, too fine to be seen: a lower frequency shows them",
          lamp, period_lines));
    } else if (periods < kMinPeriods) {
      warnings.push_back(fmt::format(
          "lamp {} shows only {:.1f} stripes, seen from z = 0: a higher frequency, a larger lamp "
          "or a camera nearer to it shows more",
          lamp, periods));
    } else {
      warnings.push_back(fmt::format(
          "lamp {} has {:.0f} % of its stripes left after an exposure of {:.3g} us: expose shorter",
          lamp, 100 * contrast, 1e6 * *input.exposure_s));
    }
  }
  warn_of_rest(unreadable.size(), "lamps with stripes that can hardly be seen", warnings);
}

/// With the reason that most of the lights have.
std::string why_no_lamp(const SeenLamps& seen) {
  const auto count = [&](LightKind kind) { return count_of(seen.lights, kind); };
  std::string why = fmt::format(
      "no lamp was identified wholly in view in {} images ({} skipped; {} lamps are cut by the "
      "image's edge, {} lights flicker unlike any lamp of the map, {} are steady, {} have no form)",
      seen.images, seen.skipped.size(), count(LightKind::cut), count(LightKind::unknown),
      count(LightKind::steady), count(LightKind::formless));
  const auto reasons = reasons_of(seen.lights);
  if (reasons.empty()) return why + ": are lamps lit and in view, and the exposure long enough?";
  const auto& [kind, reason, lights] = reasons.front();
  return why + fmt::format("; most often, {} times: {}", lights, explanation_of(reason));
}

/// Made when it is not there.
fs::path picture_folder(const LampImages& input) {
  std::error_code error;
  fs::create_directories(input.annotate, error);
  if (error) throw InputError(input.annotate, "cannot be made: " + error.message());
  if (fs::equivalent(input.annotate, input.folder, error)) {
    throw InputError(input.annotate, "holds the images: the pictures go into another folder");
  }
  return input.annotate;
}

/// How the images of an input are looked at. What there is to say of that goes to `result`.
struct LampSearch {
  LampSearch(const LampImages& lamp_images, StepResult& result);

  CaptureDetections run_over(const std::vector<fs::path>& some, const StepProgress& progress,
                             StepResult& result) const {
    ImageSource source(some, from_videos);
    CaptureDetections found = detect_captures(LightDetector(input.lamps, camera, classifier),
                                              source, run, [&](std::size_t done) {
                                                if (progress)
                                                  progress(done, std::max(done, source.expected()));
                                              });
    result.warnings.insert(result.warnings.end(), source.warnings().begin(),
                           source.warnings().end());
    if (found.other_readouts > 0) {
      result.notes.push_back(fmt::format("{} of {} images show stripes along {}",
                                         found.other_readouts, found.images.size(),
                                         camera.readout == Readout::rows ? "columns" : "rows"));
    }
    return found;
  }

  const LampImages& input;
  DetectorCamera camera;
  std::optional<LampClassifier> classifier;
  std::vector<fs::path> images;
  DetectRun run;
  FromVideos from_videos;
};

LampSearch::LampSearch(const LampImages& lamp_images, StepResult& result)
    : input(lamp_images),
      camera(input.camera ? detector_camera(*input.camera)
                          : DetectorCamera{Readout::rows, input.row_time_s, {}}),
      run{input.threads} {
  if (input.classifier_file.empty()) {
    check_frequencies(input.lamps, input.lamps_file);
    check_row_time(input, camera);
  } else {
    classifier = classifier_for(input, camera, result.warnings);
  }
  images = is_video_name(input.folder) ? std::vector{input.folder} : images_in(input.folder);
  run.max_mpx = input.max_mpx;
  std::optional<Readout> stated = input.readout;
  if (input.camera) {
    run.imager_px = input.camera->camera.imager_px;
    if (!stated) stated = input.camera->camera.readout;
  }
  from_videos = {input.every, input.max_mpx, run.imager_px};
  if (input.camera) {
    CapturesTable captures;
    if (input.captures) {
      captures = *input.captures;
    } else if (!is_video_name(input.folder)) {
      captures = captures_table(input.folder);
    }
    run.levels = levels_told(captures, *input.camera, input.yaw_in_robot_rad);
  }
  // The images of one lens have one orientation; others may be turned, as phones turn them, so that
  // a folder need not have one read-out.
  run.any_readout = !stated && !input.camera;
  StepResult of_folder;
  camera.readout = readout_of(images, stated, run.any_readout ? of_folder : result, from_videos);
  if (run.any_readout)
    result.notes.insert(result.notes.end(), of_folder.notes.begin(), of_folder.notes.end());
  if (!input.annotate.empty()) run.annotate = picture_folder(input);
}

}  // namespace

void check_frequencies(const LampMap& lamps, const fs::path& lamps_file) {
  const bool frequencies =
      std::any_of(lamps.lamps.begin(), lamps.lamps.end(),
                  [](const Lamp& lamp) { return lamp.frequency_hz.has_value(); });
  if (!frequencies) {
    throw InputError(lamps_file, "no lamp has a frequency_hz: none could be told from another");
  }
}

void check_lamps(std::span<const Frame> frames, const LampMap& lamps, const fs::path& lamps_file) {
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      if (find_lamp(lamps.lamps, detection.lamp) != nullptr) return;
    }
  }
  throw InputError(lamps_file, "has none of the lamps that the captures show");
}

Readout readout_of(std::vector<fs::path> images, const std::optional<Readout>& stated,
                   StepResult& result, const FromVideos& from_videos) {
  if (stated) return *stated;
  ImageSource source(std::move(images), from_videos);
  cv::Mat image;
  const auto found = find_readout(source.expected(), [&](std::size_t) {
    image = next_or_nothing(source, from_videos.max_mpx);
    return image_view(image);
  });
  if (!found) {
    result.warnings.emplace_back(
        "the read-out is not stated and the images do not show it: rows are taken; --readout "
        "tells it");
    return Readout::rows;
  }
  result.notes.push_back(fmt::format("the read-out is not stated: the images show stripes along {}",
                                     *found == Readout::rows ? "rows" : "columns"));
  return *found;
}

SeenLamps see_lamps(const LampImages& input, const StepProgress& progress) {
  SeenLamps seen;
  LampSearch search(input, seen);
  if (!search.classifier) warn_of_map(input, search.camera, seen.warnings);
  CaptureDetections found = search.run_over(search.images, progress, seen);
  seen.images = static_cast<int>(found.images.size());
  seen.times_s = std::move(found.times_s);
  seen.frames = std::move(found.frames);
  seen.lights = std::move(found.lights);
  seen.skipped = skipped_images(found.images, found.refused);
  if (seen.frames.empty()) throw nothing_usable(input.folder, found.images.size(), seen);
  if (count_of(seen.lights, LightKind::lamp) == 0) {
    seen.fail(StepFailure::undetermined, why_no_lamp(seen));
  }
  return seen;
}

CaptureDetections see_lamps_again(const LampImages& input, const LevelsOfImages& levels) {
  StepResult said_before;
  LampSearch search(input, said_before);
  std::vector<fs::path> images = search.images;
  std::erase_if(images, [&](const fs::path& image) {
    return levels.find(image.filename().string()) == levels.end();
  });
  for (const auto& [image, level] : levels) search.run.levels.insert_or_assign(image, level);
  return search.run_over(images, {}, said_before);
}

}  // namespace vlp
