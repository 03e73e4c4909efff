// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/spool.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "captures/id.h"
#include "captures/json_bounds.h"
#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/records/hook.h"
#include "station/records/json_number.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr const char* kRunFormat = "vlp-run/1";
constexpr const char* kRunEnding = ".json";
constexpr std::size_t kMaxRunFileBytes = 64 << 20;
/// Several times the size of a run of hundreds of images.
constexpr std::uintmax_t kRequiredSpace_bytes = 1'000'000;

std::optional<double> read_optional_number(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

std::optional<GuardBand> read_guard_band(const Json& metric) {
  if (!metric.contains("guard_k")) return std::nullopt;
  return GuardBand{metric.at("uncertainty").get<double>(), metric.at("guard_k").get<double>()};
}

SpooledRun parse_run(const Json& json) {
  if (json.at("format").get<std::string>() != kRunFormat)
    throw std::runtime_error("another format");
  SpooledRun spooled;
  json.at("records").get_to(spooled.records);
  RunRecord& run = spooled.run;
  for (const RunField& field : run_fields()) {
    run.*field.text = json.value(field.name, std::string());
  }
  if (run.run.empty() || run.verdict.empty()) throw std::runtime_error("no run, or no verdict");
  // Both name folders and files.
  for (const std::string& id : {run.run, run.camera}) {
    if (!Id::accepts(id)) throw std::runtime_error("its run or camera is no id");
  }
  for (const Json& metric : json.at("figures")) {
    run.metrics.push_back(
        {present_metric_name(metric.at("name").get<std::string>()),
         metric.at("unit").get<std::string>(), read_optional_number(metric.at("value")),
         read_optional_number(metric.at("gate")),
         metric.at("at_least").get<bool>() ? Direction::at_least : Direction::at_most,
         read_guard_band(metric)});
  }
  for (const Json& image : json.at("images")) {
    run.images.push_back({image.at("step").get<std::string>(), image.at("image").get<std::string>(),
                          image.at("sha256").get<std::string>(),
                          image.at("refused").get<std::string>()});
  }
  for (const Json& event : json.value("events", Json::array())) {
    run.events.push_back({event.at("event").get<std::string>(), event.at("what").get<std::string>(),
                          event.at("text").get<std::string>(), event.value("who", std::string())});
    if (!Id::accepts(run.events.back().event)) throw std::runtime_error("an event is no id");
  }
  return spooled;
}

/// Returns the file name of a run. It changes with each event: a program that delivers an earlier
/// version does not remove a later one.
std::string file_name(const RunRecord& run) {
  const std::string last = run.events.empty() ? "" : "." + run.events.back().event;
  return run.run + last + kRunEnding;
}

/// Adds a run, merging the events of its files.
void merge_run(std::vector<RunRecord>& runs, const RunRecord& run) {
  if (runs.empty() || runs.back().run != run.run) {
    runs.push_back(run);
    return;
  }
  std::vector<RunEvent>& events = runs.back().events;
  for (const RunEvent& event : run.events) {
    const auto at =
        std::lower_bound(events.begin(), events.end(), event,
                         [](const RunEvent& a, const RunEvent& b) { return a.event < b.event; });
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

bool uses_image(const RunRecord& run, const std::string& sha256) {
  return std::any_of(run.images.begin(), run.images.end(), [&](const RunRecord::Image& image) {
    return image.sha256 == sha256 && image.refused.empty();
  });
}

/// Returns the operator's message about offline records; empty if only the error contains the
/// remedy.
std::string make_notice(const InputError& error) {
  if (dynamic_cast<const RecordsRefused*>(&error) != nullptr) {
    return "records are offline (access refused)";
  }
  return dynamic_cast<const RecordsOffline*>(&error) != nullptr ? "records are offline" : "";
}

}  // namespace

std::string serialize_run(const SpooledRun& spooled) {
  const RunRecord run = printable_run(spooled.run);
  Json json;
  json["format"] = kRunFormat;
  json["records"] = printable_line(spooled.records);
  for (const RunField& field : run_fields()) json[field.name] = run.*field.text;
  json["figures"] = Json::array();
  for (const CheckedMetric& metric : run.metrics) {
    json["figures"].push_back({{"name", metric.name},
                               {"unit", metric.unit},
                               {"value", number_or_null(metric.value)},
                               {"gate", number_or_null(metric.limit)},
                               {"at_least", metric.direction == Direction::at_least}});
    if (!metric.guard) continue;
    json["figures"].back()["uncertainty"] = metric.guard->standard_uncertainty;
    json["figures"].back()["guard_k"] = metric.guard->k;
  }
  json["images"] = Json::array();
  for (const auto& [step, name, sha256, refused] : run.images) {
    json["images"].push_back(
        {{"step", step}, {"image", name}, {"sha256", sha256}, {"refused", refused}});
  }
  json["events"] = Json::array();
  for (const RunEvent& event : run.events) {
    json["events"].push_back(
        {{"event", event.event}, {"what", event.what}, {"text", event.text}, {"who", event.who}});
  }
  constexpr int indent = 1;
  return json.dump(indent) + "\n";
}

SpooledRun read_run(const fs::path& file) {
  const auto text =
      SharedFolder(file.parent_path()).read(file.filename().string(), kMaxRunFileBytes);
  if (!text) throw InputError(file, "cannot be opened: it was taken away");
  try {
    check_json_bounds(*text);
    return parse_run(Json::parse(*text));
  } catch (const std::exception& error) {
    throw InputError(file, std::string("is no run of a station: ") + error.what());
  }
}

Spool::Spool(fs::path folder, std::string records)
    : folder_(std::move(folder)),
      where_(std::move(records)),
      name_(printable_line(make_records_database_id(where_))) {}

Spool::~Spool() = default;

void Spool::open() {
  if (records_) return;
  std::error_code none;
  if (!is_server_address(where_) && !fs::exists(where_, none)) {
    throw RecordsOffline(where_, "there are no records");
  }
  records_ = std::make_unique<Records>(where_);
}

/// Runs an action on the records. Returns the reason if it failed; empty on success.
template <typename Action>
std::string Spool::try_on_records(const Action& action) {
  try {
    open();
    action(*records_);
    offline_reason_.clear();
    return "";
  } catch (const RecordsOffline& error) {
    suspend_access(error);
    return error.what();
  } catch (const InputError& error) {
    if (!records_) {
      suspend_access(error);
    } else {
      offline_reason_.clear();
    }
    return error.what();
  }
}

bool Spool::may_access_records() const { return Clock::now() >= next_access_; }

void Spool::suspend_access(const InputError& error) {
  constexpr std::chrono::minutes a_while(1);
  next_access_ = Clock::now() + a_while;
  offline_reason_ = error.what();
  offline_notice_ = make_notice(error);
}

void Spool::prepare() {
  make_folder(folder_);
  check_free_space(SharedFolder(folder_), kRequiredSpace_bytes);
  remove_stale_files(folder_);
  try {
    if (!records_) records_ = std::make_unique<Records>(where_);
  } catch (const RecordsOffline& error) {
    return suspend_access(error);
  }
  problem_ = try_on_records([](Records& records) { records.check_writable(); });
  if (problem_.empty()) deliver();
}

void Spool::keep(const RunRecord& run) {
  try {
    make_folder(folder_);
    const std::string name = file_name(run);
    known_.erase(folder_ / name);  // possibly a different run of the same name
    SharedFolder(folder_).replace(name, serialize_run({run, name_}));
  } catch (const InputError& error) {
    const std::string refused = try_on_records([&](Records& records) { records.keep(run); });
    if (refused.empty()) return;
    throw InputError(folder_,
                     fmt::format("neither here can a run be kept ({}) nor in the records ({})",
                                 error.what(), refused));
  }
}

void Spool::deliver() {
  constexpr std::chrono::seconds max_duration(10);
  const auto begun = Clock::now();
  if (!may_access_records()) return;
  problem_.clear();
  for (const fs::path& file : files()) {
    if (Clock::now() - begun > max_duration) {
      if (problem_.empty()) problem_ = "there are many, the rest goes with the next run";
      return;
    }
    std::error_code gone;
    SpooledRun spooled;
    try {
      spooled = read_run(file);
    } catch (const InputError&) {  // reported by state()
      continue;
    }
    if (spooled.records != name_) continue;
    const std::string refused =
        try_on_records([&](Records& records) { records.keep(spooled.run); });
    if (!offline_reason_.empty()) return;
    if (refused.empty()) {
      fs::remove(file, gone);
      if (gone) problem_ = file.string() + ": cannot be removed: " + gone.message();
    } else {
      problem_ = refused;
    }
  }
}

std::size_t Spool::count_waiting() const {
  std::set<std::string> runs;
  for (const auto& [file, spooled] : known_) {
    if (spooled.records == name_) runs.insert(spooled.run.run);
  }
  return runs.size();
}

std::string Spool::with_remarks(const std::string& first) const {
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
    remarks.push_back(
        fmt::format("{} here for other records, such as {}", other_runs.size(), other_records));
  }
  if (!unread_.empty()) remarks.push_back(unread_);
  if (num_unchecked_ > 0) {
    remarks.push_back(fmt::format("{} images were not looked up in the records", num_unchecked_));
  }
  return fmt::format("{}", fmt::join(remarks, "; "));
}

std::string Spool::state() {
  read();
  const std::string& why = offline_reason_.empty() ? problem_ : offline_reason_;
  const std::size_t waiting = count_waiting();
  if (waiting > 0) {
    return with_remarks(
        fmt::format("kept here, {} waiting{}{}", waiting, why.empty() ? "" : ": ", why));
  }
  return with_remarks(why.empty() ? "" : "runs are kept here: " + why);
}

std::string Spool::notice() {
  if (offline_reason_.empty() || offline_notice_.empty()) return state();
  read();
  const std::size_t waiting = count_waiting();
  const std::string runs = waiting == 0   ? "runs are"
                           : waiting == 1 ? "1 run"
                                          : fmt::format("{} runs", waiting);
  return with_remarks(fmt::format("{}; {} kept, delivered automatically", offline_notice_, runs));
}

std::vector<fs::path> Spool::files() {
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

void Spool::read() {
  const auto files = this->files();
  std::erase_if(known_, [&](const auto& known) {
    return !std::binary_search(files.begin(), files.end(), known.first);
  });
  unread_.clear();
  for (const fs::path& file : files) {
    if (known_.contains(file)) continue;
    try {
      known_.emplace(file, read_run(file));
    } catch (const InputError& error) {
      // Another program can have delivered it.
      std::error_code gone;
      if (fs::exists(file, gone)) unread_ = error.what();
    }
  }
}

std::vector<RunRecord> Spool::waiting() {
  read();
  std::vector<RunRecord> runs;
  for (const auto& [file, spooled] : known_) {
    if (spooled.records == name_) merge_run(runs, spooled.run);
  }
  return runs;
}

std::optional<RunRecord> Spool::find(const std::string& run) {
  read();
  std::vector<RunRecord> here;
  for (const auto& [file, spooled] : known_) {
    if (spooled.run.run == run) merge_run(here, spooled.run);
  }
  if (!here.empty()) return here.front();
  std::optional<RunRecord> found;
  if (may_access_records()) try_on_records([&](Records& records) { found = records.find(run); });
  return found;
}

std::vector<std::string> Spool::find_open_hooks(const std::string& station) {
  std::vector<std::string> kept;
  if (may_access_records())
    try_on_records([&](Records& records) { kept = records.find_open_hooks(station); });
  std::set<std::string> runs(kept.begin(), kept.end());
  for (const RunRecord& run : waiting()) {
    if (!station.empty() && run.station != station) continue;
    // Waiting runs are newer.
    if (is_hook_open(run)) {
      runs.insert(run.run);
    } else {
      runs.erase(run.run);
    }
  }
  return {runs.begin(), runs.end()};
}

ImageOwner Spool::find_owner(const std::string& sha256, const std::string& other_than_camera) {
  read();
  for (const auto& [file, spooled] : known_) {
    const RunRecord& run = spooled.run;
    if (run.camera != other_than_camera && uses_image(run, sha256) && voided(run) == nullptr) {
      return {run.camera, run.run};
    }
  }
  ImageOwner owner;
  const auto query_records = [&](Records& records) {
    owner = records.find_owner(sha256, other_than_camera);
  };
  if (!may_access_records() || !try_on_records(query_records).empty()) ++num_unchecked_;
  return owner;
}

std::optional<std::string> Spool::find_repeated_run(const RunRecord& run) {
  const auto first = std::find_if(run.images.begin(), run.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  if (first == run.images.end()) return "";
  std::set<std::string> voided_runs;  // possibly not yet voided in the records
  for (const RunRecord& earlier : waiting()) {
    if (voided(earlier) != nullptr) {
      voided_runs.insert(earlier.run);
    } else if (earlier.kind == "unit" && !earlier.invalid() && repeats_images(run, earlier)) {
      return earlier.run;
    }
  }
  std::string repeated;
  const auto query_records = [&](Records& records) {
    for (const std::string& name : records.find_judged_runs(first->sha256, run.camera)) {
      const auto earlier = records.find(name);
      if (!earlier || voided_runs.contains(name) || !repeats_images(run, *earlier)) continue;
      repeated = name;
      return;
    }
  };
  if (!may_access_records() || !try_on_records(query_records).empty()) return std::nullopt;
  return repeated;
}

std::string Spool::find_golden_run(const std::string& sha256) {
  read();
  for (const auto& [file, spooled] : known_) {
    const RunRecord& run = spooled.run;
    if (run.kind == "golden" && !run.invalid() && uses_image(run, sha256)) return run.run;
  }
  std::string run;
  const auto query_records = [&](Records& records) { run = records.find_golden_run(sha256); };
  if (!may_access_records() || !try_on_records(query_records).empty()) ++num_unchecked_;
  return run;
}

}  // namespace vlp
