// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/step_result.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "frontend/video.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

constexpr std::array<std::pair<StepFailure, std::string_view>, 6> kNames{
    {{StepFailure::none, "none"},
     {StepFailure::bad_input, "bad_input"},
     {StepFailure::undetermined, "undetermined"},
     {StepFailure::wrong_board, "wrong_board"},
     {StepFailure::wrong_map, "wrong_map"},
     {StepFailure::wrong_place, "wrong_place"}}};

/// Rejected frames of one video for one reason.
struct SkippedFrames {
  std::string video;
  RejectionReason reason;
  int count;
};

void prepend_messages(const std::vector<std::string>& remarks, std::vector<std::string>& all) {
  all.insert(all.begin(), remarks.begin(), remarks.end());
}

}  // namespace

std::string_view step_failure_name(StepFailure failure) {
  for (const auto& [known, name] : kNames) {
    if (known == failure) return name;
  }
  return "";
}

std::optional<StepFailure> failure_from_name(std::string_view name) {
  for (const auto& [failure, known] : kNames) {
    if (known == name) return failure;
  }
  return std::nullopt;
}

std::vector<SkippedImage> list_skipped_images(const std::vector<Observation>& images) {
  const bool is_one_folder = std::all_of(images.begin(), images.end(), [&](const auto& other) {
    return other.file.parent_path() == images.front().file.parent_path();
  });
  std::vector<SkippedImage> skipped;
  std::vector<SkippedFrames> frames;
  for (const Observation& image : images) {
    if (image.is_image_kept()) continue;
    const std::string name = is_one_folder ? image.image_file_name() : image.file.string();
    const auto video = parse_video_name(name);
    if (!video) {
      skipped.push_back({name, image.rejection->message});
      continue;
    }
    const RejectionReason reason = image.rejection->reason;
    const auto same = std::find_if(frames.begin(), frames.end(), [&](const SkippedFrames& other) {
      return other.video == *video && other.reason == reason;
    });
    if (same == frames.end()) {
      frames.push_back({*video, reason, 1});
    } else {
      ++same->count;
    }
  }
  for (const auto& [video, reason, count] : frames) {
    skipped.push_back({video, fmt::format("{} of its frames: {}", count, reason_phrase(reason))});
  }
  return skipped;
}

namespace {

/// Warns of images that are used in spite of a doubt: their number, the first names, and the first
/// doubt.
void warn_about_images(const std::vector<Observation>& images, StepResult& result) {
  constexpr int max_names = 3;
  std::string names, first_doubt;
  int count = 0;
  for (const Observation& image : images) {
    if (!image.is_image_kept() || image.doubt.empty()) continue;
    if (++count == 1) first_doubt = image.doubt;
    if (count <= max_names) names += (count > 1 ? ", " : "") + image.image_file_name();
  }
  if (count == 0) return;
  if (count > 1) {
    names = fmt::format("{} doubtful images are used ({}{}), the first", count, names,
                        count > max_names ? ", ..." : "");
  }
  result.warnings.push_back(names + ": " + first_doubt);
}

}  // namespace

void add_intake_remarks(const Observations& seen, StepResult& result) {
  const auto skipped = list_skipped_images(seen.images);
  result.skipped.insert(result.skipped.begin(), skipped.begin(), skipped.end());
  prepend_messages(seen.warnings, result.warnings);
  prepend_messages(seen.notes, result.notes);
  prepend_messages(seen.details, result.details);
  warn_about_images(seen.images, result);
  for (const Observation& image : seen.images) {
    if (image.is_image_kept() || !parse_video_name(image.image_file_name())) continue;
    result.details.push_back(image.image_file_name() + ": " + image.rejection->message);
  }
  if (!seen.failure) return;
  const auto& [is_wrong_file, message, file] = *seen.failure;
  result.set_step_failure(is_wrong_file ? StepFailure::wrong_board : StepFailure::undetermined,
                          message, file);
}

std::string format_failure_message(const StepResult& result) {
  return result.file_to_correct.empty() ? result.message
                                        : InputError(result.file_to_correct, result.message).what();
}

}  // namespace vlp
