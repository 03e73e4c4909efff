// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/spool.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "captures/id.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/records/hook.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kRunEnding = ".json";
/// Several times the size of a run of hundreds of images.
constexpr std::uintmax_t kRequiredSpace_bytes = 1'000'000;

/// Returns the file name of a run. It changes with each event: a program that delivers an earlier
/// version does not remove a later one.
std::string file_name(const RunRecord& run) {
  const std::string last = run.events.empty() ? "" : "." + run.events.back().event;
  return run.run + last + kRunEnding;
}

/// Adds a run, merging the events of its files.
void merge_run_events(std::vector<RunRecord>& runs, const RunRecord& run) {
  if (runs.empty() || runs.back().run != run.run) {
    runs.push_back(run);
    return;
  }
  std::vector<RunEvent>& events = runs.back().events;
  for (const RunEvent& event : run.events) {
    const auto at = std::ranges::lower_bound(events, event.event, {}, &RunEvent::event);
    if (at == events.end() || at->event != event.event) events.insert(at, event);
  }
}

std::vector<fs::path> list_entries(const fs::path& folder, std::error_code& error) {
  std::vector<fs::path> entries;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    entries.push_back(entry->path());
  }
  return entries;
}

/// Removes temporary files older than a day, which are those of killed programs.
void remove_stale_files(const fs::path& folder) {
  constexpr std::chrono::hours a_day(24);
  std::error_code error;
  for (const fs::path& file : list_entries(folder, error)) {
    const std::string name = file.filename().string();
    if (!name.starts_with('.') || name.find(".json.tmp-") == std::string::npos) continue;
    const auto written = fs::last_write_time(file, error);
    if (!error && fs::file_time_type::clock::now() - written > a_day) fs::remove(file, error);
  }
}

bool matches_filter(const RunRecord& run, const RunFilter& filter) {
  const auto is = [](const std::string& text, const std::string& wanted) {
    return wanted.empty() || text == wanted;
  };
  const auto has_image = [&](const RunRecord::Image& image) {
    return image.sha256 == filter.image_sha256 && image.is_image_used();
  };
  return is(run.camera, filter.camera) && is(run.station, filter.station) &&
         is(run.verdict, filter.verdict) && is(run.kind, filter.kind) &&
         is(run.operator_name, filter.operator_name) && is(run.shift, filter.shift) &&
         run.ended_utc >= filter.since && (filter.until.empty() || run.ended_utc < filter.until) &&
         (filter.image_sha256.empty() || std::ranges::any_of(run.images, has_image)) &&
         (!filter.has_open_hook || is_hook_pending(run));
}

/// Returns the operator's message about offline records; empty if only the error contains the
/// remedy.
std::string make_offline_notice(const InputError& error) {
  if (dynamic_cast<const RecordsRefused*>(&error) != nullptr) {
    return "records are offline (access refused)";
  }
  return dynamic_cast<const RecordsOffline*>(&error) != nullptr ? "records are offline" : "";
}

}  // namespace

Spool::Spool(fs::path folder, std::string records)
    : folder_(std::move(folder)),
      where_(std::move(records)),
      name_(escape_text_for_single_line(derive_database_identity(where_))) {}

Spool::~Spool() = default;

void Spool::open_records() {
  if (records_) return;
  std::error_code none;
  if (!is_database_server_address(where_) && !fs::exists(where_, none)) {
    throw RecordsOffline(where_, "there are no records");
  }
  records_ = std::make_unique<Records>(where_);
}

/// Runs an action on the records. Returns the reason if it failed; empty on success.
std::string Spool::try_database_action(const std::function<void(Records&)>& action) {
  try {
    open_records();
    action(*records_);
    offline_reason_.clear();
    return "";
  } catch (const RecordsOffline& error) {
    suspend_database_access(error);
    return error.what();
  } catch (const InputError& error) {
    if (!records_) {
      suspend_database_access(error);
    } else {
      offline_reason_.clear();
    }
    return error.what();
  }
}

/// Returns false if the records did not answer, now or within the last minute.
bool Spool::query_records(const std::function<void(Records&)>& query) {
  return may_access_database() && try_database_action(query).empty();
}

bool Spool::may_access_database() const { return Clock::now() >= next_access_; }

void Spool::suspend_database_access(const InputError& error) {
  constexpr std::chrono::minutes a_while(1);
  next_access_ = Clock::now() + a_while;
  offline_reason_ = error.what();
  offline_notice_ = make_offline_notice(error);
}

void Spool::check_runs_can_be_stored() {
  create_station_folder(folder_);
  require_writable_folder_with_space(SharedFolder(folder_), kRequiredSpace_bytes);
  remove_stale_files(folder_);
  try {
    if (!records_) records_ = std::make_unique<Records>(where_);
  } catch (const RecordsOffline& error) {
    return suspend_database_access(error);
  }
  problem_ = try_database_action([](Records& records) { records.check_database_writable(); });
  if (problem_.empty()) deliver_waiting_runs();
}

void Spool::store_run(const RunRecord& run) {
  try {
    create_station_folder(folder_);
    const std::string name = file_name(run);
    known_.erase(folder_ / name);  // possibly a different run of the same name
    SharedFolder(folder_).replace_file_atomically(name, serialize_spooled_run({run, name_}));
  } catch (const InputError& error) {
    const std::string refused =
        try_database_action([&](Records& records) { records.store_run(run); });
    if (refused.empty()) return;
    throw InputError(
        folder_,
        fmt::format("a run can be stored neither in the spool ({}) nor in the records ({})",
                    error.what(), refused));
  }
}

void Spool::deliver_waiting_runs() {
  constexpr std::chrono::seconds max_duration(10);
  const auto begun = Clock::now();
  if (!may_access_database()) return;
  problem_.clear();
  for (const fs::path& file : list_spooled_files()) {
    if (Clock::now() - begun > max_duration) {
      if (problem_.empty()) problem_ = "there are many; the next run delivers the others";
      return;
    }
    std::error_code gone;
    SpooledRun spooled;
    try {
      spooled = read_spooled_run(file);
    } catch (const InputError&) {  // reported by describe_spool_state()
      continue;
    }
    if (spooled.records != name_) continue;
    const std::string refused =
        try_database_action([&](Records& records) { records.store_run(spooled.run); });
    if (!offline_reason_.empty()) return;
    if (refused.empty()) {
      fs::remove(file, gone);
      if (gone) problem_ = file.string() + ": cannot be removed: " + gone.message();
    } else {
      problem_ = refused;
    }
  }
}

std::string Spool::append_spool_remarks(const std::string& first) const {
  std::set<std::string> other_runs;
  std::string other_records;
  for (const auto& [file, spooled] : known_) {
    if (spooled.records == name_) continue;
    other_runs.insert(spooled.run.run);
    other_records = spooled.records;
  }
  std::vector<std::string> remarks;
  if (!first.empty()) remarks.push_back(first);
  if (!other_runs.empty()) {
    remarks.push_back(fmt::format("{} queued for another database, such as {}", other_runs.size(),
                                  other_records));
  }
  if (!unread_.empty()) remarks.push_back(unread_);
  if (num_unchecked_ > 0) {
    remarks.push_back(fmt::format("{} images were not looked up in the records", num_unchecked_));
  }
  return fmt::format("{}", fmt::join(remarks, "; "));
}

std::string Spool::describe_spool_state() {
  const std::size_t waiting = this->list_waiting_runs().size();
  const std::string& why = offline_reason_.empty() ? problem_ : offline_reason_;
  if (waiting > 0) {
    return append_spool_remarks(fmt::format("runs are queued in the spool, {} waiting{}{}", waiting,
                                            why.empty() ? "" : ": ", why));
  }
  return append_spool_remarks(why.empty() ? "" : "runs are queued in the spool: " + why);
}

std::string Spool::make_spool_notice_for_operator() {
  if (offline_reason_.empty() || offline_notice_.empty()) return describe_spool_state();
  const std::size_t waiting = this->list_waiting_runs().size();
  const std::string runs = waiting == 0   ? "runs are"
                           : waiting == 1 ? "1 run"
                                          : fmt::format("{} runs", waiting);
  return append_spool_remarks(
      fmt::format("{}; {} kept, delivered automatically", offline_notice_, runs));
}

std::vector<fs::path> Spool::list_spooled_files() {
  std::error_code error;
  std::vector<fs::path> files = list_entries(folder_, error);
  if (error && error != std::errc::no_such_file_or_directory) {
    problem_ = folder_.string() + ": cannot be read: " + error.message();
  }
  std::erase_if(files, [](const fs::path& file) {
    // Skips the temporary file of a run that is being written.
    return file.extension() != kRunEnding || file.filename().string().starts_with('.');
  });
  std::sort(files.begin(), files.end());
  return files;
}

/// Reads the new files of the spool, and returns the selected runs in chronological order.
std::vector<RunRecord> Spool::collect_spooled_runs(
    const std::function<bool(const SpooledRun&)>& is_selected) {
  const auto files = this->list_spooled_files();
  std::erase_if(known_, [&](const auto& known) {
    return !std::binary_search(files.begin(), files.end(), known.first);
  });
  unread_.clear();
  for (const fs::path& file : files) {
    if (known_.contains(file)) continue;
    try {
      known_.emplace(file, read_spooled_run(file));
    } catch (const InputError& error) {
      // Another program can have delivered it.
      std::error_code gone;
      if (fs::exists(file, gone)) unread_ = error.what();
    }
  }
  std::vector<RunRecord> runs;
  for (const auto& [file, spooled] : known_) {
    if (is_selected(spooled)) merge_run_events(runs, spooled.run);
  }
  return runs;
}

std::vector<RunRecord> Spool::list_waiting_runs() {
  return collect_spooled_runs([&](const SpooledRun& spooled) { return spooled.records == name_; });
}

std::optional<RunRecord> Spool::find_run_by_id(const std::string& run) {
  const auto here =
      collect_spooled_runs([&](const SpooledRun& spooled) { return spooled.run.run == run; });
  if (!here.empty()) return here.front();
  std::optional<RunRecord> found;
  query_records([&](Records& records) { found = records.find_run_by_id(run); });
  return found;
}

std::vector<RunSummary> Spool::list_run_summaries(const RunFilter& filter) {
  // The spool first: a run that is delivered meanwhile is then found in both.
  const std::vector<RunRecord> waiting = list_waiting_runs();
  std::vector<RunSummary> stored;
  query_records([&](Records& records) { stored = records.list_run_summaries(filter); });
  return merge_stored_and_waiting_runs(std::move(stored), waiting, filter);
}

/// Returns the first run that uses an image of this digest, of all runs of the spool and the
/// records. Counts images that were not compared with the records.
std::optional<RunSummary> Spool::find_run_that_used_image(
    const std::string& sha256, const std::function<bool(const RunSummary&)>& is_searched) {
  const RunFilter filter{.image_sha256 = sha256};
  const auto spooled = collect_spooled_runs([&](const SpooledRun& each) {
    return std::ranges::find(each.run.images, sha256, &RunRecord::Image::sha256) !=
           each.run.images.end();
  });
  std::vector<RunSummary> stored;
  const bool has_answer =
      query_records([&](Records& records) { stored = records.list_run_summaries(filter); });
  for (RunSummary& run : merge_stored_and_waiting_runs(std::move(stored), spooled, filter)) {
    if (is_searched(run)) return std::move(run);
  }
  if (!has_answer) ++num_unchecked_;
  return std::nullopt;
}

ImageUser Spool::find_run_of_other_camera_using_image(const std::string& sha256,
                                                      const std::string& other_than_camera) {
  const auto run = find_run_that_used_image(sha256, [&](const RunSummary& user) {
    return user.camera != other_than_camera && user.voided.empty();
  });
  return run ? ImageUser{run->camera, run->run} : ImageUser{};
}

std::string Spool::find_golden_run_using_image(const std::string& sha256) {
  const auto run = find_run_that_used_image(sha256, [](const RunSummary& user) {
    return user.kind == "golden" && user.verdict != verdict_name(Verdict::invalid);
  });
  return run ? run->run : "";
}

std::optional<std::string> Spool::find_run_with_same_images(const RunRecord& run) {
  const auto first = std::ranges::find_if(run.images, &RunRecord::Image::is_image_used);
  if (first == run.images.end()) return "";
  const RunFilter filter{.camera = run.camera, .kind = "unit", .image_sha256 = first->sha256};
  const std::vector<RunRecord> waiting = list_waiting_runs();
  std::vector<RunSummary> stored;
  bool has_answer =
      query_records([&](Records& records) { stored = records.list_run_summaries(filter); });
  for (const RunSummary& earlier :
       merge_stored_and_waiting_runs(std::move(stored), waiting, filter)) {
    if (earlier.verdict == verdict_name(Verdict::invalid) || !earlier.voided.empty()) continue;
    const auto record = find_run_by_id(earlier.run);
    if (record && uses_images_of_earlier_run(run, *record)) return earlier.run;
    has_answer = has_answer && record;
  }
  return has_answer ? std::optional<std::string>("") : std::nullopt;
}

std::vector<RunSummary> merge_stored_and_waiting_runs(std::vector<RunSummary> stored,
                                                      const std::vector<RunRecord>& waiting,
                                                      const RunFilter& filter) {
  std::vector<RunSummary> runs = std::move(stored);
  for (const RunRecord& run : waiting) {
    const RunEvent* event = find_voiding_event(run);
    const bool matches = matches_filter(run, filter);
    const auto known = std::ranges::find(runs, run.run, &RunSummary::run);
    if (known == runs.end()) {
      if (!matches) continue;
      runs.push_back({run.run, run.kind, run.station, run.camera, run.ended_utc, run.verdict,
                      "(waits here) " + run.causes, event == nullptr ? "" : event->text});
    } else if (!matches) {
      runs.erase(known);
    } else if (event != nullptr) {
      known->voided = event->text;
    }
  }
  std::ranges::stable_sort(runs, {},
                           [](const RunSummary& run) { return std::tie(run.ended_utc, run.run); });
  return keep_last_rows(std::move(runs), filter.last);
}

}  // namespace vlp
