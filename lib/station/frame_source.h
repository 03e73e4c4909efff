// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

namespace vlp {

/// Frames of a camera (/dev/video0, by V4L2) or of a video file, through OpenCV.
class FrameSource {
 public:
  /// Throws InputError when it cannot be opened.
  explicit FrameSource(const std::string& source);
  ~FrameSource();
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;

  /// Saves the next frame, grey, as FOLDER/frame-000123.png, whole or not at all, and returns its
  /// path; nothing at the end of a file. Throws InputError when it cannot be written.
  std::filesystem::path save_next(const std::filesystem::path& folder);

  bool ended() const { return ended_; }

 private:
  struct Capture;
  std::unique_ptr<Capture> capture_;
  bool ended_ = false;
  int frames_ = 0;
};

}  // namespace vlp
