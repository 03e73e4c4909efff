// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <string>

#include "captures/shared_folder.h"
#include "frontend/video.h"

namespace vlp {

/// Frames of a camera or of a video, as images in a folder.
class FrameSource {
 public:
  /// A camera is asked for frames of this size. Throws InputError when it cannot be opened.
  FrameSource(const std::string& source, const std::array<int, 2>& imager_px)
      : source_(source), video_(source, imager_px) {}

  /// Saves the next frame, grey, as FOLDER/frame-000123.png, whole or not at all. Returns its path,
  /// which is empty at the end of a file. Throws InputError if it cannot be written, if the path of
  /// the folder leads elsewhere by now, or if a camera gives no frame.
  std::filesystem::path save_next(const SharedFolder& folder);

  bool ended() const { return ended_; }

 private:
  std::string source_;
  Video video_;
  bool ended_ = false;
  int frames_ = 0;
};

}  // namespace vlp
