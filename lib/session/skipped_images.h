// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rig/input_error.h"
#include "session/step_result.h"

namespace vlp {

/// Lines "FILE: why" of images that were refused, by their names, with their folders where there
/// are several. A line of another form keeps its
/// words.
std::vector<SkippedImage> skipped_images(const std::vector<std::filesystem::path>& images,
                                         const std::vector<std::string>& refused);

/// Views that are skipped, a line each; but frames of a video, of which there are many, together, a
/// line for each video and reason, and a detail each.
class SkippedViews {
 public:
  /// `of_frames`: what is said of all such frames together, after "12 of its frames".
  void add(const std::string& image, const std::string& reason, const char* of_frames);
  void tell(StepResult& result) const;

 private:
  struct Together {
    std::string video, of_frames;
    int count;
  };
  std::vector<SkippedImage> alone_;
  std::vector<Together> together_;
  std::vector<std::string> details_;
};

/// That none of so many images can be used, with the reason of the first.
InputError nothing_usable(const std::filesystem::path& where, std::size_t images,
                          const StepResult& result);

}  // namespace vlp
