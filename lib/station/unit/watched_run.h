// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "captures/shared_folder.h"
#include "station/records/run_record.h"
#include "station/records/spool.h"
#include "station/unit/unit.h"

namespace vlp {

/// Folder in which images arrive. It need not exist yet.
class WatchedFolder {
 public:
  explicit WatchedFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  struct Changes {
    /// Paths of the images that are new since the last call, sorted by name. An image that was
    /// overwritten is new again.
    std::vector<std::filesystem::path> added;
    /// Names of the images that were deleted since the last call.
    std::vector<std::string> removed;
  };
  /// Returns the changes since the last call. An image is new if file, size and time are the same
  /// in two successive calls, so that it is no longer being written. Ignores names that begin with
  /// a dot, which are incomplete files.
  Changes poll();
  /// Ignores the removal of a file that the caller is about to delete.
  void ignore_removal(const std::string& name) { files_.erase(name); }

  const std::filesystem::path& watched_folder() const { return folder_; }

 private:
  struct File {
    std::uintmax_t bytes;
    std::filesystem::file_time_type time;
    bool is_reported;
  };
  std::filesystem::path folder_;
  std::map<std::string, File> files_;
};

/// Renames the folder of a finished run, CAPTURES/CAMERA, to CAPTURES/CAMERA.RUN, with its images.
/// Throws InputError.
void rename_finished(const std::filesystem::path& folder, const std::string& run);

/// Run of a unit whose images arrive in CAPTURES/CAMERA/STEP/. One program at a time processes a
/// camera.
///
/// The folders determine the state. A deleted image no longer belongs to the unit, and an
/// overwritten image or captures.csv is processed again. A program that is started again after it
/// was killed continues the run under the same id. File `.run` in the folder has the id, and a
/// second line if the run is stored.
class WatchedRun {
 public:
  /// Creates the folders and starts or continues the run. Throws InputError if
  /// - another program processes this camera,
  /// - a folder cannot be created or is a symbolic link,
  /// - `.run` contains no run id, or that of another camera, or
  /// - a stored run was not moved away and its record cannot be read.
  WatchedRun(Unit& unit, Spool& spool);
  ~WatchedRun();
  WatchedRun(const WatchedRun&) = delete;
  WatchedRun& operator=(const WatchedRun&) = delete;

  /// Returns the record of a run whose program was killed after the verdict. The run is already
  /// published and moved away, and no images are left to process.
  const std::optional<RunRecord>& finished_record() const { return finished_; }

  struct ImageChange {
    StationStep step;
    std::string image;
    bool is_removed;
  };
  /// Processes changes, at most `max_images` images, and solves the steps that are complete.
  /// Returns the changes.
  std::vector<ImageChange> process_changes(std::size_t max_images);

  /// Deletes the file of a rejected image; its rejection remains (Unit::mark_image_discarded()).
  /// Throws InputError if it cannot be deleted.
  void delete_rejected(StationStep step, const std::string& image);

  const std::string& run_id() const { return run_; }
  const std::filesystem::path& run_folder() const { return folder_; }
  const SharedFolder& step_folder(StationStep step) const {
    return steps_[static_cast<std::size_t>(step)].folder;
  }

  /// Marks the run as stored. It is not judged again afterwards, even if the records are offline.
  void mark_run_stored() const;
  /// Renames the folder by rename_finished(). Throws InputError also if its path leads
  /// elsewhere by now.
  void rename_finished() const;

 private:
  struct Step {
    SharedFolder folder;
    WatchedFolder images;
    /// Images that wait to be processed.
    std::vector<std::filesystem::path> waiting = {};
    /// State of the tables of the captures' positions.
    std::string tables = {};
  };
  void start_or_continue(Spool& spool);
  bool read_run_state();

  Unit& unit_;
  std::filesystem::path folder_;
  SharedFolder files_;
  std::string run_;
  std::optional<RunRecord> finished_;
  int lock_ = -1;
  std::vector<Step> steps_;
};

}  // namespace vlp
