// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/golden_due.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>

#include "captures/digest.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "station/records/measuring_digest.h"
#include "station/station_folders.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnitLine = "unit\n";

fs::path note_of(const StationConfig& config) {
  constexpr std::size_t digits = 16;
  return config.spool / (".golden-" + sha256_of_text(config.station).substr(0, digits));
}

/// Of a note that is no whole one.
std::string damaged(const std::string& why) {
  return fmt::format("what the golden unit said is not known ({}): 'vlp-station verify' is due",
                     why);
}

/// An earlier PASS must not stand where this run could not be noted: without a note it is due.
void forget(const fs::path& file) {
  std::error_code ignored;
  fs::remove(file, ignored);
}

}  // namespace

std::string golden_problem(const StationConfig& config, GoldenAt at) {
  constexpr const char* verify = "'vlp-station verify' is due";
  if (!config.verify_due) return "";
  const fs::path file = note_of(config);
  std::error_code none;
  if (fs::status(file, none).type() == fs::file_type::not_found) {
    return fmt::format("the golden unit was not measured here yet: {}", verify);
  }
  constexpr std::size_t most_bytes = 1 << 24;
  std::string text;
  try {
    text = read_text_file(file, most_bytes);
  } catch (const InputError& error) {
    return damaged(error.what());
  }
  std::istringstream words(text.substr(0, text.find('\n')));
  std::string run, verdict, ended_utc, measured_with;
  words >> run >> verdict >> ended_utc >> measured_with;
  const bool failed = verdict == name_of(Verdict::fail);
  if ((!failed && verdict != name_of(Verdict::pass)) || ended_utc.empty()) {
    return damaged(file.string() + " is damaged");
  }
  if (failed) {
    return fmt::format("the golden unit failed (run {}): mend the station, then {}", run, verify);
  }
  if (measured_with.empty()) {  // an older program's note
    return fmt::format("with which lamp map the golden unit was measured is not known (run {}): {}",
                       run, verify);
  }
  if (measured_with != measuring_digest(config)) {
    return fmt::format(
        "what measures in station.yaml or a file that it names was changed since the golden unit "
        "was measured (run {}): {}",
        run, verify);
  }
  if (at == GoldenAt::verdict) return "";
  constexpr double second_per_hour = 3600;
  const double age_h = seconds_since(ended_utc) / second_per_hour;
  const auto& due = *config.verify_due;
  if (due.hours && !(age_h >= 0 && age_h <= *due.hours)) {
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

void note_for_golden(const StationConfig& config, const RunRecord& record) {
  if (!config.verify_due || record.invalid()) return;
  const fs::path file = note_of(config);
  make_folder(config.spool);
  if (record.kind == "golden") {
    try {
      return write_file(file, fmt::format("{} {} {} {}\n", record.run, record.verdict,
                                          record.ended_utc, measuring_digest(config)));
    } catch (const InputError&) {
      forget(file);
      throw;
    }
  }
  const int note = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (note < 0 && errno == ENOENT) return;  // never measured: nothing to count from
  const std::string_view line = kUnitLine;
  const bool written = note >= 0 && ::write(note, line.data(), line.size()) == ssize_t(line.size());
  if (note >= 0) ::close(note);
  if (written) return;
  forget(file);
  throw InputError(file, "cannot be written");
}

bool forget_golden(const StationConfig& config, const std::string& run) {
  std::string noted;
  std::ifstream(note_of(config)) >> noted;
  if (noted != run) return false;
  forget(note_of(config));
  return true;
}

}  // namespace vlp
