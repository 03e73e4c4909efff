// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/spool.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "captures/printable.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/database_name.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kOutboxName = "outbox.db";
/// Several times the size of a run of hundreds of images.
constexpr std::uintmax_t kRequiredSpace_bytes = 1'000'000;

/// Returns the operator's message about offline records; empty if only the error contains the
/// remedy.
std::string make_offline_note(const InputError& error) {
  if (dynamic_cast<const RecordsRefused*>(&error) != nullptr) {
    return "records are offline (access refused)";
  }
  return dynamic_cast<const RecordsOffline*>(&error) != nullptr ? "records are offline" : "";
}

}  // namespace

Spool::Spool(fs::path folder, std::string records)
    : folder_(std::move(folder)),
      where_(std::move(records)),
      name_(escape_for_line(derive_identity(where_))) {}

/// Opens the outbox anew for each access, because the folder can be replaced meanwhile.
Records Spool::open_outbox() const {
  create_station_folder(folder_);
  const fs::path file = folder_ / kOutboxName;
  std::error_code none;
  const fs::file_status status = fs::symlink_status(file, none);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw InputError(file, "is no regular file; remove it");
  }
  return Records(file.string());
}

/// Accesses the outbox if it exists. `unread_` is the reason if that failed.
void Spool::query_outbox(const std::function<void(Records&)>& query) {
  unread_.clear();
  std::error_code none;
  if (folder_.empty() ||
      fs::symlink_status(folder_ / kOutboxName, none).type() == fs::file_type::not_found) {
    return;
  }
  try {
    Records outbox = open_outbox();
    query(outbox);
  } catch (const InputError& error) {
    unread_ = error.what();
  }
}

/// Runs an action on the records. Returns the reason if it failed; empty on success.
std::string Spool::try_action(const std::function<void(Records&)>& action) {
  try {
    std::error_code none;
    if (!records_ && !is_server_address(where_) && !fs::exists(where_, none)) {
      throw RecordsOffline(where_, "there are no records");
    }
    if (!records_) records_ = std::make_unique<Records>(where_);
    action(*records_);
    offline_reason_.clear();
    next_access_ = {};
    return "";
  } catch (const InputError& error) {
    const bool is_offline = dynamic_cast<const RecordsOffline*>(&error) != nullptr;
    offline_reason_.clear();
    if (is_offline || !records_) suspend(error.what(), make_offline_note(error));
    return error.what();
  }
}

/// Returns false if the records did not answer, now or within the last minute.
bool Spool::query_records(const std::function<void(Records&)>& query) {
  if (!may_access()) return false;
  const std::string problem = try_action(query);
  if (!problem.empty() && offline_reason_.empty()) suspend(problem, "");
  return problem.empty();
}

bool Spool::may_access() const { return Clock::now() >= next_access_; }

void Spool::suspend(const std::string& reason, const std::string& notice) {
  constexpr std::chrono::minutes a_while(1);
  next_access_ = Clock::now() + a_while;
  offline_reason_ = reason;
  offline_notice_ = notice;
}

Records& Spool::records_or_throw() {
  if (query_records([](Records&) {})) return *records_;
  throw RecordsUnavailable(folder_.empty() ? offline_reason_ : make_operator_notice(),
                           offline_reason_);
}

void Spool::check_can_store() {
  create_station_folder(folder_);
  require_space(SharedFolder(folder_), kRequiredSpace_bytes);
  open_outbox().check_writable();
  try {
    if (!records_) records_ = std::make_unique<Records>(where_);
  } catch (const RecordsOffline& error) {
    return suspend(error.what(), make_offline_note(error));
  }
  problem_ = try_action([](Records& records) { records.check_writable(); });
  if (problem_.empty()) deliver_waiting();
}

void Spool::store_run(const RunRecord& run) {
  if (folder_.empty()) return records_or_throw().store_run(run);
  try {
    open_outbox().store_run(run, name_);
  } catch (const InputError& error) {
    const std::string refused = try_action([&](Records& records) { records.store_run(run); });
    if (refused.empty()) return;
    throw InputError(
        folder_,
        fmt::format("a run can be stored neither in the spool ({}) nor in the records ({})",
                    error.what(), refused));
  }
}

void Spool::deliver_waiting() {
  constexpr std::chrono::seconds max_duration(10);
  const auto begun = Clock::now();
  if (!may_access()) return;
  problem_.clear();
  for (const RunSummary& waiting : list_waiting_runs()) {
    if (Clock::now() - begun > max_duration) {
      if (problem_.empty()) problem_ = "there are many; the next run delivers the others";
      return;
    }
    std::optional<RunRecord> run;
    query_outbox([&](Records& outbox) { run = outbox.find_run_by_id(waiting.run); });
    if (run) {
      const std::string refused = try_action([&](Records& records) { records.store_run(*run); });
      if (!offline_reason_.empty()) return;
      if (!refused.empty()) problem_ = refused;
      if (!refused.empty()) continue;
      query_outbox([&](Records& outbox) { outbox.remove_delivered(*run); });
    }
    if (!unread_.empty()) problem_ = unread_;
  }
}

std::string Spool::append_remarks(const std::string& first) {
  std::vector<RunSummary> others;
  query_outbox([&](Records& outbox) { others = outbox.list_run_summaries({}); });
  std::erase_if(others, [&](const RunSummary& run) { return run.destination == name_; });
  std::vector<std::string> remarks;
  if (!first.empty()) remarks.push_back(first);
  if (!others.empty()) {
    remarks.push_back(fmt::format("{} queued for another database, such as {}", others.size(),
                                  others.back().destination));
  }
  if (!unread_.empty()) remarks.push_back(unread_);
  if (num_unchecked_ > 0) {
    remarks.push_back(fmt::format("{} images were not looked up in the records", num_unchecked_));
  }
  return fmt::format("{}", fmt::join(remarks, "; "));
}

std::string Spool::describe_state() {
  const std::size_t waiting = list_waiting_runs().size();
  const std::string& why = offline_reason_.empty() ? problem_ : offline_reason_;
  if (waiting > 0) {
    return append_remarks(fmt::format("runs are queued in the spool, {} waiting{}{}", waiting,
                                      why.empty() ? "" : ": ", why));
  }
  return append_remarks(why.empty() ? "" : "runs are queued in the spool: " + why);
}

std::string Spool::make_operator_notice() {
  if (offline_reason_.empty() || offline_notice_.empty()) return describe_state();
  const std::size_t waiting = list_waiting_runs().size();
  const std::string runs = waiting == 0   ? "runs are"
                           : waiting == 1 ? "1 run"
                                          : fmt::format("{} runs", waiting);
  return append_remarks(fmt::format("{}; {} kept, delivered automatically", offline_notice_, runs));
}

std::vector<RunSummary> Spool::list_waiting_runs() {
  std::vector<RunSummary> runs;
  query_outbox([&](Records& outbox) { runs = outbox.list_run_summaries({.destination = name_}); });
  return runs;
}

std::optional<RunRecord> Spool::find_run_by_id(const std::string& run) {
  std::optional<RunRecord> found;
  query_outbox([&](Records& outbox) { found = outbox.find_run_by_id(run); });
  if (!found) query_records([&](Records& records) { found = records.find_run_by_id(run); });
  return found;
}

RunRecord Spool::require_run(const std::string& run) {
  std::optional<RunRecord> found;
  query_outbox([&](Records& outbox) { found = outbox.find_run_by_id(run); });
  if (!found) found = records_or_throw().find_run_by_id(run);
  if (!found) throw std::invalid_argument("there is no run " + run);
  return *found;
}

std::pair<std::vector<RunSummary>, bool> Spool::merge_runs(RunFilter filter,
                                                           const std::string& destination) {
  const int last = std::exchange(filter.last, 0);
  std::vector<RunSummary> runs, stored;
  std::set<std::string> waiting_ids;
  // The outbox first: a run that is delivered meanwhile is then found in both.
  query_outbox([&](Records& outbox) {
    for (const RunSummary& run : outbox.list_run_summaries({.destination = destination})) {
      waiting_ids.insert(run.run);
    }
    RunFilter of_waiting = filter;
    of_waiting.destination = destination;
    runs = outbox.list_run_summaries(of_waiting);
  });
  for (RunSummary& run : runs) run.causes.insert(0, "(waits here) ");
  bool has_answer = unread_.empty();
  has_answer &=
      query_records([&](Records& records) { stored = records.list_run_summaries(filter); });
  for (RunSummary& run : stored) {
    if (!waiting_ids.contains(run.run)) runs.push_back(std::move(run));
  }
  std::ranges::stable_sort(runs, {},
                           [](const RunSummary& run) { return std::tie(run.ended_utc, run.run); });
  return {keep_last_rows(std::move(runs), last), has_answer};
}

std::vector<RunSummary> Spool::list_run_summaries(const RunFilter& filter) {
  return merge_runs(filter, name_).first;
}

/// Returns the first run that uses an image of this digest, of all runs of the outbox and the
/// records. Counts images that were not compared with the records.
std::optional<RunSummary> Spool::find_image_user(
    const std::string& sha256, const std::function<bool(const RunSummary&)>& is_searched) {
  const auto [runs, has_answer] = merge_runs({.image_sha256 = sha256}, "");
  const auto run = std::ranges::find_if(runs, is_searched);
  if (run != runs.end()) return *run;
  if (!has_answer) ++num_unchecked_;
  return std::nullopt;
}

std::optional<ImageUser> Spool::find_other_user(const std::string& sha256,
                                                const std::string& other_than_camera) {
  const auto run = find_image_user(sha256, [&](const RunSummary& user) {
    return user.camera != other_than_camera && user.voided.empty();
  });
  return run ? std::optional(ImageUser{run->camera, run->run}) : std::nullopt;
}

std::optional<std::string> Spool::find_golden_user(const std::string& sha256) {
  const auto run = find_image_user(sha256, [](const RunSummary& user) {
    return user.kind == "golden" && user.verdict != verdict_name(Verdict::invalid);
  });
  return run ? std::optional(run->run) : std::nullopt;
}

Spool::SameImages Spool::search_same_images(const RunRecord& run) {
  const auto first = std::ranges::find_if(run.images, &RunRecord::Image::is_image_used);
  if (first == run.images.end()) return {};
  auto [earlier_runs, has_answer] =
      merge_runs({.camera = run.camera, .kind = "unit", .image_sha256 = first->sha256}, name_);
  for (const RunSummary& earlier : earlier_runs) {
    if (earlier.verdict == verdict_name(Verdict::invalid) || !earlier.voided.empty()) continue;
    const auto record = find_run_by_id(earlier.run);
    if (record && has_images_of(run, *record)) return {earlier.run, has_answer};
    has_answer = has_answer && record;
  }
  return {std::nullopt, has_answer};
}

}  // namespace vlp
