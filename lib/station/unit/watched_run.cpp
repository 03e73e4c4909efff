// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/watched_run.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>

#include "captures/id.h"
#include "frontend/image_file.h"
#include "rig/input_error.h"
#include "station/records/publish_run.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr const char *kKept = "kept", *kState = ".run";

/// Returns a state that changes with the tables of the captures' positions.
std::string make_table_state(const fs::path& folder) {
  std::string state;
  for (const char* table : {"captures.csv", "truth.csv"}) {
    std::error_code none;
    const auto bytes = fs::file_size(folder / table, none);
    const auto time = fs::last_write_time(folder / table, none);
    if (!none) state += fmt::format("{} {} {};", table, bytes, time.time_since_epoch().count());
  }
  return state;
}

SharedFolder open_captures(const fs::path& captures, const std::string& camera) {
  create_station_folder(captures);
  return SharedFolder(captures).open_or_create({camera, captures, "camera"});
}

}  // namespace

WatchedRun::WatchedRun(Unit& unit, Spool& spool)
    : unit_(unit),
      folder_(unit.station_config().captures / unit.camera_id()),
      files_(open_captures(unit.station_config().captures, unit.camera_id())) {
  start_or_continue(spool);
  if (finished_) return;
  steps_.reserve(kStationSteps.size());
  for (const StationStep step : kStationSteps) {
    SharedFolder folder = files_.open_or_create({station_step_name(step), folder_, "step"});
    const fs::path path = folder.folder_path();
    steps_.push_back({std::move(folder), WatchedFolder(path)});
  }
}

WatchedRun::~WatchedRun() {
  if (lock_ >= 0) ::close(lock_);
}

/// Reads the run id from `.run`. Returns true if the run is stored.
bool WatchedRun::read_run_state() {
  constexpr std::size_t max_bytes = 100;
  const auto state = files_.read_if_exists(kState, max_bytes);
  if (!state) return false;
  run_ = state->substr(0, state->find('\n'));
  if (!is_run_id(run_)) {
    throw InputError(folder_ / kState,
                     "contains no id of a run: remove it to start a new run with its images");
  }
  return state->ends_with(fmt::format("\n{}\n", kKept));
}

void WatchedRun::start_or_continue(Spool& spool) {
  constexpr const char* lock = ".lock";
  lock_ = files_.open_regular_file(lock, O_CREAT | O_RDWR);
  if (lock_ < 0) throw InputError(folder_ / lock, "cannot be written");
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    throw InputError(folder_, "another vlp-station works on this camera");
  }
  const bool is_stored = read_run_state();
  if (run_.empty()) {
    run_ = make_run_id();
    files_.replace_file(kState, run_ + "\n");
    return;
  }
  finished_ = spool.find_run_by_id(run_);
  if (finished_ && finished_->camera != unit_.camera_id()) {
    throw InputError(folder_ / kState,
                     fmt::format("names run {} of camera {}: remove it, then its images are of a "
                                 "new run",
                                 run_, finished_->camera));
  }
  if (!finished_ && is_stored) {
    throw InputError(
        folder_, fmt::format("run {} is stored, but its record cannot be read ({}): repeat when it "
                             "can, or move the folder away",
                             run_,
                             spool.offline_reason().empty() ? "the records do not have it"
                                                            : spool.offline_reason()));
  }
  if (!finished_) return;  // the run continues
  publish_run_files(*finished_, {}, unit_.station_config().results);
  rename_finished();
}

std::vector<WatchedRun::ImageChange> WatchedRun::process_changes(std::size_t max_images) {
  std::vector<ImageChange> arrivals;
  bool reread = false;
  for (const StationStep step : kStationSteps) {
    auto& [folder, images, waiting, known_tables] = steps_[static_cast<std::size_t>(step)];
    std::string tables = make_table_state(images.watched_folder());
    if (tables != known_tables) {
      known_tables = std::move(tables);
      unit_.reprocess_step(step);
      reread = true;
    }
    const auto changes = images.poll();
    for (const std::string& name : changes.removed) {
      std::erase_if(waiting, [&](const fs::path& file) { return file.filename() == name; });
      unit_.remove_deleted(step, name);
      arrivals.push_back({step, name, true});
    }
    waiting.insert(waiting.end(), changes.added.begin(), changes.added.end());
    const auto end =
        waiting.begin() + static_cast<std::ptrdiff_t>(std::min(max_images, waiting.size()));
    const std::vector<fs::path> now(waiting.begin(), end);
    waiting.erase(waiting.begin(), end);
    max_images -= now.size();
    unit_.add_step_images(step, now, !waiting.empty());
    for (const fs::path& file : now) arrivals.push_back({step, file.filename().string(), false});
  }
  if (!arrivals.empty() || reread) unit_.solve_completed(false);
  return arrivals;
}

void WatchedRun::mark_run_stored() const {
  try {
    files_.replace_file(kState, fmt::format("{}\n{}\n", run_, kKept));
  } catch (const InputError&) {  // rename_finished() reports it; records reject a second
                                 // verdict
  }
}

void WatchedRun::delete_rejected(StationStep step, const std::string& image) {
  step_folder(step).remove_file(image);
  steps_[static_cast<std::size_t>(step)].images.ignore_removal(image);
  unit_.mark_image_discarded(step, image);
}

void WatchedRun::rename_finished() const {
  files_.check_not_replaced();
  vlp::rename_finished(folder_, run_);
}

void rename_finished(const fs::path& folder, const std::string& run) {
  const fs::path kept = folder.string() + "." + run;
  std::error_code error;
  fs::rename(folder, kept, error);
  if (error) {
    // [FILE-1] `cannot be put away`
    throw InputError(folder, "cannot be put away as " + kept.string() + ": " + error.message());
  }
}

WatchedFolder::Changes WatchedFolder::poll() {
  std::map<std::string, File> now;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') || !is_image_file_name(entry->path())) continue;
    std::error_code gone;  // the file was removed
    const bool file = entry->is_regular_file(gone);
    const File found{entry->file_size(gone), entry->last_write_time(gone), false};
    if (file && !gone && found.bytes > 0) now.emplace(name, found);
  }
  Changes changes;
  for (auto& [name, file] : now) {
    const auto before = files_.find(name);
    if (before == files_.end()) continue;
    const bool same = before->second.bytes == file.bytes && before->second.time == file.time;
    if (same && !before->second.is_reported) changes.added.push_back(folder_ / name);
    file.is_reported = same;
  }
  for (const auto& [name, file] : files_) {
    if (!now.contains(name)) changes.removed.push_back(name);
  }
  files_ = std::move(now);
  return changes;
}

}  // namespace vlp
