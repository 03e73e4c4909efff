// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/unit_report.h"

#include <algorithm>
#include <sstream>

#include "captures/number_text.h"
#include "report/report.h"

namespace vlp {
namespace {

ReportVerdict make_verdict_box(const RunRecord& record) {
  using Look = ReportVerdict::Look;
  const std::string no_verdict = find_verdict_problem(record);
  ReportVerdict verdict{record.verdict,
                        record.passed()    ? Look::pass
                        : record.invalid() ? Look::none
                                           : Look::fail,
                        {}};
  if (!no_verdict.empty()) verdict = {"NO VERDICT", Look::none, {no_verdict}};
  std::istringstream causes(record.causes);
  for (std::string cause; std::getline(causes, cause);) verdict.causes.push_back(cause);
  return verdict;
}

std::string describe_meaning(const CheckedMetric& metric) {
  const auto kind = metric_kind(metric.name);
  return kind ? kind->meaning : "a figure of another version of the program";
}

}  // namespace

std::string make_unit_report(const RunRecord& record, const std::filesystem::path& calibration,
                             const std::vector<ReportPlot>& pictures) {
  Report report;
  report.title = "Camera " + record.camera + " on " + record.station;
  report.verdict = make_verdict_box(record);
  constexpr int digits = 4;
  for (const CheckedMetric& metric : record.metrics) {
    const std::string name = metric.name + ": " + describe_meaning(metric);
    if (metric.limit) {
      report.gates.push_back(metric);
      report.gates.back().name = name;
    } else if (metric.value) {
      report.metrics.push_back({name, significant(*metric.value, digits), metric.unit, ""});
    }
  }
  for (const auto& [step, image, sha256, refused] : record.images) {
    if (refused.empty()) continue;
    std::string where = step;
    report.refused.push_back({where.append("/").append(image), refused});
  }
  const auto used = std::count_if(record.images.begin(), record.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  report.facts = {
      {"run", record.run},
      {"begun, ended (UTC)", record.begun_utc + ", " + record.ended_utc},
      {"operator", record.operator_name},
      {"shift", record.shift},
      {"images", std::to_string(record.images.size()) + ", " + std::to_string(used) + " used"}};
  std::erase_if(report.facts, [](const auto& fact) { return fact.second.empty(); });
  report.notes.push_back(record.program + "; " + record.libraries + "; station configuration " +
                         record.config_sha256 + ".");
  if (!calibration.empty()) report.calibration = read_calibration(calibration);
  report.pictures = pictures;
  return report_html(report);
}

}  // namespace vlp
