// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/golden_unit_schedule.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <sstream>
#include <system_error>

#include "captures/digest.h"
#include "captures/shared_folder.h"
#include "rig/input_error.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnitLine = "unit\n";

constexpr std::size_t kMaxBytes = 1 << 24;

std::string make_note_name(const StationConfig& config) {
  constexpr std::size_t digits = 16;
  return ".golden-" + hash_text(config.station).substr(0, digits);
}

/// Returns the message about an incomplete note.
std::string describe_damaged_note(const std::string& why) {
  // [STATION-3] `result of the golden unit`
  return fmt::format("the result of the golden unit is unknown ({}): 'vlp-station verify' is due",
                     why);
}

/// Deletes the note, so that an earlier PASS is not valid after a run that could not be noted.
void delete_note(const StationConfig& config) {
  std::error_code ignored;
  fs::remove(config.spool / make_note_name(config), ignored);
}

/// Adds a line to the note if it exists. Throws InputError if it cannot be written.
void append_line_to_note(const SharedFolder& spool, const std::string& note,
                         std::string_view line) {
  const int file = spool.open_regular_file(note, O_WRONLY | O_APPEND);
  if (file < 0 && errno == ENOENT) return;
  const bool is_written =
      file >= 0 && ::write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (file >= 0) ::close(file);
  // [FILE-1]
  if (!is_written) throw InputError(spool.folder_path() / note, "cannot be written");
}

}  // namespace

std::string describe_golden_problem(const StationConfig& config, GoldenCheckTime at) {
  constexpr const char* verify = "'vlp-station verify' is due";
  if (!config.verification_interval) return "";
  const fs::path file = config.spool / make_note_name(config);
  std::error_code none;
  if (fs::symlink_status(file, none).type() == fs::file_type::not_found) {
    // [STATION-3] `was not measured here yet` | [golden unit](vlp-station.md#golden-unit) due, or
    //   its note not readable or written (disk full?) | `vlp-station verify`
    return fmt::format("the golden unit was not measured here yet: {}", verify);
  }
  std::string text;
  try {
    text =
        SharedFolder(config.spool).read_if_exists(make_note_name(config), kMaxBytes).value_or("");
  } catch (const InputError& error) {
    return describe_damaged_note(error.what());
  }
  if (!text.ends_with('\n'))
    return describe_damaged_note(file.string() + ": is the file cut short?");
  std::istringstream words(text.substr(0, text.find('\n')));
  std::string run, verdict, ended_utc, measured_with;
  words >> run >> verdict >> ended_utc >> measured_with;
  const bool failed = verdict == verdict_name(Verdict::fail);
  if ((!failed && verdict != verdict_name(Verdict::pass)) || measured_with.empty()) {
    return describe_damaged_note(file.string() + " is damaged");
  }
  if (failed) {
    return fmt::format("the golden unit failed (run {}): repair the station, then {}", run, verify);
  }
  if (measured_with != hash_settings(config)) {
    return fmt::format(
        "station.yaml or a file that it names was changed in a way that affects measurements after "
        "the golden unit was measured (run {}): {}",
        run, verify);
  }
  if (at == GoldenCheckTime::verdict) return "";
  constexpr double second_per_hour = 3600;
  const double age_h = compute_utc_age_s(ended_utc) / second_per_hour;
  const auto& due = *config.verification_interval;
  if (due.hours && !(age_h >= 0 && age_h <= *due.hours)) {
    // [STATION-3] `golden unit was measured`
    return fmt::format("the golden unit was measured {} (run {}), not within {:g} h: {}", ended_utc,
                       run, *due.hours, verify);
  }
  const auto units = std::count(text.begin(), text.end(), '\n') - 1;
  if (due.units && units >= *due.units) {
    return fmt::format("{} units since the golden unit was measured (run {}): {}", units, run,
                       verify);
  }
  return "";
}

void record_golden_run(const StationConfig& config, const RunRecord& record) {
  if (!config.verification_interval || record.is_verdict_invalid()) return;
  create_station_folder(config.spool);
  const SharedFolder spool(config.spool);
  const std::string note = make_note_name(config);
  try {
    if (record.kind == "golden") {
      spool.replace_file(note, fmt::format("{} {} {} {}\n", record.run, record.verdict,
                                           record.ended_utc, hash_settings(config)));
    } else {
      append_line_to_note(spool, note, kUnitLine);  // never measured: nothing to count from
    }
  } catch (const InputError&) {
    delete_note(config);
    throw;
  }
}

bool delete_golden_note(const StationConfig& config, const std::string& run) {
  try {
    const auto note = SharedFolder(config.spool).read_if_exists(make_note_name(config), kMaxBytes);
    if (!note || note->substr(0, note->find(' ')) != run) return false;
  } catch (const InputError&) {  // no spool, or no valid note (describe_golden_problem())
    return false;
  }
  delete_note(config);
  return true;
}

}  // namespace vlp
