// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_figures.h"

#include <cmath>

#include "evaluation/sample_size_warnings.h"
#include "geometry/angles.h"
#include "report/plots/plot_parts.h"

namespace vlp {
namespace {

std::string format_number(double value) { return format_number_for_humans(value, 3); }

std::string format_range(double low, double high) {
  return format_number(low) + " to " + format_number(high);
}

ReportStatistic make_length_statistic(const std::string& label, double value_m,
                                      const Interval* interval_m = nullptr) {
  return {label, format_mm(value_m), "mm",
          interval_m == nullptr ? "" : format_range(1e3 * interval_m->low, 1e3 * interval_m->high)};
}

void add_horizontal_statistics(std::vector<ReportStatistic>& figures,
                               const Evaluation& evaluation) {
  const ErrorStatistics& errors_m = evaluation.horizontal_m;
  const auto& intervals_m = evaluation.intervals_m;
  const auto add_row = [&](const char* name, double value_m, const Interval* interval_m) {
    figures.push_back(
        make_length_statistic(std::string("horizontal error, ") + name, value_m, interval_m));
  };
  const bool p90 = intervals_m && intervals_m->p90;
  add_row("mean", errors_m.mean, intervals_m ? &intervals_m->mean : nullptr);
  add_row("median", errors_m.median, intervals_m ? &intervals_m->median : nullptr);
  add_row("90th percentile", errors_m.p90, p90 ? &*intervals_m->p90 : nullptr);
  add_row("root mean square", errors_m.rms, intervals_m ? &intervals_m->rms : nullptr);
  figures.push_back(make_length_statistic("horizontal error, largest", errors_m.max));
}

std::string describe_comparison(const Comparison& comparison) {
  std::string note = "Compared with the other fixes: ";
  for (std::size_t i = 0; const ComparedQuantity& quantity : list_compared_quantities()) {
    const QuantityComparison& compared = comparison.quantities[i++];
    if (compared.pairs == 0 && i > 1) continue;
    const double factor = quantity.units_per_si;
    const std::string unit = *quantity.unit == 0 ? "" : std::string(" ") + quantity.unit;
    note.append(quantity.name).append(" ").append(compared.describe_result(quantity));
    if (compared.pairs > 0) {
      note += ", the mean is " + format_number(factor * std::abs(compared.mean_difference)) + unit +
              (compared.mean_difference < 0 ? " smaller" : " larger") + " than theirs";
    }
    if (const auto& interval = compared.interval) {
      note +=
          " (difference, 95 %: " + format_range(factor * interval->low, factor * interval->high) +
          unit + ")";
    }
    note += "; ";
  }
  return note + std::to_string(comparison.pairs) + " captures have a fix in both, " +
         std::to_string(comparison.only_in_fixes) + " only in these fixes, " +
         std::to_string(comparison.only_in_other_fixes) + " only in the others.";
}

}  // namespace

std::vector<ReportStatistic> list_statistics(const Evaluation& evaluation) {
  std::vector<ReportStatistic> figures = {
      {"captures", std::to_string(evaluation.captures), "", ""},
      {"without a fix", std::to_string(evaluation.captures - evaluation.fixes), "", ""}};
  add_horizontal_statistics(figures, evaluation);
  if (const auto& height_m = evaluation.height_m) {
    figures.push_back(
        make_length_statistic("height error, root mean square", height_m->magnitudes.rms));
    figures.push_back(make_length_statistic("height error, mean", height_m->bias));
  }
  if (const auto& yaw_rad = evaluation.yaw_rad) {
    figures.push_back({"yaw error, root mean square",
                       format_number(deg_from_rad(yaw_rad->magnitudes.rms)), "degrees", ""});
  }
  if (const auto& stations = evaluation.bias_and_repeatability) {
    const std::string of = " (" + std::to_string(stations->reference_points.size()) +
                           " reference points with " + std::to_string(stations->fixes) + " fixes)";
    figures.push_back(make_length_statistic("bias of the reference points, root mean square" + of,
                                            stations->bias_m));
    figures.push_back(make_length_statistic("repeatability at a reference point" + of,
                                            stations->repeatability_m));
  }
  if (evaluation.normalized_errors) {
    figures.push_back({"error / reported standard deviation (1: correct)",
                       format_number(evaluation.normalized_errors->horizontal.rms), "", ""});
  }
  if (evaluation.crlb_ratio) {
    figures.push_back(make_length_statistic("theoretical limit", evaluation.crlb_ratio->crlb_m));
    figures.push_back({"error / theoretical limit (1: optimal)",
                       format_number(evaluation.crlb_ratio->horizontal), "", ""});
  }
  if (evaluation.line_fit) {
    const auto fit_statistics = list_drive_statistics("drive", *evaluation.line_fit);
    figures.insert(figures.end(), fit_statistics.begin(), fit_statistics.end());
  }
  return figures;
}

std::vector<std::string> make_evaluation_notes(const Evaluation& evaluation) {
  std::vector<std::string> notes;
  const char* reference = evaluation.reference == "truth"  ? "from the true place, by image"
                          : evaluation.reference == "path" ? "from the path driven"
                                                           : "from the commanded line";
  notes.push_back("Horizontal errors are distances " + std::string(reference) + ".");
  std::string missing;
  for (const auto& [status, count] : evaluation.failures_by_status) {
    missing.append(missing.empty() ? "" : ", ").append(std::to_string(count) + " " + status);
  }
  if (!missing.empty()) notes.push_back("Captures without a fix: " + missing + ".");
  if (const auto& intervals = evaluation.intervals_m) {
    notes.push_back("The intervals are of a bootstrap over " + std::to_string(intervals->clusters) +
                    " " + evaluation.resampling_unit + ".");
  }
  if (evaluation.comparison) notes.push_back(describe_comparison(*evaluation.comparison));
  if (const std::string warning = warn_about_crlb(evaluation); !warning.empty()) {
    notes.push_back("Caution: " + warning + ".");
  }
  for (const std::string& warning : warn_about_sample_size(evaluation)) {
    notes.push_back("Caution: " + warning + ".");
  }
  return notes;
}

std::vector<ReportStatistic> list_drive_statistics(const std::string& drive, const LineFit& fit) {
  return {make_length_statistic(drive + ": fitted line from the commanded one, mean",
                                fit.distances_m.mean),
          make_length_statistic(drive + ": the same, 90th percentile", fit.distances_m.p90),
          make_length_statistic(drive + ": jitter across the fitted line, root mean square",
                                fit.jitter_m)};
}

}  // namespace vlp
