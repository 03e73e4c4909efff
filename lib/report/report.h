// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "evaluation/gate.h"
#include "report/report_picture.h"
#include "rig/calibration.h"

namespace vlp {

/// A line of the table of figures, as it is to be read.
struct ReportFigure {
  /// For example "mean horizontal error", "0.0137", "mm", "0.0131 to 0.0143".
  std::string label, value, unit;
  /// Empty where there is none.
  std::string interval;
};

/// A verdict that was given elsewhere, and why.
struct ReportVerdict {
  std::string word;
  /// How the box looks.
  enum class Look { pass, fail, none } look = Look::none;
  /// The root first; empty when there is nothing to be said.
  std::vector<std::string> causes;
};

/// An image that was not used, and why.
struct ReportRefusal {
  std::string image, reason;
};

/// What a person at a calibration station gets to see. What is empty is left out.
struct Report {
  std::string title;
  /// Without gates there is no verdict, which the report says.
  std::vector<CheckedMetric> gates;
  std::vector<ReportFigure> figures;
  /// Sentences below the figures: how they were come by, what is missing.
  std::vector<std::string> notes;
  std::optional<Calibration> calibration;
  /// In any order; those of one part stay in theirs.
  std::vector<ReportPicture> pictures;
  /// How the figures were made; part "evaluation".
  std::optional<HistoryEntry> evaluation;
  /// What the verdict does not see, said beside it; for example of captures without a fix.
  std::string caution = {};
  /// In place of the gates' own; a gate without a figure was then not reached.
  std::optional<ReportVerdict> verdict = {};
  std::vector<ReportRefusal> refused = {};
  /// Label and value of what identifies the measurement, shown below the verdict: who, when.
  std::vector<std::pair<std::string, std::string>> facts = {};
};

/// One HTML page that needs nothing else: style and pictures are inside, there is no script.
/// Verdict, facts, fixes on the floor, gates, figures, camera, rotation centre, dispersion,
/// distribution, tracks, refused images, history; for a screen, a phone and A4 paper. Same report,
/// same bytes.
std::string report_html(const Report& report);

}  // namespace vlp
