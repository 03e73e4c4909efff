// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/skipped_images.h"

#include <fmt/core.h>

#include <algorithm>

#include "detection/video.h"

namespace vlp {

std::vector<SkippedImage> skipped_images(const std::vector<std::filesystem::path>& images,
                                         const std::vector<std::string>& refused) {
  std::vector<SkippedImage> skipped;
  const bool one_folder = std::all_of(images.begin(), images.end(), [&](const auto& other) {
    return other.parent_path() == images.front().parent_path();
  });
  auto image = images.begin();
  for (const std::string& line : refused) {  // in the order of the images
    while (image != images.end() && !line.starts_with(image->string() + ": ")) ++image;
    if (image == images.end()) {
      skipped.push_back({"", line});
      image = images.begin();
      continue;
    }
    const auto name = one_folder ? image->filename() : *image;
    skipped.push_back({name.string(), line.substr(image->string().size() + 2)});
    ++image;
  }
  return skipped;
}

void SkippedViews::add(const std::string& image, const std::string& reason, const char* of_frames) {
  const auto video = video_of_frame(image);
  if (!video) {
    alone_.push_back({image, reason});
    return;
  }
  details_.push_back(image + ": " + reason);
  const auto same = std::find_if(together_.begin(), together_.end(), [&](const Together& other) {
    return other.video == *video && other.of_frames == of_frames;
  });
  if (same == together_.end()) {
    together_.push_back({*video, of_frames, 1});
  } else {
    ++same->count;
  }
}

void SkippedViews::tell(StepResult& result) const {
  result.skipped.insert(result.skipped.end(), alone_.begin(), alone_.end());
  for (const auto& [video, of_frames, count] : together_) {
    result.skipped.push_back({video, fmt::format("{} of its frames {}", count, of_frames)});
  }
  result.details.insert(result.details.end(), details_.begin(), details_.end());
}

InputError nothing_usable(const std::filesystem::path& where, std::size_t images,
                          const StepResult& result) {
  std::string words = fmt::format("none of its {} images can be used", images);
  if (!result.skipped.empty()) {
    const auto& [image, reason] = result.skipped.front();
    words += "; the first, " + image + ": " + reason;
  }
  return {where, words};
}

}  // namespace vlp
