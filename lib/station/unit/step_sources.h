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

/// The cameras and videos from which a unit's images come, by step.
class StepSources {
 public:
  /// Each is "STEP=SOURCE" for one step, or "SOURCE" for those that have none of their own. Throws
  /// InputError when one cannot be opened.
  StepSources(const std::vector<std::string>& sources, const std::array<int, 2>& imager_px);

  bool any() const { return !by_step_.empty(); }
  /// Puts the next frame into the folder of the present step, once the one before is judged. A
  /// frame that is refused is taken away: a camera that moves blurs, one that rests shows nothing
  /// new. The record tells of those with a fault. Throws InputError as FrameSource::save_next()
  /// and WatchedRun::discard().
  void feed(const Unit& unit, WatchedRun& run);
  /// Whether the present step's video is at its end, and all of it is judged.
  bool ended(const Unit& unit) const;

 private:
  std::map<StationStep, std::shared_ptr<FrameSource>> by_step_;
  /// The frame that came last, and its step.
  std::filesystem::path last_;
  StationStep last_step_ = StationStep::boards;
};

}  // namespace vlp
