// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/retention.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "captures/id.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/database_name.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

bool is_older(const std::string& utc, int days) {
  constexpr double seconds_per_day = 86'400;
  return compute_utc_age_s(utc) > days * seconds_per_day;  // false for an invalid time
}

std::vector<fs::path> list_folders_in(const fs::path& folder) {
  std::vector<fs::path> folders;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    std::error_code gone;
    if (!entry->is_symlink(gone) && entry->is_directory(gone)) folders.push_back(entry->path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

std::uintmax_t count_bytes_in_folder(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code gone;
    if (entry->is_symlink(gone) || !entry->is_regular_file(gone)) continue;
    const auto size = entry->file_size(gone);
    if (!gone) bytes += size;
  }
  return bytes;
}

/// Returns true if a file is opened through a folder: by its name, or by a link on the way. Returns
/// true as well if a link cannot be followed, so that a folder in doubt is kept.
bool is_path_through(const fs::path& file, const fs::path& folder) {
  constexpr int max_links = 40;  // as in the kernel
  std::error_code error;
  const fs::path absolute = fs::absolute(file, error);
  if (error) return true;
  std::deque<fs::path> parts(absolute.begin(), absolute.end());
  fs::path place;
  for (int links = 0; !parts.empty();) {
    const fs::path part = std::move(parts.front());
    parts.pop_front();
    if (part.empty() || part == ".") continue;
    const fs::path next = part == ".." ? place.parent_path() : place / part;
    const fs::file_status status = fs::symlink_status(next, error);
    if (status.type() == fs::file_type::not_found || error == std::errc::filename_too_long) {
      return false;
    }
    if (error) return true;
    if (status.type() != fs::file_type::symlink) {
      place = next;
      if (fs::is_directory(status) && fs::equivalent(place, folder, error)) return true;
      if (error) return true;
      continue;
    }
    const fs::path target = fs::read_symlink(next, error);
    if (error || ++links > max_links) return true;
    if (target.is_absolute()) place.clear();
    parts.insert(parts.begin(), target.begin(), target.end());
  }
  return false;
}

/// Returns true if the station needs something in a folder: a file that it reads, its records, its
/// hook or a folder that it writes.
bool is_in_use(const fs::path& folder, const StationConfig& config) {
  std::vector<fs::path> needed = config.inputs;
  needed.insert(needed.end(), {config.spool, config.captures, config.results});
  if (!is_server_address(config.records)) needed.emplace_back(config.records);
  if (config.hook) {  // its arguments can be files, such as the script of an interpreter
    for (const std::string& word : config.hook->command) {
      if (!word.empty()) needed.push_back(config.hook->folder / word);
    }
  }
  return std::any_of(needed.begin(), needed.end(), [&](const fs::path& file) {
    return !file.empty() && is_path_through(file, folder);
  });
}

/// Makes an entry for a folder that is named by this camera and run.
void add_if_expired(RetentionResult& found, Records& records, const StationConfig& config,
                    const fs::path& folder, const std::string& camera, const std::string& run,
                    const char* what, int days) {
  if (!is_run_id(run) || !is_older(start_utc_of_run_id(run), days)) return;
  auto record = records.find_run_by_id(run);
  if (!record || record->camera != camera) {
    found.folders_without_record.push_back(folder);
  } else if (record->station == config.station && is_older(record->ended_utc, days)) {
    if (is_in_use(folder, config)) {
      found.folders_in_use.push_back(folder);
      return;
    }
    found.expired.push_back(
        {folder, what, days, count_bytes_in_folder(folder), std::move(*record)});
  }
}

SharedFolder open_existing(const SharedFolder& parent, const Id& name) {
  auto found = parent.open_if_exists(name);
  if (!found)
    throw InputError(parent.folder_path() / name.id_text(), "cannot be deleted: it is not there");
  return std::move(*found);
}

/// Opens the folder that contains an expired one, starting at the folder named in station.yaml,
/// without following links.
SharedFolder open_parent(const ExpiredFolder& expired, const StationConfig& config) {
  if (expired.event_kind == std::string_view(kImagesDeleted)) return SharedFolder(config.captures);
  return open_existing(SharedFolder(config.results),
                       {expired.run.camera, "the record of a run", "camera"});
}

}  // namespace

RetentionResult list_expired_folders(const StationConfig& config, Records& records) {
  RetentionResult found;
  if (const auto& days = config.retention.images_days) {
    for (const fs::path& folder : list_folders_in(config.captures)) {
      const std::string name = folder.filename().string();
      const auto dot = name.rfind('.');
      if (dot == std::string::npos) continue;
      add_if_expired(found, records, config, folder, name.substr(0, dot), name.substr(dot + 1),
                     kImagesDeleted, *days);
    }
  }
  if (const auto& days = config.retention.results_days) {
    for (const fs::path& camera : list_folders_in(config.results)) {
      for (const fs::path& folder : list_folders_in(camera)) {
        add_if_expired(found, records, config, folder, camera.filename().string(),
                       folder.filename().string(), kResultsDeleted, *days);
      }
    }
  }
  return found;
}

void check_clock(const StationConfig& config, Records& records) {
  constexpr double day_s = 86'400;
  constexpr double max_idle_s = 366 * day_s;  // longer than a plant is shut
  constexpr double max_ahead_s = day_s;       // between computers that share records
  constexpr int trusted_days = 7;             // within them a wrong clock is noticed
  std::vector<std::string> ended;
  for (const RunSummary& run : records.list_run_summaries({.station = config.station})) {
    const bool is_time = !std::isnan(compute_utc_age_s(run.ended_utc));
    if (run.voided.empty() && is_time) ended.push_back(run.ended_utc);
  }
  std::sort(ended.begin(), ended.end());
  if (ended.empty()) return;
  const std::string& newest = ended.back();
  if (compute_utc_age_s(newest) < -max_ahead_s) {
    throw InputError(config.file,
                     fmt::format("the newest run ended {}, after the clock, {}: set the clock, or, "
                                 "if it is right, void the runs with wrong dates",
                                 newest, get_current_utc()));
  }
  if (compute_utc_age_s(newest) > max_idle_s) {
    throw InputError(
        config.file,
        fmt::format("the newest run ended {}, more than a year before the clock, {}: set "
                    "the clock, or, if it is right, measure a unit first",
                    newest, get_current_utc()));
  }
  for (std::size_t i = ended.size() - 1; i > 0; --i) {
    const double age_s = compute_utc_age_s(ended[i]);
    if (age_s > trusted_days * day_s) return;
    if (compute_utc_age_s(ended[i - 1]) - age_s < max_idle_s) continue;
    throw InputError(config.file,
                     fmt::format("the runs since {} ended more than a year after those before: set "
                                 "the clock and void them, or, if it is right, clean again when "
                                 "they are {} days old",
                                 ended[i], trusted_days));
  }
}

void delete_expired(const ExpiredFolder& expired, const StationConfig& config, Spool& spool) {
  const SharedFolder parent = open_parent(expired, config);
  const Id name(expired.folder.filename().string(), expired.folder, "run");
  open_existing(parent, name).remove_all();
  if (get_last_event_index(expired.run, expired.event_kind) < 0) {
    constexpr double megabyte = 1e6;
    RunRecord run = expired.run;
    run.events.push_back(make_run_event_now(
        expired.event_kind,
        fmt::format("kept {} days, {:.1f} MB", expired.days, double(expired.bytes) / megabyte)));
    spool.store_run(run);
  }
  parent.remove_subfolder(name);
}

}  // namespace vlp
