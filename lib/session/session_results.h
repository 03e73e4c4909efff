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

/// What a step writes into the folder of results.
struct StepOutputs {
  std::string step;
  std::vector<std::string> files;
};

/// The folder of a session's results: whose they are, and what of an earlier run still holds.
///
///   lens.yaml, report.html, ...   the outputs of the steps
///   session.json                  how the last run went
///   steps/STEP.json               how a step ended, on what inputs, with which outputs
///   steps/session                 whose results these are
///   steps/outputs                 names of all files above that runs wrote or may have written
///   steps/lock                    held while a run is at work
///
/// Only files named in steps/outputs are ever removed or overwritten.
class SessionResults {
 public:
  /// Takes the folder for this session, and makes it where it is not there. Throws InputError when
  /// another session's results are in it, when what is in it is not of this procedure, when another
  /// run is at work there, and when it cannot be written to. The system lets go of the folder when
  /// the run ends, however it does.
  SessionResults(std::filesystem::path folder, const std::filesystem::path& session);
  ~SessionResults();
  SessionResults(const SessionResults&) = delete;
  SessionResults& operator=(const SessionResults&) = delete;

  const std::filesystem::path& path() const { return folder_; }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }
  /// Where corners of boards are kept between runs.
  std::filesystem::path corners() const { return folder_ / "steps/corners"; }

  /// The steps of this run, in their order. What another run wrote and this one does not is
  /// removed. Throws InputError if the run would overwrite a file that no run wrote.
  void plan(std::vector<StepOutputs> steps);

  /// How a step ended when it last ran, when that holds still: `key`, the digest of all that it
  /// depends on, is as it was, and so are its outputs. What was a bad file may be mended by now.
  std::optional<StepResult> kept(const std::string& step, const std::string& key) const;
  void keep(const std::string& step, const std::string& key, const StepResult& result) const;

  /// Removes what a step wrote, and how it ended.
  void forget(const std::string& step) const;
  /// Of all the steps behind it, too.
  void forget_behind(const std::string& step) const;
  /// What the last step wrote, which gates are a part of; not needing a plan.
  void forget_evaluation() const;
  /// Of every step there can be; not needing a plan.
  void forget_all() const;

 private:
  std::filesystem::path record_of(const std::string& step) const;
  std::set<std::string> outputs() const;
  /// Removes the outputs that are not wanted. Returns those that cannot be removed.
  std::set<std::string> remove_outputs(const std::set<std::string>& wanted) const;
  std::string digest_of_outputs(const std::string& step) const;

  std::filesystem::path folder_;
  std::vector<StepOutputs> steps_;
  int lock_;
};

}  // namespace vlp
