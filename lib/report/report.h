// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/gate.h"
#include "evaluation/verdict.h"
#include "report/report_picture.h"
#include "rig/calibration.h"

namespace vlp {

/// Row of the table of statistics, formatted.
struct ReportStatistic {
  /// Texts of the row, for example "mean horizontal error", "0.0137", "mm". `value` is formatted in
  /// the unit `unit`.
  std::string label, value, unit;
  /// Confidence interval; empty if there is none.
  std::string interval;
};

/// Verdict of another program, with its causes.
struct ReportVerdict {
  std::string word;
  /// Determines the style of the verdict box; `invalid` also for a verdict that is not valid.
  Verdict style = Verdict::invalid;
  /// Causes, the root cause first; may be empty.
  std::vector<std::string> causes;
};

/// Rejected image and the reason.
struct ReportRejection {
  std::string image, reason;
};

/// Content of a report for the operator of a calibration station. Empty parts are omitted.
struct Report {
  std::string title;
  /// Gates; without gates the report states that there is no verdict.
  std::vector<CheckedMetric> gates;
  std::vector<ReportStatistic> metrics;
  /// Sentences below the statistics: methods and missing data.
  std::vector<std::string> notes;
  std::optional<Calibration> calibration;
  /// Plots in any order. Plots of the same part keep their order.
  std::vector<ReportPlot> plots;
  /// Provenance of the statistics; its part is "evaluation".
  std::optional<HistoryEntry> evaluation;
  /// Caution inside the verdict box about an issue that the verdict does not cover, for example
  /// captures without a fix.
  std::string caution = {};
  /// Verdict that replaces the verdict of the gates. A gate without a value then counts as not
  /// reached.
  std::optional<ReportVerdict> verdict = {};
  std::vector<ReportRejection> rejections = {};
  /// Label and value of the data that identify the measurement, such as operator and time, shown
  /// below the verdict.
  std::vector<std::pair<std::string, std::string>> properties = {};
};

/// Renders a report as one self-contained HTML page with embedded style and images, without
/// scripts.
///
/// Order: verdict, facts, fixes on the floor, gates, statistics, camera, rotation center,
/// dispersion, distribution, tracks, other plots, rejected images, history. Laid out for a screen,
/// a phone and A4 paper. The same report yields the same bytes.
std::string render_report_html(const Report& report);

}  // namespace vlp
