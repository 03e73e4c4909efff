// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "captures/shared_folder.h"
#include "station/records/run_record.h"
#include "station/records/spool.h"
#include "station/unit/unit.h"
#include "station/unit/watched_folder.h"

namespace vlp {

/// The folder of a finished run, CAPTURES/CAMERA, becomes CAPTURES/CAMERA.RUN, images and all.
/// Throws InputError.
void put_away(const std::filesystem::path& folder, const std::string& run);

/// A run of a unit whose images arrive in CAPTURES/CAMERA/STEP/. The folders are the truth: an
/// image that is taken away is no longer of the unit, one that is overwritten counts anew, so does
/// a captures.csv, and a program that starts again after it was killed goes on where it was, with
/// the same name of the run (file `.run` there, with a second line when the run is kept). One
/// program at a time.
class WatchedRun {
 public:
  /// Makes the folders. Throws InputError: another program works on this camera, a folder cannot be
  /// made or is a symbolic link, `.run` names no run or one of another camera, a run that is kept
  /// was not put away and its record cannot be read.
  WatchedRun(Unit& unit, Spool& spool);
  ~WatchedRun();
  WatchedRun(const WatchedRun&) = delete;
  WatchedRun& operator=(const WatchedRun&) = delete;

  /// The record of a run that was killed after its verdict: it is published and put away, and there
  /// is nothing left to look at.
  const std::optional<RunRecord>& finished() const { return finished_; }

  struct Arrival {
    StationStep step;
    std::string image;
    bool gone;
  };
  /// Takes what changed, a few images at a time, and solves what has enough.
  std::vector<Arrival> look(std::size_t most);

  /// Removes the file of a refused image, not the refusal (Unit::discard). Throws InputError if it
  /// cannot be removed.
  void discard(StationStep step, const std::string& image);

  const std::string& run() const { return run_; }
  const std::filesystem::path& folder() const { return folder_; }
  const SharedFolder& step_folder(StationStep step) const {
    return step_folders_[static_cast<std::size_t>(step)];
  }

  /// After the run is kept: from then on it is not judged again, though the records be away.
  void mark_kept() const;
  /// Renames the folder by put_away(). Throws InputError also if its path leads elsewhere by now.
  void put_away() const;

 private:
  void begin(Spool& spool);
  bool read_state();

  Unit& unit_;
  std::filesystem::path folder_;
  SharedFolder files_;
  std::string run_;
  std::optional<RunRecord> finished_;
  int lock_ = -1;
  std::vector<WatchedFolder> steps_;
  std::vector<SharedFolder> step_folders_;
  std::vector<std::vector<std::filesystem::path>> waiting_;
  std::vector<std::string> tables_;
};

}  // namespace vlp
