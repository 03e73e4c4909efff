// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/archive_runs.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "captures/csv_reader.h"
#include "captures/digest.h"
#include "rig/file.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostBytes = 1 << 26;

/// 2026-03-14 or 2026-03-14T09:30:00 as 2026-03-14T09:30:00Z.
std::string utc_of(const std::string& date) {
  constexpr std::size_t whole = 19;
  return (date + std::string("T00:00:00").substr(0, date.size() < whole ? whole : 0))
             .substr(0, whole) +
         "Z";
}

/// Of what ended at this time; see new_run().
std::string run_name(std::string ended_utc, const std::string& session) {
  constexpr std::size_t digits = 16;
  std::erase_if(ended_utc, [](char c) { return c == '-' || c == ':'; });
  return ended_utc + "-" + sha256_of_text(session).substr(0, digits);
}

/// Of `metrics` or `gates` of session.json; those that stand there already stay.
void add_figures(const nlohmann::json& metrics, std::vector<CheckedMetric>& figures) {
  for (const nlohmann::json& metric : metrics) {
    CheckedMetric figure;
    figure.name = metric.at("name");
    const bool known = std::any_of(figures.begin(), figures.end(),
                                   [&](const auto& other) { return other.name == figure.name; });
    if (known) continue;
    figure.unit = metric.value("unit", "");
    if (metric.contains("value") && metric["value"].is_number()) figure.value = metric["value"];
    if (metric.contains("limit")) figure.limit = metric["limit"].get<double>();
    figure.asked = metric.value("asked", "") == words_of(Direction::at_least) ? Direction::at_least
                                                                              : Direction::at_most;
    figures.push_back(std::move(figure));
  }
}

/// What vlp-calibrate wrote of a session; nothing of one that crashed.
void add_session(const fs::path& folder, RunRecord& run) {
  const fs::path file = folder / "session.json";
  if (!fs::exists(file)) return;
  try {
    const auto session = nlohmann::json::parse(read_text_file(file, kMostBytes));
    run.program = "vlp-calibrate " + session.at("version").get<std::string>();
    for (const char* part : {"metrics", "gates"}) {
      if (session.contains(part)) add_figures(session[part], run.figures);
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(file, fmt::format("is not as vlp-calibrate writes it: {}", error.what()));
  }
  if (fs::exists(folder / "calibration.yaml")) {
    run.calibration = read_text_file(folder / "calibration.yaml", kMostBytes);
  }
}

}  // namespace

ArchiveRuns runs_of_archive(const fs::path& results) {
  const CsvTable summary(results / "summary.csv");
  const auto text = [&](std::size_t row, const char* column) {
    return std::string(summary.text(row, summary.required(column)));
  };
  const fs::path named = fs::absolute(results).lexically_normal();
  ArchiveRuns archive;
  for (std::size_t row = 0; row < summary.rows(); ++row) {
    const std::string date = text(row, "date"), verdict = text(row, "verdict");
    if (date.empty()) {
      ++archive.undated;
      continue;
    }
    RunRecord run;
    run.kind = "unit";
    run.station = (named.has_filename() ? named : named.parent_path()).filename().string();
    run.camera = text(row, "camera");
    const std::string session = run.camera + "/" + text(row, "session");
    run.begun_utc = run.ended_utc = utc_of(date);
    run.run = run_name(run.ended_utc, session);
    const bool passed = verdict == "pass" || verdict == "look", failed = verdict == "gate";
    run.verdict = name_of(passed ? Verdict::pass : failed ? Verdict::fail : Verdict::invalid);
    if (!passed) run.causes = text(row, "reason") + "\n";
    add_session(results / (passed || failed ? "sessions" : "failed") / session, run);
    archive.runs.push_back(std::move(run));
  }
  std::sort(archive.runs.begin(), archive.runs.end(),
            [](const RunRecord& a, const RunRecord& b) { return a.run < b.run; });
  return archive;
}

}  // namespace vlp
