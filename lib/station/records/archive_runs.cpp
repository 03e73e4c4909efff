// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/archive_runs.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "captures/csv_reader.h"
#include "captures/digest.h"
#include "captures/id.h"
#include "captures/shared_folder.h"
#include "evaluation/gate.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxSessionFileBytes = 1 << 26;

/// Converts 2026-03-14 or 2026-03-14T09:30:00.25 to 2026-03-14T09:30:00Z.
std::string parse_date(const std::string& date) {
  constexpr std::size_t day = 10, whole = 19;
  return date.size() == day ? date + "T00:00:00Z" : date.substr(0, whole) + "Z";
}

/// Makes a run id in the form of make_run_id().
std::string make_session_run_id(std::string utc, const std::string& text) {
  constexpr std::size_t digits = 16;
  std::erase_if(utc, [](char c) { return c == '-' || c == ':'; });
  return utc + "-" + hash_text(text).substr(0, digits);
}

std::optional<double> find_number(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

/// Adds the entries of `metrics` or `gates` of session.json. Existing metrics are not replaced.
void add_metrics(const nlohmann::json& entries, std::vector<CheckedMetric>& metrics) {
  std::set<std::string> names;
  for (const CheckedMetric& metric : metrics) names.insert(metric.name);
  metrics.reserve(metrics.size() + entries.size());
  for (const nlohmann::json& entry : entries) {
    CheckedMetric metric;
    metric.name = entry.at("name");
    if (!names.insert(metric.name).second) continue;
    metric.unit = entry.value("unit", "");
    metric.value = find_number(entry, "value");
    metric.limit = find_number(entry, "limit");
    const auto kind = find_metric_kind(metric.name);
    metric.direction = kind ? kind->direction : Direction::at_most;
    metrics.push_back(std::move(metric));
  }
}

/// Opens RESULTS/KIND/CAMERA/SESSION/; std::nullopt if it does not exist.
std::optional<SharedFolder> open_session(const fs::path& folder) {
  const fs::path camera = folder.parent_path(), kind = camera.parent_path();
  const SharedFolder results(kind.parent_path());
  const auto kinds = results.open_if_exists({kind.filename().string(), folder, "folder"});
  if (!kinds) return std::nullopt;
  const auto cameras = kinds->open_if_exists({camera.filename().string(), folder, "camera"});
  if (!cameras) return std::nullopt;
  return cameras->open_if_exists({folder.filename().string(), folder, "session"});
}

}  // namespace

ReprocessedArchive read_reprocessed(const fs::path& results) {
  const CsvTable summary(results / "summary.csv");
  const auto text = [&](std::size_t row, const char* column) {
    return std::string(summary.get_cell_text(row, summary.require_column(column)));
  };
  const fs::path named = fs::absolute(results).lexically_normal();
  const fs::path last = named.has_filename() ? named.filename() : named.parent_path().filename();
  ReprocessedArchive archive;
  for (std::size_t row = 0; row < summary.num_rows(); ++row) {
    const std::string date = text(row, "date"), verdict = text(row, "verdict");
    const bool crashed = verdict == "crashed";
    if (crashed || date.empty()) {
      ++(crashed ? archive.crashed : archive.undated);
      continue;
    }
    RunRecord run;
    run.kind = "unit";
    run.station = last.string();
    const fs::path line =
        (results / "summary.csv").string() + ":" + std::to_string(summary.line_number_of_row(row));
    std::string session;
    try {
      run.camera = Id(text(row, "camera"), line, "camera").id_text();
      session = run.camera + "/" + Id(text(row, "session"), line, "session").id_text();
    } catch (const InputError& error) {
      archive.rejected_sessions.emplace_back(error.what());
      continue;
    }
    run.begun_utc = run.ended_utc = parse_date(date);
    run.run = make_session_run_id(run.ended_utc, run.station + "/" + session);
    run.program = "vlp-calibrate " + text(row, "version");
    run.config_sha256 = text(row, "key");
    const bool passed = verdict == "pass" || verdict == "review";
    const bool failed = verdict == "gate";
    run.verdict = verdict_name(passed ? Verdict::pass : failed ? Verdict::fail : Verdict::invalid);
    if (!passed) run.causes = text(row, "reason") + "\n";
    archive.sessions.push_back(
        {std::move(run), results / (passed || failed ? "sessions" : "failed") / session});
  }
  std::ranges::sort(archive.sessions, {}, [](const auto& session) { return session.run.run; });
  return archive;
}

RunRecord load_archive_run(const ReprocessedSession& session) {
  RunRecord run = session.run;
  const fs::path file = session.folder / "session.json";
  const auto folder = open_session(session.folder);
  const auto text =
      folder ? folder->read_if_exists("session.json", kMaxSessionFileBytes) : std::nullopt;
  if (!text) throw InputError(file, "cannot be opened: there is none");
  try {
    check_json_limits(*text);
    const auto document = nlohmann::json::parse(*text);
    for (const char* part : {"metrics", "gates"}) {
      if (document.contains(part)) add_metrics(document[part], run.metrics);
    }
  } catch (const std::exception& error) {
    // [STATION-14] `vlp-calibrate writes`
    throw InputError(file, fmt::format("is not as vlp-calibrate writes it: {}", error.what()));
  }
  run.calibration = folder->read_if_exists("calibration.yaml", kMaxSessionFileBytes).value_or("");
  return run;
}

}  // namespace vlp
