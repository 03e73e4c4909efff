// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "evaluation/gate.h"
#include "evaluation/verdict.h"
#include "session/step_history.h"
#include "station/station_config.h"

namespace vlp {

/// Event of a run after its verdict. Events are only added, never changed or removed.
struct RunEvent {
  /// Unique id of this event, with its time (make_run_id()).
  std::string event;
  /// Kind of the event: one of the constants below.
  std::string kind;
  /// Reason or result, human-readable.
  std::string text;
  /// Operator, if given, with account and machine of the program.
  std::string author = {};
};
inline constexpr const char *kHookRequested = "hook wanted", *kHookDone = "hook done",
                            *kHookFailed = "hook failed", *kImagesDeleted = "images deleted",
                            *kResultsDeleted = "results deleted", *kVoided = "voided",
                            *kUnchecked = "unchecked";

/// Makes an event of the current time. RunEvent::author is this program's account, or "Ann
/// (vlp@station-7)" with an operator.
RunEvent make_run_event_now(const std::string& kind, const std::string& text,
                            const std::string& operator_name = "");

/// Record of a run.
struct RunRecord {
  /// Unique id over all stations (make_run_id()).
  std::string run;
  /// Kind of the run: "unit", or "golden" for the station's reference camera.
  std::string kind;
  std::string station, camera;
  /// Operator and shift, if given.
  std::string operator_name, shift;
  /// Start and end of the run in UTC, as 2026-11-21T13:45:01Z.
  std::string begun_utc, ended_utc;
  /// Verdict (verdict_name()), and its causes, one per line, the primary cause first.
  std::string verdict, causes;
  /// Program with its version, and the libraries that affect the result with their versions.
  std::string program, libraries;
  std::string config_sha256;
  /// Content of calibration.yaml of the completed steps; can be empty.
  std::string calibration;
  std::vector<CheckedMetric> metrics;
  struct Image {
    std::string step, name, sha256;
    /// Reason why the image was not used; empty if it was.
    std::string rejection;

    bool is_image_used() const { return rejection.empty(); }
  };
  std::vector<Image> images;
  /// Events, in chronological order.
  std::vector<RunEvent> events;

  /// Returns the metric of this name; null if there is none.
  const CheckedMetric* find_metric(std::string_view name) const;
  /// Returns the number of images that were used.
  std::ptrdiff_t count_used_images() const;
  bool has_run_passed() const { return verdict == verdict_name(Verdict::pass); }
  bool is_verdict_invalid() const { return verdict == verdict_name(Verdict::invalid); }
  /// Returns the first cause, in one line; empty if the run passed.
  std::string first_cause() const { return causes.substr(0, causes.find('\n')); }
  /// Sets verdict and causes from `new_causes`, the most important cause first. A wrong clock
  /// (describe_clock_problem()) precedes all.
  void set_causes(std::vector<Cause> new_causes);
  /// Makes the run INVALID for another reason, which precedes the others.
  void invalidate_verdict(const std::string& reason);
};

/// Run that used an image.
struct ImageUser {
  std::string camera, run;

  friend bool operator==(const ImageUser&, const ImageUser&) = default;
};

/// Returns the command that voids a run of the station of this file, with all its options.
std::string format_void_command(const std::string& run, const std::filesystem::path& station_file);

/// Describes the owner of an image, and how to free it if the owner's serial was wrong.
std::string describe_image_user(const ImageUser& owner, const std::filesystem::path& station_file);

/// Returns true if `run` uses images, and `earlier` used all of them; both of one camera.
bool has_images_of(const RunRecord& run, const RunRecord& earlier);

/// Returns the event that voided a run; null if it is not voided.
const RunEvent* find_voiding_event(const RunRecord& record);

/// Returns the index of the last event of a kind; -1 if there is none.
std::ptrdiff_t get_last_event_index(const RunRecord& record, const char* kind);

/// Returns the reason why the verdict of a record is not valid; empty if it is valid. The verdict
/// is not valid if the run was voided, or if it is PASS despite a failed gate or a cause. The
/// latter shows that the record was edited.
std::string explain_void_verdict(const RunRecord& record);

/// Text member of a record: a key of its document.
struct RunField {
  const char* name;
  std::string RunRecord::*text;
  /// Label in the last lines of `show`; null if `show` prints the text elsewhere or not at all.
  const char* label = nullptr;
  /// True if the table of runs and the CSV have a column for it.
  bool is_column = true;
};

/// Returns all text members of a record, in order. A new text requires a member of RunRecord, an
/// entry in list_run_fields(), code that sets it (make_run_record() or the program),
/// and another kSchemaVersion.
std::span<const RunField> list_run_fields();

/// Returns the id of a run that starts now, or of an event, 20261121T134501Z-0123456789abcdef: UTC,
/// microseconds in 5 hexadecimal digits and 11 random ones. Ids sort by time to the microsecond,
/// unless the clock is set back.
std::string make_run_id();
/// Returns true if a text has the form of make_run_id().
bool is_run_id(const std::string& text);
/// Returns the UTC of the start of a run or of an event, as 2026-11-21T13:45:01Z; empty if `run` is
/// no id.
std::string start_utc_of_run_id(const std::string& run);
std::string get_current_utc();
/// Returns the problem of a UTC of a filter: 2026-11-21T13:45:01Z, or a prefix that includes the
/// day. Empty if it is valid.
std::string describe_utc_problem(const std::string& text);
/// Returns the time since a UTC as 2026-11-21T13:45:01Z, s: negative for a future time, NaN for an
/// invalid text.
double compute_utc_age_s(const std::string& utc);

/// Returns the run with texts that are safe for terminals, reports and records:
/// escape_for_terminal(), and escape_for_line() for operators and for names of
/// images and events.
RunRecord escape_run(RunRecord run);

/// Returns the cause INVALID of a run whose end is before its start, because the clock was set
/// back; empty if there is none.
std::string describe_clock_problem(const RunRecord& run);

/// Makes the common part of the records of units and golden units for a run that ends now: all
/// members except verdict, inputs and operator.
RunRecord make_run_record(const char* kind, const StationConfig& config, const std::string& camera,
                          const std::string& run, const ProgramVersion& program);

/// Returns OpenCV, Ceres, mrcal and other libraries with their versions.
std::string list_library_versions();

/// Serializes a run without its events as a JSON document of one line, format `vlp-run/3`
/// (datasets/schemas/run.schema.json). Records store this text, and its SHA-256 is the digest of
/// the run. Its texts are those of escape_run().
std::string serialize_run(const RunRecord& run);
/// Reads a document of serialize_run().
/// @throws std::runtime_error if the text is no such document, has no run or verdict, or exceeds
///   check_json_limits() or 16 MiB
RunRecord parse_run_document(const std::string& document);

/// Returns the JSON for the hook: "event" ("verdict", or "voided" for a voided run), then the
/// members of serialize_run(), and "events".
std::string format_hook_json(const RunRecord& run);

/// Writes runs atomically, in the format of the file's extension. Throws InputError, also for
/// another extension.
///
///   .csv   one row per run: the texts of list_run_fields() with RunField::is_column, and one
///          column per metric, empty if missing
///   .json  list of the documents of serialize_run(), each with "events"
void write_runs(const std::filesystem::path& file, const std::vector<RunRecord>& runs);

}  // namespace vlp
