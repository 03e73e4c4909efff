// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "station/records/records.h"
#include "station/records/run_record.h"

namespace vlp {

/// Queue of a station's runs that are to be delivered to its records, which may be offline.
///
/// Each run waits as a complete file of the spool: RUN.json, or RUN.EVENT.json with later events
/// (`vlp-run/2`). It is delivered only to the records that it belongs to
/// (derive_database_identity()), so that stations with different records can share a folder.
///
/// No run is lost if a program is killed at any time. Files are written atomically and removed
/// after the run is committed. No run is stored twice, because records store a run once by its id.
/// Any number of programs may use a spool at the same time. Records that did not answer are not
/// contacted for a minute, so that a unit waits for them once.
class Spool {
 public:
  /// Opens a spool, without access to folder or records.
  /// @param folder   folder of the waiting runs; created when it is needed
  /// @param records  database of the runs: SQLite file or postgresql:// address
  /// @throws InputError if `records` is an invalid connection string
  Spool(std::filesystem::path folder, std::string records);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// Checks before the first image that runs can be stored. Throws InputError if the folder is not
  /// writable. Offline or read-only records are no error (describe_spool_state()). Throws for
  /// errors that do not disappear by themselves: tables of a later version, or a file that is no
  /// database. Only this function creates a missing database, because a file can also be missing if
  /// its share is not mounted.
  void check_runs_can_be_stored();
  /// Stores a run in the folder, as another file if it has a new event. If the folder cannot be
  /// written, the run goes directly into the records. Throws InputError if both fail.
  void store_run(const RunRecord& run);
  /// Delivers the waiting runs to the records, in chronological order. Starts no further run after
  /// ten seconds, so that a backlog delays no caller, and none when the records are offline. A run
  /// that the records reject does not block the others.
  void deliver_waiting_runs();
  /// Returns a message about the spool; empty if there is nothing to report. The message can
  /// contain
  /// - "kept here, 3 waiting: WHY", or the reason why the records are offline,
  /// - the number of runs for other records,
  /// - a file that cannot be read,
  /// - the number of digests that were not compared with the records.
  std::string describe_spool_state();
  /// Returns describe_spool_state() for the operator, in one line. The reason why the records are
  /// offline is replaced by "records are offline; 1 run kept, delivered automatically".
  std::string make_spool_notice_for_operator();
  /// Suspends access to the records for a minute because of `error`.
  void suspend_database_access(const InputError& error);
  const std::filesystem::path& spool_folder() const { return folder_; }
  /// Returns the reason why the records were offline at the last access; empty if they were online.
  const std::string& last_offline_reason() const { return offline_reason_; }

  /// Returns the runs that wait for these records, in chronological order. Skips files that are no
  /// runs.
  std::vector<RunRecord> list_waiting_runs();
  /// Returns a run that waits for any records, or that the records contain; otherwise std::nullopt,
  /// also if the records do not answer.
  std::optional<RunRecord> find_run_by_id(const std::string& run);
  /// Returns the waiting runs and, if online, the runs of the records that match the filter, as
  /// merge_stored_and_waiting_runs().
  std::vector<RunSummary> list_run_summaries(const RunFilter& filter);
  /// Returns the first run of another camera, not voided, that uses an image of this digest; empty
  /// if none does. Searches all runs of the spool and the records.
  ImageUser find_run_of_other_camera_using_image(const std::string& sha256,
                                                 const std::string& other_than_camera);
  /// Returns the first judged run of the same unit, not voided, that used all images of `run`
  /// (uses_images_of_earlier_run()). Searches the waiting runs and the records. Returns an empty
  /// string if there is none, and std::nullopt if the records do not answer and no waiting run
  /// matches.
  std::optional<std::string> find_run_with_same_images(const RunRecord& run);
  /// Returns the first judged run of a golden unit that uses an image of this digest; empty if none
  /// does. Searches all runs of the spool and the records.
  std::string find_golden_run_using_image(const std::string& sha256);

 private:
  std::vector<std::filesystem::path> list_spooled_files();
  void open_records();
  std::string try_database_action(const std::function<void(Records&)>& action);
  bool query_records(const std::function<void(Records&)>& query);
  bool may_access_database() const;
  std::vector<RunRecord> collect_spooled_runs(
      const std::function<bool(const SpooledRun&)>& is_selected);
  std::optional<RunSummary> find_run_that_used_image(
      const std::string& sha256, const std::function<bool(const RunSummary&)>& is_searched);
  /// Returns `first`, unless it is empty, and further remarks: runs for other records, unreadable
  /// files, images that were not compared with the records.
  std::string append_spool_remarks(const std::string& first) const;

  std::filesystem::path folder_;
  /// Connection string, and its derive_database_identity(), which the files of runs contain.
  std::string where_, name_;
  std::unique_ptr<Records> records_;
  /// Reason why the records are offline; why they did not accept a run; a file that
  /// collect_spooled_runs() could not read, or that contains no run.
  std::string offline_reason_, problem_, unread_;
  /// `offline_reason_` for the operator; empty if only `offline_reason_` contains the remedy.
  std::string offline_notice_;
  std::chrono::steady_clock::time_point next_access_;
  /// Runs that collect_spooled_runs() has found, for these and for other records.
  std::map<std::filesystem::path, SpooledRun> known_;
  std::size_t num_unchecked_ = 0;
};

/// Adds the waiting runs that match the filter to runs of the records
/// (Records::list_run_summaries()), and sorts all by their end. The causes of added runs contain a
/// note that they wait. A run of the records that also waits is updated: the waiting one has newer
/// events.
std::vector<RunSummary> merge_stored_and_waiting_runs(std::vector<RunSummary> stored,
                                                      const std::vector<RunRecord>& waiting,
                                                      const RunFilter& filter);

}  // namespace vlp
