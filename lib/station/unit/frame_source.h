// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "captures/shared_folder.h"
#include "frontend/video.h"

namespace vlp {

/// Frames of a camera or a video, written as images to a folder.
class FrameSource {
 public:
  /// Opens a camera or a video. Frames of `imager_px` are requested from a camera. Throws
  /// InputError if it cannot be opened.
  FrameSource(const std::string& source, const std::array<int, 2>& imager_px)
      : source_(source), video_(source, imager_px) {}

  /// Writes the next frame, in gray, atomically as FOLDER/frame-000123.png, and returns its path;
  /// empty at the end of a video. Throws InputError if it cannot be written, if the path of the
  /// folder leads elsewhere by now, or if a camera delivers no frame.
  std::filesystem::path save_next(const SharedFolder& folder);

  bool ended() const { return ended_; }

 private:
  std::string source_;
  Video video_;
  bool ended_ = false;
  int frames_ = 0;
};

}  // namespace vlp
