// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "station/records/records.h"

namespace vlp {

/// A run and the records that it is for, as identity_of_database() has them.
struct SpooledRun {
  RunRecord run;
  std::string records;
};

/// A station's runs on their way to its records, which need not be there: each waits, whole, as a
/// file of the spool, RUN.json, or RUN.EVENT.json with what became of it (`vlp-run/1`), until the
/// records have it that it is for; it goes into no others (identity_of_database), so that stations
/// with other records may share a folder. Nothing is lost, whatever is killed and when: a file
/// appears as a whole and goes when the run is committed. Nothing is twice: records keep a run by
/// its name, once. Any number of programs may use a spool at once. Records that did not answer are
/// left alone for a minute, so that a unit waits for them once.
class Spool {
 public:
  /// The folder is made when it is needed. `records` is as Records takes it; nothing is reached for
  /// yet. Throws InputError when it is no connection string.
  Spool(std::filesystem::path folder, std::string records);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// Before the first image: throws InputError when no run could be kept in the folder. Records
  /// that are away or cannot be written are no error, see state(); those that another try does not
  /// open, of a later version or no database, are. This alone makes a database that is not there:
  /// elsewhere it may be on a share that is not mounted.
  void prepare();
  /// Keeps a run in the folder, again when it has another event; where that cannot be written, in
  /// the records. Throws InputError when neither can be.
  void keep(const RunRecord& run);
  /// Brings what waits to the records, from the first to the last. It begins no other run after ten
  /// seconds, so that a backlog keeps nobody waiting, nor after records that are away. A run that
  /// the records refuse holds up no other.
  void deliver();
  /// "kept here, 3 waiting: WHY", or why the records are away; how many are here for other records;
  /// a file that cannot be read; how many digests were looked for here only. Empty when
  /// there is nothing to tell.
  std::string state();
  /// Returns state() for the operator, in one line: "records are offline; 1 run kept, delivered
  /// automatically" in place of why they are away.
  std::string notice();
  /// Leaves the records alone for a minute, because of `error`.
  void put_off(const InputError& error);
  const std::filesystem::path& folder() const { return folder_; }
  /// Why the records are away, since they were asked last; empty when they are not.
  const std::string& away() const { return away_; }

  /// Those that wait for these records, from the first to the last; without files that are no runs.
  std::vector<RunRecord> waiting();
  /// A run that waits, for whichever records, or that the records have; nothing, too, when these do
  /// not answer, see away().
  std::optional<RunRecord> find(const std::string& run);
  /// Records::with_open_hook() of those that wait and, when they answer, the records.
  std::vector<std::string> with_open_hook(const std::string& station);
  /// Records::owner_of() of those that wait and, when they answer, the records.
  ImageOwner owner_of(const std::string& sha256, const std::string& other_than_camera);
  /// Returns the first judged run of the same unit, not voided, that used all images of `run`
  /// (repeats_images()), of those that wait and of the records; an empty string if there is none.
  /// Returns std::nullopt if the records do not answer and none that waits is one.
  std::optional<std::string> repeated_run_of(const RunRecord& run);
  /// Records::golden_run_of() of those that wait and, when they answer, the records.
  std::string golden_run_of(const std::string& sha256);

 private:
  std::vector<std::filesystem::path> files();
  void read();
  void open();
  template <typename Action>
  std::string ask(const Action& action);
  bool may_ask() const;
  /// Counts the runs that wait for these records.
  std::size_t count_waiting() const;
  /// Returns `first`, unless it is empty, and what else there is to say: runs for other records,
  /// files that cannot be read, images that were not looked up.
  std::string with_remarks(const std::string& first) const;

  std::filesystem::path folder_;
  /// `name_` is what files of runs for these records say.
  std::string where_, name_;
  std::unique_ptr<Records> records_;
  /// Why the records are away; why they did not take a run; a file that read() could not read, or
  /// that is no run.
  std::string away_, problem_, unread_;
  /// `away_` for the operator; empty if only `away_` says what to do.
  std::string away_notice_;
  std::chrono::steady_clock::time_point ask_again_;
  /// What read() has found, for these records and for others.
  std::map<std::filesystem::path, SpooledRun> known_;
  std::size_t not_asked_ = 0;
};

/// All of a run as `vlp-run/1`: a JSON object with "records", the texts of run_fields(), "figures",
/// with "uncertainty" and "guard_k" where there is a guard band, "images" and "events". Bytes that
/// are no text stand as printable() has them.
std::string text_of_run(const SpooledRun& spooled);
/// A text of run_fields() that is not there is empty: the program that wrote it did not know it.
/// Throws InputError with the file, also when it is no run.
SpooledRun read_run(const std::filesystem::path& file);

}  // namespace vlp
