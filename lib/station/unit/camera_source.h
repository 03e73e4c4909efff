// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "captures/shared_folder.h"
#include "frontend/video.h"
#include "station/unit/watched_run.h"

namespace vlp {

/// Frames of a camera or a video, written as images to a folder.
class FrameSource {
 public:
  /// Opens a source of frames: a camera (/dev/video0), a video file or a URL. Frames of `imager_px`
  /// (width, height) are requested from a camera.
  /// @throws InputError if it cannot be opened
  FrameSource(const std::string& source, const std::array<int, 2>& imager_px)
      : source_(source), video_(source, imager_px) {}

  /// Writes the next frame, in gray, atomically as FOLDER/frame-000123.png, and returns its path;
  /// empty at the end of a video. Throws InputError if it cannot be written, if the path of the
  /// folder leads elsewhere by now, or if a camera delivers no frame.
  std::filesystem::path save_next_frame(const SharedFolder& folder);

  bool has_source_ended() const { return ended_; }

 private:
  std::string source_;
  Video video_;
  bool ended_ = false;
  int frames_ = 0;
};

/// Cameras and videos that deliver a unit's images, by step.
class StepSources {
 public:
  /// Opens the sources: "STEP=SOURCE" for one step, or "SOURCE" for all steps without one. Throws
  /// InputError if a source cannot be opened.
  StepSources(const std::vector<std::string>& sources, const std::array<int, 2>& imager_px);

  bool has_frame_sources() const { return !by_step_.empty(); }
  /// Writes the next frame to the folder of the current step, after the previous one was processed.
  /// The file of a rejected frame is removed, because a moving camera blurs images and a resting
  /// one repeats them. Rejected frames with a fault remain in the record. Throws InputError as
  /// FrameSource::save_next_frame() and WatchedRun::delete_rejected().
  void write_next_frame(const Unit& unit, WatchedRun& run);
  /// Returns true if the current step's video has ended and all of its frames are processed.
  bool has_video_ended(const Unit& unit) const;

 private:
  std::map<StationStep, std::shared_ptr<FrameSource>> by_step_;
  /// Path of the last frame that was written, and its step.
  std::filesystem::path last_;
  StationStep last_step_ = StationStep::boards;
};

}  // namespace vlp
