// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "session/step_result.h"

namespace vlp {

/// Files that a step writes into the folder of results.
struct StepOutputs {
  std::string step;
  std::vector<std::string> files;
};

/// Writes junit.xml with an error, for a run that is refused before its first step. It replaces the
/// junit.xml of an earlier run, also of another session: CI would read it as the result of this
/// run. A folder that is in use, or holds no results of a session, is not changed.
void write_refusal_junit(const std::filesystem::path& results, const std::filesystem::path& session,
                         const std::string& message);

/// Folder with the results of a session, which one run at a time may use. Results of an earlier run
/// are reused for steps whose inputs have not changed. Content:
///
///   lens.yaml, report.html, ...   the outputs of the steps
///   session.json                  outcome of the last run
///   steps/STEP.json               result of a step, digests of its inputs and outputs
///   steps/new                     outputs of the steps of a run that has not ended
///   steps/corners                 cached corners of boards
///   steps/session                 path of the session of these results; an empty line if all runs
///                                 were refused
///   steps/outputs                 names of all files above that runs wrote or may have written
///   steps/lock                    locked while a run uses the folder
///
/// Only files named in steps/outputs are ever removed or overwritten. A folder without this file is
/// refused when its outputs are planned or published.
class SessionResults {
 public:
  /// Locks the folder for this session, or for any if it is empty, and creates it if missing. The
  /// operating system releases the lock when the process ends, also after a crash. Throws
  /// InputError if the folder holds results of another session or files of other origin, is in use
  /// by another run, or cannot be written.
  SessionResults(std::filesystem::path folder, const std::filesystem::path& session);
  ~SessionResults();
  SessionResults(const SessionResults&) = delete;
  SessionResults& operator=(const SessionResults&) = delete;

  const std::filesystem::path& path() const { return folder_; }
  /// Returns the path of an output: in steps/new if this run makes it again, if a run that was
  /// killed made it, or if it is of no step of this run.
  std::filesystem::path results_file_path(const std::string& name) const;
  /// Returns the folder steps/new.
  std::filesystem::path new_outputs_folder() const { return folder_ / "steps/new"; }
  /// Returns the folder with the cached corners of boards.
  std::filesystem::path cache_folder() const { return folder_ / "steps/corners"; }

  /// Sets the steps of this run, in their order. Throws InputError if the run would overwrite a
  /// file that no run wrote.
  void set_steps(std::vector<StepOutputs> steps);
  /// Replaces the outputs of the last complete run by those of this run, and removes files that
  /// this run did not write.
  void publish_outputs();

  /// Returns the result of the last execution of a step if it is up to date. `key`, the digest of
  /// all that the step depends on, and the outputs must be unchanged. Returns std::nullopt
  /// otherwise, and after bad_input, because the file may have been corrected.
  std::optional<StepResult> find_cached(const std::string& step, const std::string& key) const;
  /// Records the result of a step, with its key and the digest of its outputs.
  void store_step_result(const std::string& step, const std::string& key,
                         const StepResult& result) const;

  /// Removes the record of a step, and its outputs with publish_outputs() if they are not made
  /// again.
  void remove_outputs(const std::string& step);
  /// Applies remove_outputs() to all steps after `step`.
  void remove_later_outputs(const std::string& step);
  /// Removes outputs and record of the step evaluate, which depend on the gates. Does not require
  /// set_steps().
  void remove_evaluation() const;
  /// Removes outputs and records of all steps. Does not require set_steps().
  void remove_all_outputs() const;

 private:
  std::filesystem::path step_record_file(const std::string& step) const;
  std::set<std::string> list_recorded() const;
  /// Returns the files of a step of this run; none for other steps.
  std::vector<std::string> list_planned(const std::string& step) const;
  /// Removes the outputs that are not wanted. Returns those that cannot be removed.
  std::set<std::string> remove_unwanted(const std::set<std::string>& wanted) const;
  std::string digest_outputs(const std::string& step) const;

  /// Writes the list of outputs if it changes, which avoids waiting for the disk.
  void write_output_list(const std::set<std::string>& names) const;

  std::filesystem::path folder_;
  std::vector<StepOutputs> steps_;
  std::set<std::string> wanted_;       // files of this run
  std::set<std::string> new_outputs_;  // in steps/new, if they exist
  int lock_;
};

}  // namespace vlp
