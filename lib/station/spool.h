// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "station/records.h"

namespace vlp {

/// A station's runs on their way to its records, which need not be there: each waits, whole, as a
/// file of the spool, RUN.json (`vlp-run/1`), until the records have it. Nothing is lost, whatever
/// is killed and when: a file appears as a whole and goes when the run is committed. Nothing is
/// twice: records keep a run by its name, once. Any number of programs may use a spool at once.
/// Records that did not answer are left alone for a minute, so that a unit waits for them once.
class Spool {
 public:
  /// The folder is made when it is needed. `records` is as Records takes it; nothing is reached for
  /// yet. Throws InputError when it is no connection string.
  Spool(std::filesystem::path folder, std::string records);
  ~Spool();
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  /// Before the first image: throws InputError when no run could be kept in the folder. Records
  /// that cannot be reached or written are no error, see state().
  void prepare();
  /// Keeps a run in the folder; where that cannot be written, in the records. Throws InputError
  /// when neither can be.
  void keep(const RunRecord& run);
  /// Brings what waits to the records, from the first to the last. It begins no other run after ten
  /// seconds, so that a backlog keeps nobody waiting. A run that the records refuse holds up no
  /// other.
  void deliver();
  /// "kept here, 3 waiting: WHY", or why the records are away; empty when they have all.
  std::string state() const;

  /// Those that wait, from the first to the last; without files that are no runs.
  const std::vector<RunRecord>& waiting();
  /// A run that waits, or that the records have when they answer.
  std::optional<RunRecord> find(const std::string& run);
  /// Records::owner_of() of those that wait and, when they answer, the records.
  std::string owner_of(const std::string& sha256, const std::string& other_than_camera);

 private:
  std::vector<std::filesystem::path> files() const;
  template <typename Action>
  bool ask(const Action& action);
  void put_off();

  std::filesystem::path folder_;
  std::string where_;
  std::unique_ptr<Records> records_;
  /// Why the records could not be asked, or did not take a run.
  std::string problem_;
  std::chrono::steady_clock::time_point ask_again_;
  /// What waiting() has read, and of which files.
  std::vector<std::filesystem::path> known_files_;
  std::vector<RunRecord> known_;
};

/// All of a run as `vlp-run/1`: a JSON object with the texts of run_fields(), "figures" and
/// "images". Bytes that are no text stand as printable() has them.
std::string text_of_run(const RunRecord& run);
/// Throws InputError with the file, also when it is no run.
RunRecord read_run(const std::filesystem::path& file);

}  // namespace vlp
