// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_figures.h"

#include <cmath>

#include "evaluation/sample_size_warnings.h"
#include "geometry/angles.h"
#include "report/plots/round_numbers.h"

namespace vlp {
namespace {

std::string number(double value) { return readable(value, 3); }

std::string between(double low, double high) { return number(low) + " to " + number(high); }

ReportFigure length(const std::string& label, double value_m,
                    const Interval* interval_m = nullptr) {
  return {label, readable_mm(value_m), "mm",
          interval_m == nullptr ? "" : between(1e3 * interval_m->low, 1e3 * interval_m->high)};
}

void add_horizontal(std::vector<ReportFigure>& figures, const Evaluation& evaluation) {
  const ErrorFigures& errors_m = evaluation.horizontal_m;
  const auto& intervals_m = evaluation.intervals_m;
  const auto line = [&](const char* name, double value_m, const Interval* interval_m) {
    figures.push_back(length(std::string("horizontal error, ") + name, value_m, interval_m));
  };
  const bool p90 = intervals_m && intervals_m->p90;
  line("mean", errors_m.mean, intervals_m ? &intervals_m->mean : nullptr);
  line("median", errors_m.median, intervals_m ? &intervals_m->median : nullptr);
  line("90th percentile", errors_m.p90, p90 ? &*intervals_m->p90 : nullptr);
  line("root mean square", errors_m.rms, intervals_m ? &intervals_m->rms : nullptr);
  figures.push_back(length("horizontal error, largest", errors_m.max));
}

std::string note_of(const Comparison& comparison) {
  std::string note = "Compared with the other fixes: " + comparison.words() + "; ";
  if (comparison.pairs > 0) {
    note += "the mean error is " + readable_mm(std::abs(comparison.mean_difference_m)) + " mm " +
            (comparison.mean_difference_m < 0 ? "smaller" : "larger") + " than theirs";
  }
  if (const auto& interval_m = comparison.interval_m) {
    note +=
        " (difference, 95 %: " + between(1e3 * interval_m->low, 1e3 * interval_m->high) + " mm)";
  }
  return note + (comparison.pairs > 0 ? "; " : "") + std::to_string(comparison.pairs) +
         " captures have a fix in both, " + std::to_string(comparison.only_these) + " only here, " +
         std::to_string(comparison.only_others) + " only there.";
}

}  // namespace

std::vector<ReportFigure> report_figures(const Evaluation& evaluation) {
  std::vector<ReportFigure> figures = {
      {"captures", std::to_string(evaluation.captures), "", ""},
      {"without a fix", std::to_string(evaluation.captures - evaluation.fixes), "", ""}};
  add_horizontal(figures, evaluation);
  if (const auto& height_m = evaluation.height_m) {
    figures.push_back(length("height error, root mean square", height_m->sizes.rms));
    figures.push_back(length("height error, mean", height_m->bias));
  }
  if (const auto& yaw_rad = evaluation.yaw_rad) {
    figures.push_back(
        {"yaw error, root mean square", number(deg_from_rad(yaw_rad->sizes.rms)), "degrees", ""});
  }
  if (const auto& stations = evaluation.stations) {
    const std::string of = " (" + std::to_string(stations->stations.size()) + " stations with " +
                           std::to_string(stations->fixes) + " fixes)";
    figures.push_back(length("bias of the stations, root mean square" + of, stations->bias_m));
    figures.push_back(length("scatter at a station" + of, stations->scatter_m));
  }
  if (evaluation.stated) {
    figures.push_back({"error over its stated deviation (1: right)",
                       number(evaluation.stated->horizontal), "", ""});
  }
  if (evaluation.limit) {
    figures.push_back(length("theoretical limit", evaluation.limit->limit_m));
    figures.push_back(
        {"error over the limit (1: the best)", number(evaluation.limit->horizontal), "", ""});
  }
  if (evaluation.fit) {
    const auto of_fit = report_figures("drive", *evaluation.fit);
    figures.insert(figures.end(), of_fit.begin(), of_fit.end());
  }
  return figures;
}

std::vector<std::string> report_notes(const Evaluation& evaluation) {
  std::vector<std::string> notes;
  const char* against = evaluation.against == "truth"  ? "from the true place, by image"
                        : evaluation.against == "path" ? "from the path driven"
                                                       : "from the commanded line";
  notes.push_back("Horizontal errors are distances " + std::string(against) + ".");
  std::string missing;
  for (const auto& [status, count] : evaluation.missing) {
    missing.append(missing.empty() ? "" : ", ").append(std::to_string(count) + " " + status);
  }
  if (!missing.empty()) notes.push_back("Captures without a fix: " + missing + ".");
  if (const auto& intervals = evaluation.intervals_m) {
    notes.push_back("The intervals are of a bootstrap over " + std::to_string(intervals->units) +
                    " " + evaluation.drawn + ".");
  }
  if (evaluation.comparison) notes.push_back(note_of(*evaluation.comparison));
  if (const std::string warning = warning_of_limit(evaluation); !warning.empty()) {
    notes.push_back("Caution: " + warning + ".");
  }
  for (const std::string& warning : sample_size_warnings(evaluation)) {
    notes.push_back("Caution: " + warning + ".");
  }
  return notes;
}

std::vector<ReportFigure> report_figures(const std::string& drive, const LineFit& fit) {
  return {length(drive + ": fitted line from the commanded one, mean", fit.distances_m.mean),
          length(drive + ": the same, 90th percentile", fit.distances_m.p90),
          length(drive + ": jitter across the fitted line, root mean square", fit.jitter_m)};
}

}  // namespace vlp
