// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/publish_run.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <sstream>
#include <utility>

#include "captures/id.h"
#include "captures/number_text.h"
#include "report/report.h"
#include "rig/input_error.h"
#include "station/station_folders.h"

namespace vlp {

namespace {

namespace fs = std::filesystem;

Id make_camera_folder_id(const RunRecord& record) {
  return {record.camera, "the record of a run", "camera"};
}
Id make_run_folder_id(const RunRecord& record) {
  return {record.run, "the record of a run", "run"};
}

/// Returns true if a file has this content. A longer one, a link and a pipe do not.
bool has_file_content(const SharedFolder& folder, const std::string& name,
                      const std::string& content) {
  try {
    return folder.read_if_exists(name, content.size()) == content;
  } catch (const InputError&) {
    return false;
  }
}

/// Writes the calibration of a record, or checks the existing one. Returns its path.
fs::path write_calibration(const RunRecord& record, const SharedFolder& folder) {
  const char* name = calibration_file_name(record);
  fs::path file = folder.folder_path() / name;
  if (!folder.contains(name)) {
    folder.replace_file(name, record.calibration);
  } else if (!has_file_content(folder, name, record.calibration)) {
    throw InputError(file, "differs from the record: move it away");
  }
  return file;
}

ReportVerdict make_report_verdict(const RunRecord& record) {
  const std::string no_verdict = explain_void_verdict(record);
  ReportVerdict verdict{record.verdict,
                        record.has_run_passed()       ? Verdict::pass
                        : record.is_verdict_invalid() ? Verdict::invalid
                                                      : Verdict::fail,
                        {}};
  if (!no_verdict.empty()) verdict = {"NO VERDICT", Verdict::invalid, {no_verdict}};
  std::istringstream causes(record.causes);
  for (std::string cause; std::getline(causes, cause);) verdict.causes.push_back(cause);
  return verdict;
}

std::string describe_meaning(const CheckedMetric& metric) {
  const auto kind = find_metric_kind(metric.name);
  return kind ? kind->description : "a metric of another version of the program";
}

}  // namespace

void check_results_writable(const fs::path& results, const std::string& camera) {
  constexpr std::uintmax_t room_bytes = 8'000'000;
  create_station_folder(results);
  require_space(SharedFolder(results).open_or_create({camera, results, "camera"}), room_bytes);
}

const char* calibration_file_name(const RunRecord& record) {
  if (find_voiding_event(record) != nullptr) return "voided-calibration.yaml";
  if (record.has_run_passed()) return "calibration.yaml";
  return record.is_verdict_invalid() ? "invalid-calibration.yaml" : "failed-calibration.yaml";
}

bool rename_voided_files(const RunRecord& record, const fs::path& results) {
  constexpr std::array names{std::pair("calibration.yaml", "voided-calibration.yaml"),
                             std::pair("failed-calibration.yaml", "voided-calibration.yaml"),
                             std::pair("invalid-calibration.yaml", "voided-calibration.yaml"),
                             std::pair("certificate.html", "voided-certificate.html"),
                             std::pair("report.html", "voided-report.html"),
                             std::pair("replaced-report.html", "voided-replaced-report.html")};
  std::error_code missing;
  if (!fs::is_directory(results, missing)) return false;
  const auto camera = SharedFolder(results).open_if_exists(make_camera_folder_id(record));
  const auto folder = camera ? camera->open_if_exists(make_run_folder_id(record)) : std::nullopt;
  if (!folder) return false;
  bool is_any_renamed = false;
  for (const auto& [name, voided_name] : names) {
    is_any_renamed = folder->rename_file(name, voided_name) || is_any_renamed;
  }
  return is_any_renamed;
}

SharedFolder open_run_results(const RunRecord& record, const fs::path& results) {
  const Id camera = make_camera_folder_id(record), run = make_run_folder_id(record);
  create_station_folder(results);
  return SharedFolder(results).open_or_create(camera).open_or_create(run);
}

std::string make_run_report(const RunRecord& record, const std::filesystem::path& calibration,
                            const std::vector<ReportPlot>& pictures) {
  Report report;
  report.title = "Camera " + record.camera + " on " + record.station;
  report.verdict = make_report_verdict(record);
  constexpr int digits = 4;
  for (const CheckedMetric& metric : record.metrics) {
    const std::string name = metric.name + ": " + describe_meaning(metric);
    if (metric.limit) {
      report.gates.push_back(metric);
      report.gates.back().name = name;
    } else if (metric.value) {
      report.metrics.push_back({name, format_digits(*metric.value, digits), metric.unit, ""});
    }
  }
  for (const auto& [step, image, sha256, refused] : record.images) {
    if (refused.empty()) continue;
    std::string where = step;
    report.rejections.push_back({where.append("/").append(image), refused});
  }
  report.properties = {{"run", record.run},
                       {"begun, ended (UTC)", record.begun_utc + ", " + record.ended_utc},
                       {"operator", record.operator_name},
                       {"shift", record.shift},
                       {"images", std::to_string(record.images.size()) + ", " +
                                      std::to_string(record.count_used_images()) + " used"}};
  std::erase_if(report.properties, [](const auto& fact) { return fact.second.empty(); });
  report.notes.push_back(record.program + "; " + record.libraries + "; station configuration " +
                         record.config_sha256 + ".");
  if (!calibration.empty()) report.calibration = read_calibration(calibration);
  report.plots = pictures;
  return render_report_html(report);
}

fs::path publish_run_files(const RunRecord& record, const std::vector<ReportPlot>& pictures,
                           const fs::path& results, ExistingReport existing) {
  const SharedFolder folder = open_run_results(record, results);
  fs::path calibration;
  if (!record.calibration.empty()) calibration = write_calibration(record, folder);
  const std::string name = find_voiding_event(record) ? "voided-report.html" : "report.html";
  const bool is_there = folder.contains(name);
  if (is_there && existing == ExistingReport::keep) return folder.folder_path();
  const std::string report = make_run_report(record, calibration, pictures);
  if (is_there && has_file_content(folder, name, report)) return folder.folder_path();
  // The first one is kept: those that a restoring has drawn can be drawn again.
  const std::string replaced = "replaced-" + name;
  if (is_there && !folder.contains(replaced)) folder.rename_file(name, replaced);
  folder.replace_file(name, report);
  return folder.folder_path();
}

}  // namespace vlp
