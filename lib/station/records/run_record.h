// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "evaluation/gate.h"
#include "session/step_history.h"
#include "station/station_config.h"
#include "station/verdict.h"

namespace vlp {

/// What became of a run after its verdict. Events are added to a run, never changed nor taken away.
struct RunEvent {
  /// Unique, in the order of time: 20261121T134501.123456Z-01234567.
  std::string event;
  /// One of those below.
  std::string what;
  /// Why, or what came of it, for people.
  std::string text;
  /// Who: the operator, where it was said, and the account and machine of the program.
  std::string who = {};

  /// As 2026-11-21T13:45:01Z.
  std::string utc() const;
};
inline constexpr const char *kHookWanted = "hook wanted", *kHookDone = "hook done",
                            *kHookFailed = "hook failed", *kImagesDeleted = "images deleted",
                            *kResultsDeleted = "results deleted", *kVoided = "voided",
                            *kUnchecked = "unchecked";

/// One of now, by this program's account, as "Ann (vlp@station-7)" where an operator is known.
RunEvent new_event(const std::string& what, const std::string& text,
                   const std::string& operator_name = "");

/// All that is kept of a run.
struct RunRecord {
  /// Unique over all stations, see new_run().
  std::string run;
  /// "unit", or "golden" for the station's reference camera.
  std::string kind;
  std::string station, camera;
  /// Who measured, and in which shift, where it was said.
  std::string operator_name, shift;
  /// As 2026-11-21T13:45:01Z.
  std::string begun_utc, ended_utc;
  /// name_of() a Verdict, and why, one cause to a line, the root first.
  std::string verdict, causes;
  /// Program with version, and the libraries that the result rests on with theirs.
  std::string program, libraries;
  std::string config_sha256;
  /// calibration.yaml as far as it came; may be empty.
  std::string calibration;
  std::vector<CheckedMetric> figures;
  struct Image {
    std::string step, name, sha256;
    /// Why it was not used; empty when it was.
    std::string refused;
  };
  std::vector<Image> images;
  /// From the first to the last.
  std::vector<RunEvent> events;

  bool passed() const { return verdict == name_of(Verdict::pass); }
  bool invalid() const { return verdict == name_of(Verdict::invalid); }
  /// Why it did not pass, in a line; empty when it did.
  std::string first_cause() const { return causes.substr(0, causes.find('\n')); }
  /// Sets verdict and causes.
  void judge(const std::vector<Cause>& why);
};

/// Run that used an image; empty if none did.
struct ImageOwner {
  std::string camera = {}, run = {};

  bool empty() const { return run.empty(); }
  friend bool operator==(const ImageOwner&, const ImageOwner&) = default;
};

/// Returns the command that voids a run of the station of this file, with all its options.
std::string void_command(const std::string& run, const std::filesystem::path& station_file);

/// Describes the owner of an image, and how to free it if the owner's serial was wrong.
std::string describe_owner(const ImageOwner& owner, const std::filesystem::path& station_file);

/// Returns true if `run` uses images, and `earlier` used all of them; both of one camera.
bool repeats_images(const RunRecord& run, const RunRecord& earlier);

/// The event that voided a run; null when it was not.
const RunEvent* voided(const RunRecord& record);

/// Why the verdict of a record is none: the run was voided, or it says what cannot be in one as it
/// was written, PASS though a gate is not met, or for a cause, so that somebody has changed it.
/// Empty when it is one.
std::string why_no_verdict(const RunRecord& record);

/// A text of a record: a column of the table of runs and a key of their JSON.
struct RunField {
  const char* name;
  std::string RunRecord::*text;
  /// With which `show` has it among the last lines; without one it stands elsewhere or not at all.
  const char* label = nullptr;
  /// A column of the CSV of runs; in JSON, too, it is brought on one line.
  bool in_csv = true;
};

/// All texts of a record, in order. A new one is a member of RunRecord, a line in run_fields(),
/// what fills it, new_record() or the program, and a migration in record_tables.cpp.
std::span<const RunField> run_fields();

/// A name for a run that begins now: the time and 16 random hexadecimal digits,
/// 20261121T134501Z-0123456789abcdef.
std::string new_run();
/// Returns true if a text has the form of new_run().
bool is_name_of_run(const std::string& text);
/// When it began, as 2026-11-21T13:45:01Z; empty for what is no name of a run.
std::string begun_utc(const std::string& run);
std::string now_utc();
/// Since a UTC as 2026-11-21T13:45:01Z; below 0 for one to come, NaN for what is none.
double seconds_since(const std::string& utc);

/// Returns the run with each text as a terminal, a report and the spool take it: printable(), and
/// printable_line() for who measured, names of images and events.
RunRecord printable_run(RunRecord run);

/// Returns the cause that makes a run INVALID whose clock went back; an empty string if the run
/// ended after it began.
std::string clock_problem(const RunRecord& run);

/// What is alike in the record of a unit and of a golden one that ends now: all but the verdict,
/// what it rests on, and who measured.
RunRecord new_record(const char* kind, const StationConfig& config, const std::string& camera,
                     const std::string& run, const ProgramVersion& program);

/// OpenCV, Ceres, mrcal and so on, each with its version.
std::string library_versions();

}  // namespace vlp
