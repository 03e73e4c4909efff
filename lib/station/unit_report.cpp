// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit_report.h"

#include <algorithm>
#include <limits>
#include <sstream>

#include "captures/csv_writer.h"
#include "evaluation/report/report.h"

namespace vlp {
namespace {

FigureKind kind_of(const StationFigure& figure) {
  for (const FigureKind& kind : station_figures()) {
    if (figure.name == kind.name) return kind;
  }
  return {"", "", figure.at_least, "", "a figure of another version of the program"};
}

/// The report's gates are limits from above: of a share that should be large, what is missing.
GateResult gate_of(const StationFigure& figure) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const double value = figure.value.value_or(none), limit = *figure.limit;
  if (figure.at_least) {
    return {figure.name + ", what is missing", "", 1 - value, 1 - limit, figure.met()};
  }
  return {figure.name, kind_of(figure).unit, value, limit, figure.met()};
}

}  // namespace

std::string unit_report(const RunRecord& record, const std::filesystem::path& calibration,
                        const std::vector<ReportPicture>& pictures) {
  Report report;
  report.title = "Camera " + record.camera + " on " + record.station;
  std::istringstream causes(record.causes);
  for (std::string cause; std::getline(causes, cause);) report.notes.push_back("Cause: " + cause);
  const auto faults = static_cast<double>(report.notes.size());
  report.gates.push_back({"causes to fail", "", faults, 0, record.passed()});
  constexpr int digits = 4;
  for (const StationFigure& figure : record.figures) {
    if (figure.limit) report.gates.push_back(gate_of(figure));
    if (!figure.value) continue;
    const FigureKind kind = kind_of(figure);
    report.figures.push_back(
        {figure.name + ": " + kind.meaning, significant(*figure.value, digits), kind.unit, ""});
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
