// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit_report.h"

#include <algorithm>
#include <sstream>

#include "captures/csv_writer.h"
#include "report/report.h"

namespace vlp {
namespace {

std::string meaning_of(const CheckedMetric& figure) {
  const auto kind = metric_kind(figure.name);
  return kind ? kind->meaning : "a figure of another version of the program";
}

}  // namespace

std::string unit_report(const RunRecord& record, const std::filesystem::path& calibration,
                        const std::vector<ReportPicture>& pictures) {
  Report report;
  report.title = "Camera " + record.camera + " on " + record.station;
  std::istringstream causes(record.causes);
  for (std::string cause; std::getline(causes, cause);) report.notes.push_back("Cause: " + cause);
  const auto faults = static_cast<double>(report.notes.size());
  report.gates.push_back({"causes to fail", "", faults, 0, Direction::at_most});
  constexpr int digits = 4;
  for (const CheckedMetric& figure : record.figures) {
    if (figure.limit) report.gates.push_back(figure);
    if (!figure.value) continue;
    report.figures.push_back({figure.name + ": " + meaning_of(figure),
                              significant(*figure.value, digits), figure.unit, ""});
  }
  const auto used = std::count_if(record.images.begin(), record.images.end(),
                                  [](const auto& image) { return image.refused.empty(); });
  report.notes.push_back("Run " + record.run + ", ended " + record.ended_utc + "; " +
                         record.program + "; " + record.libraries + "; station configuration " +
                         record.config_sha256 + "; " + std::to_string(used) + " of " +
                         std::to_string(record.images.size()) + " images used.");
  if (!calibration.empty()) report.calibration = read_calibration(calibration);
  report.pictures = pictures;
  return report_html(report);
}

}  // namespace vlp
