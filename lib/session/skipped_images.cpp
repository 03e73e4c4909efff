// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/skipped_images.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "frontend/video.h"

namespace vlp {
namespace {

/// Rejected frames of one video for one reason.
struct SkippedFrames {
  std::string video;
  RejectionReason reason;
  int count;
};

void prepend(const std::vector<std::string>& remarks, std::vector<std::string>& all) {
  all.insert(all.begin(), remarks.begin(), remarks.end());
}

}  // namespace

std::vector<SkippedImage> skipped_images(const std::vector<Observation>& images) {
  const bool is_one_folder = std::all_of(images.begin(), images.end(), [&](const auto& other) {
    return other.file.parent_path() == images.front().file.parent_path();
  });
  std::vector<SkippedImage> skipped;
  std::vector<SkippedFrames> frames;
  for (const Observation& image : images) {
    if (image.is_kept()) continue;
    const std::string name = is_one_folder ? image.name() : image.file.string();
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
    skipped.push_back({video, fmt::format("{} of its frames: {}", count, to_string(reason))});
  }
  return skipped;
}

void add_remarks(const Observations& seen, StepResult& result) {
  const auto skipped = skipped_images(seen.images);
  result.skipped.insert(result.skipped.begin(), skipped.begin(), skipped.end());
  prepend(seen.warnings, result.warnings);
  prepend(seen.notes, result.notes);
  prepend(seen.details, result.details);
  for (const Observation& image : seen.images) {
    if (image.is_kept() || !parse_video_name(image.name())) continue;
    result.details.push_back(image.name() + ": " + image.rejection->message);
  }
  if (!seen.failure) return;
  const auto& [is_wrong_file, message, file] = *seen.failure;
  result.fail(is_wrong_file ? StepFailure::wrong_board : StepFailure::undetermined, message, file);
}

}  // namespace vlp
