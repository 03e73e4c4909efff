// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/retention.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
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

/// Returns true if a file is opened through a folder: by its name, or by a link on the way. Returns
/// true as well if a link cannot be followed, so that a folder in doubt is kept.
bool leads_through(const fs::path& file, const fs::path& folder) {
  constexpr int max_links = 40;  // as the system has it
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
  if (!is_server(config.records)) needed.emplace_back(config.records);
  if (config.hook) {  // its arguments may be files, such as the script of an interpreter
    for (const std::string& word : config.hook->command) {
      if (!word.empty()) needed.push_back(config.hook->folder / word);
    }
  }
  return std::any_of(needed.begin(), needed.end(), [&](const fs::path& file) {
    return !file.empty() && leads_through(file, folder);
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

SharedFolder open_existing(const SharedFolder& parent, const Id& name) {
  auto found = parent.find_folder(name);
  if (!found) throw InputError(parent.path() / name.text(), "cannot be deleted: it is not there");
  return std::move(*found);
}

/// Opens the folder that an expired one is in, from the folder that station.yaml names, so that no
/// link is followed.
SharedFolder open_parent(const ExpiredFolder& expired, const StationConfig& config) {
  if (expired.what == std::string_view(kImagesDeleted)) return SharedFolder(config.captures);
  return open_existing(SharedFolder(config.results),
                       {expired.run.camera, "the record of a run", "camera"});
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

void delete_expired(const ExpiredFolder& expired, const StationConfig& config, Spool& spool) {
  const SharedFolder parent = open_parent(expired, config);
  const Id name(expired.folder.filename().string(), expired.folder, "run");
  open_existing(parent, name).remove_content();
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
  parent.remove_folder(name);
}

}  // namespace vlp
