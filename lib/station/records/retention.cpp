// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/retention.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "captures/id.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/database_name.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRunLength = 33;  // of new_run()

bool is_older(const std::string& utc, int days) {
  constexpr double seconds_per_day = 86'400;
  return seconds_since(utc) > days * seconds_per_day;  // not for what is no time
}

std::vector<fs::path> folders_in(const fs::path& folder) {
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

std::uintmax_t bytes_in(const fs::path& folder) {
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

/// Returns true if a file or folder is the folder, or anywhere in it.
bool is_within(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const fs::path from_folder = fs::relative(file, folder, error);  // with all links followed
  return !error && !from_folder.empty() && *from_folder.begin() != "..";
}

/// Returns true if the station needs something in a folder: a file that it reads, its records, its
/// hook or a folder that it writes.
bool is_in_use(const fs::path& folder, const StationConfig& config) {
  std::vector<fs::path> needed = config.inputs;
  needed.insert(needed.end(), {config.spool, config.captures, config.results});
  if (!is_server(config.records)) needed.emplace_back(config.records);
  if (config.hook) needed.emplace_back(config.hook->command.front());
  return std::any_of(needed.begin(), needed.end(), [&](const fs::path& file) {
    return !file.empty() && is_within(file, folder);
  });
}

/// A folder that is named by this camera and run.
void add_if_expired(Retained& found, Records& records, const StationConfig& config,
                    const fs::path& folder, const std::string& camera, const std::string& run,
                    const char* what, int days) {
  if (run.size() != kRunLength || !is_older(begun_utc(run), days)) return;
  auto record = records.find(run);
  if (!record || record->camera != camera) {
    found.without_record.push_back(folder);
  } else if (record->station == config.station && is_older(record->ended_utc, days)) {
    if (is_in_use(folder, config)) {
      found.in_use.push_back(folder);
      return;
    }
    found.expired.push_back({folder, what, days, bytes_in(folder), std::move(*record)});
  }
}

/// Opens an expired folder from the one that it is in, so that no link is followed.
SharedFolder open_expired(const fs::path& folder) {
  auto found =
      SharedFolder(folder.parent_path()).find_folder({folder.filename().string(), folder, "run"});
  if (!found) throw InputError(folder, "cannot be deleted: it is not there");
  return std::move(*found);
}

void delete_folder(const ExpiredFolder& expired) {
  std::error_code error;
  fs::remove(expired.folder, error);
  if (error) throw InputError(expired.folder, "cannot be deleted: " + error.message());
}

}  // namespace

Retained look_for_expired(const StationConfig& config, Records& records) {
  Retained found;
  if (const auto& days = config.keep.images_days) {
    for (const fs::path& folder : folders_in(config.captures)) {
      const std::string name = folder.filename().string();
      if (name.size() < kRunLength + 2) continue;
      const std::size_t dot = name.size() - kRunLength - 1;
      if (name[dot] != '.') continue;
      add_if_expired(found, records, config, folder, name.substr(0, dot), name.substr(dot + 1),
                     kImagesDeleted, *days);
    }
  }
  if (const auto& days = config.keep.results_days) {
    for (const fs::path& camera : folders_in(config.results)) {
      for (const fs::path& folder : folders_in(camera)) {
        add_if_expired(found, records, config, folder, camera.filename().string(),
                       folder.filename().string(), kResultsDeleted, *days);
      }
    }
  }
  return found;
}

void check_clock(const StationConfig& config, Records& records) {
  constexpr double max_idle_s = 366 * 86'400.0;  // longer than a plant is shut
  std::string newest;
  RunFilter own;
  own.station = config.station;
  for (const RunSummary& run : records.list(own)) {
    newest = std::max(newest, run.ended_utc);
  }
  if (newest.empty() || !(seconds_since(newest) > max_idle_s)) return;
  // Runs of archives are old when they are taken into records: what was written shows use, too.
  std::vector<fs::path> written{config.captures, config.results, config.spool, config.file};
  if (!is_server(config.records)) written.emplace_back(config.records);
  const auto now = fs::file_time_type::clock::now();
  const bool is_used = std::any_of(written.begin(), written.end(), [&](const fs::path& file) {
    std::error_code missing;
    const auto time = fs::last_write_time(file, missing);
    return !missing && std::chrono::duration<double>(now - time).count() < max_idle_s;
  });
  if (is_used) return;
  throw InputError(
      config.file,
      fmt::format("the newest run ended {}, more than a year before the clock, {}: set "
                  "the clock, or, if it is right, measure a unit first",
                  newest, now_utc()));
}

void delete_expired(const ExpiredFolder& expired, Spool& spool) {
  open_expired(expired.folder).remove_content();
  const auto& events = expired.run.events;
  const bool told = std::any_of(events.begin(), events.end(),
                                [&](const RunEvent& event) { return event.what == expired.what; });
  if (!told) {
    constexpr double megabyte = 1e6;
    RunRecord run = expired.run;
    run.events.push_back(new_event(
        expired.what,
        fmt::format("kept {} days, {:.1f} MB", expired.days, double(expired.bytes) / megabyte)));
    spool.keep(run);
  }
  delete_folder(expired);
}

}  // namespace vlp
