// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "station/records/records.h"
#include "station/records/run_record.h"

namespace vlp {

/// Error if a command needs records that are offline. what() is for the operator, `details` has the
/// reason.
class RecordsUnavailable : public std::runtime_error {
 public:
  RecordsUnavailable(const std::string& notice, std::string why)
      : std::runtime_error(notice), details(std::move(why)) {}
  std::string details;
};

/// All runs that a station knows: those of its records, which may be offline, and those that wait
/// for them in its spool.
///
/// Runs wait in Records of their own, the SQLite file outbox.db of the spool. Each is delivered
/// only to the records that it belongs to (derive_identity()), so that stations with
/// different records can share a folder, which should be on a local disk.
///
/// No run is lost if a program is killed at any time. A run is removed from the outbox after the
/// records have committed it. No run is stored twice, because records store a run once by its id.
/// Any number of programs may use a spool at the same time. Records that did not answer are not
/// contacted for a minute, so that a unit waits for them once.
class Spool {
 public:
  /// Opens a spool, without access to folder or records.
  /// @param folder   folder of the outbox, created when it is needed; empty for records alone
  /// @param records  database of the runs: SQLite file or postgresql:// address
  /// @throws InputError if `records` is an invalid connection string
  Spool(std::filesystem::path folder, std::string records);

  /// Checks before the first image that runs can be stored. Throws InputError if the outbox is not
  /// writable. Offline or read-only records are no error (describe_state()). Throws for
  /// errors that do not disappear by themselves: tables of a later version, or a file that is no
  /// database. Only this function creates missing records, because a file can also be missing if
  /// its share is not mounted.
  void check_can_store();
  /// Stores a run, or its new events, in the outbox. If that is not possible, or without a folder,
  /// the run goes directly into the records. Throws InputError if both fail.
  void store_run(const RunRecord& run);
  /// Delivers the waiting runs to the records, in chronological order. Starts no further run after
  /// ten seconds, so that a backlog delays no caller, and none when the records are offline. A run
  /// that the records reject does not block the others.
  void deliver_waiting();
  /// Returns a message about the spool; empty if there is nothing to report. The message can
  /// contain
  /// - "runs are queued in the spool, 3 waiting: WHY", or the reason why the records are offline,
  /// - the number of runs for other records,
  /// - the reason why the outbox cannot be read,
  /// - the number of digests that were not compared with the records.
  std::string describe_state();
  /// Returns describe_state() for the operator, in one line. The reason why the records are
  /// offline is replaced by "records are offline; 1 run kept, delivered automatically".
  std::string make_operator_notice();
  const std::filesystem::path& spool_folder() const { return folder_; }
  /// Returns the reason why the records were offline at the last access; empty if they were online.
  const std::string& offline_reason() const { return offline_reason_; }
  /// Returns the records. Throws RecordsUnavailable if they are offline or do not exist.
  Records& records_or_throw();

  /// Returns the runs that wait for these records, in chronological order.
  std::vector<RunSummary> list_waiting_runs();
  /// Returns a run that waits for any records, or that the records contain; otherwise std::nullopt,
  /// also if the records do not answer.
  std::optional<RunRecord> find_run_by_id(const std::string& run);
  /// Returns a run as find_run_by_id(). Throws std::invalid_argument if no run has this id, and as
  /// records_or_throw().
  RunRecord require_run(const std::string& run);
  /// Returns the waiting runs and, if online, the runs of the records that match the filter, by
  /// their end. Of a run in both, the waiting one counts: it has newer events. The causes of
  /// waiting runs contain a note that they wait.
  std::vector<RunSummary> list_run_summaries(const RunFilter& filter);
  /// Returns the first run of another camera, not voided, that uses an image of this digest.
  /// Searches all runs of the outbox and the records.
  std::optional<ImageUser> find_other_user(const std::string& sha256,
                                           const std::string& other_than_camera);
  /// Result of search_same_images().
  struct SameImages {
    /// Id of the first such run; std::nullopt if none was found.
    std::optional<std::string> run = {};
    /// False if the records, or a run in them, could not be read.
    bool is_complete = true;
  };
  /// Searches the waiting runs and the records for a judged run of the same unit, not voided, that
  /// used all images of `run` (has_images_of()).
  SameImages search_same_images(const RunRecord& run);
  /// Returns the first judged run of a golden unit that uses an image of this digest. Searches all
  /// runs of the outbox and the records.
  std::optional<std::string> find_golden_user(const std::string& sha256);

 private:
  Records open_outbox() const;
  void query_outbox(const std::function<void(Records&)>& query);
  std::string try_action(const std::function<void(Records&)>& action);
  bool query_records(const std::function<void(Records&)>& query);
  bool may_access() const;
  void suspend(const std::string& reason, const std::string& notice);
  /// Returns the runs as list_run_summaries(), with waiting runs for `destination`, for all if it
  /// is empty. Returns false as second value if outbox or records did not answer.
  std::pair<std::vector<RunSummary>, bool> merge_runs(RunFilter filter,
                                                      const std::string& destination);
  std::optional<RunSummary> find_image_user(
      const std::string& sha256, const std::function<bool(const RunSummary&)>& is_searched);
  /// Returns `first`, unless it is empty, and further remarks: runs for other records, an
  /// unreadable outbox, images that were not compared with the records.
  std::string append_remarks(const std::string& first);

  std::filesystem::path folder_;
  /// Connection string, and its derive_identity(), the destination of waiting runs.
  std::string where_, name_;
  std::unique_ptr<Records> records_;
  /// Reason why the records are offline; why a run was not delivered; why the outbox could not be
  /// read or changed at the last access.
  std::string offline_reason_, problem_, unread_;
  /// `offline_reason_` for the operator; empty if only `offline_reason_` contains the remedy.
  std::string offline_notice_;
  std::chrono::steady_clock::time_point next_access_;
  std::size_t num_unchecked_ = 0;
};

}  // namespace vlp
