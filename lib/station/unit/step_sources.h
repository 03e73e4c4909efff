// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "station/unit/frame_source.h"
#include "station/unit/watched_run.h"

namespace vlp {

/// Cameras and videos that deliver a unit's images, by step.
class StepSources {
 public:
  /// Opens the sources: "STEP=SOURCE" for one step, or "SOURCE" for all steps without one. Throws
  /// InputError if a source cannot be opened.
  StepSources(const std::vector<std::string>& sources, const std::array<int, 2>& imager_px);

  bool any() const { return !by_step_.empty(); }
  /// Writes the next frame to the folder of the current step, after the previous one was processed.
  /// The file of a rejected frame is removed, because a moving camera blurs images and a resting
  /// one repeats them. Rejected frames with a fault remain in the record. Throws InputError as
  /// FrameSource::save_next() and WatchedRun::discard().
  void feed(const Unit& unit, WatchedRun& run);
  /// Returns true if the current step's video has ended and all of its frames are processed.
  bool ended(const Unit& unit) const;

 private:
  std::map<StationStep, std::shared_ptr<FrameSource>> by_step_;
  /// Last frame, and its step.
  std::filesystem::path last_;
  StationStep last_step_ = StationStep::boards;
};

}  // namespace vlp
