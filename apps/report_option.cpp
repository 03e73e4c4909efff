// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report_option.h"

#include <filesystem>

#include "evaluation/report/evaluation_figures.h"
#include "evaluation/report/evaluation_pictures.h"
#include "evaluation/report/report.h"
#include "history.h"
#include "rig/input_error.h"

namespace vlp {
namespace {

void add_track(Report& report, const std::string& file, const CommandedLine& commanded_m) {
  const std::vector<FixRow> fixes = read_fixes(file);
  const auto fit = fit_line(fixes, commanded_m);
  if (!fit) throw InputError(file, "no line can be fitted to its fixes: they have no direction");
  const std::string name = std::filesystem::path(file).filename().string();
  const auto figures = report_figures(name, *fit);
  report.figures.insert(report.figures.end(), figures.begin(), figures.end());
  report.pictures.push_back(drive_picture(name, fixes, commanded_m, *fit));
}

}  // namespace

void add_report_options(CLI::App& app, ReportOption& option) {
  auto* report = app.add_option(
      "--report", option.file,
      "Write the report for people, one HTML file; with --lamps it shows them on the floor plan, "
      "with --calibration what that says");
  app.add_option("--picture", option.pictures,
                 "A picture for the report, .svg of --plot of vlp-intrinsics, vlp-rotation or "
                 "vlp-dispersion, or another; again for another")
      ->needs(report)
      ->allow_extra_args(false);
  app.add_option("--track", option.tracks,
                 "A drive for the report: fixes and the straight line commanded; again for another")
      ->needs(report)
      ->option_text("FIXES X0_M Y0_M X1_M Y1_M");
}

std::string report_of(const CLI::App& app, const ReportOption& option,
                      const ReportSubject& subject) {
  Report report;
  report.gates = subject.gates;
  report.caution = subject.caution;
  report.figures = report_figures(subject.evaluation);
  report.notes = report_notes(subject.evaluation);
  report.title = "Accuracy report: " + subject.input.fixes.file.filename().string();
  if (!subject.calibration.empty()) {
    report.calibration = read_calibration(subject.calibration);
    if (!report.calibration->camera.id.empty()) {
      report.title = "Accuracy report: " + report.calibration->camera.id;
    }
  }
  std::vector<std::string> inputs = subject.inputs;
  for (const auto& [file, x0_m, y0_m, x1_m, y1_m] : option.tracks) {
    add_track(report, file, {Eigen::Vector2d{x0_m, y0_m}, Eigen::Vector2d{x1_m, y1_m}});
    inputs.push_back(file);
  }
  for (const auto& picture : option.pictures) {
    report.pictures.push_back(read_report_picture(picture));
    inputs.push_back(picture);
  }
  const LampMap lamps = subject.lamps.empty() ? LampMap{} : read_lamp_map(subject.lamps);
  for (auto& picture : evaluation_pictures(subject.input, subject.evaluation, lamps)) {
    report.pictures.push_back(std::move(picture));
  }
  report.evaluation = history_entry(app, inputs);
  report.evaluation->part = "evaluation";
  return report_html(report);
}

}  // namespace vlp
