// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report.h"

#include <algorithm>
#include <array>

#include "captures/number_text.h"
#include "report/calibration_sections.h"
#include "report/html.h"

namespace vlp {
namespace {

/// No-break space, which keeps a unit next to its number.
const std::string kSpace = "\u00a0";

std::string append_unit(const std::string& text, const std::string& unit) {
  return text.empty() || unit.empty() ? text : text + kSpace + unit;
}

std::string format_quantity(const std::optional<double>& value, const std::string& unit) {
  return value ? append_unit(format_digits(*value, 4), unit) : "none";
}

std::vector<std::string> make_gate_row(const CheckedMetric& gate, bool may_be_out_of_reach) {
  const bool out_of_reach = may_be_out_of_reach && !gate.value;
  const std::string result = gate.has_passed_gate() ? "met"
                             : out_of_reach         ? "not\u00a0reached"
                                                    : "NOT\u00a0MET";
  const auto sure = gate.conformance_probability();
  return {gate.name, format_quantity(gate.value, gate.unit),
          describe_direction(gate.direction) + kSpace + format_quantity(gate.limit, gate.unit) +
              describe_guard_band(gate),
          result + (sure ? ", conforms with p\u00a0=\u00a0" + format_digits(*sure, 3) : "")};
}

std::string make_gates_table(const Report& report) {
  HtmlTable table{"", {"gate", "value", "limit", "result"}, {}};
  for (const auto& gate : report.gates) {
    const bool given = report.verdict.has_value();
    if (!gate.has_passed_gate() && (gate.value || !given))
      table.highlighted_rows.push_back(table.rows.size());
    table.rows.push_back(make_gate_row(gate, given));
  }
  return table.rows.empty() ? "" : make_html_table(table);
}

std::string make_verdict_box(Verdict style, const std::string& word, const std::string& content) {
  constexpr std::array looks{"pass", "fail", "none"};
  const char* look = looks[static_cast<std::size_t>(style)];
  return std::string("<div class=\"verdict ") + look + "\"><strong>" + escape_html_text(word) +
         "</strong>" + content + "</div>\n";
}

std::string format_verdict(const ReportVerdict& verdict) {
  std::string causes;
  for (const std::string& cause : verdict.causes) causes += make_html_element("p", cause);
  return make_verdict_box(verdict.style, verdict.word, causes);
}

std::string format_gate_verdict(const std::vector<CheckedMetric>& gates,
                                const std::string& caution) {
  if (gates.empty()) {
    return make_verdict_box(Verdict::invalid, "NO VERDICT", "No gates were set.");
  }
  const auto missed = std::count_if(gates.begin(), gates.end(),
                                    [](const auto& gate) { return !gate.has_passed_gate(); });
  const std::string count = std::to_string(gates.size());
  const std::string of_gates = gates.size() == 1 ? " gate" : " gates";
  const std::string reason = missed == 0
                                 ? "Every metric is within its limit (" + count + of_gates + ")."
                                 : std::to_string(missed) + " of " + count + of_gates +
                                       (missed == 1 ? " is" : " are") + " not met.";
  const Verdict verdict = missed == 0 ? Verdict::pass : Verdict::fail;
  return make_verdict_box(verdict, verdict_name(verdict),
                          reason + (caution.empty() ? "" : make_html_element("p", caution)));
}

std::string format_report_verdict(const Report& report) {
  return report.verdict ? format_verdict(*report.verdict)
                        : format_gate_verdict(report.gates, report.caution);
}

std::string make_facts_table(const Report& report) {
  HtmlTable table{"", {}, {}};
  for (const auto& [label, value] : report.properties) table.rows.push_back({label, value});
  return table.rows.empty() ? "" : make_html_table(table);
}

std::string format_rejected_images(const Report& report) {
  if (report.rejections.empty()) return "";
  HtmlTable table{"", {"image", "why it was not used"}, {}};
  for (const auto& [image, reason] : report.rejections) table.rows.push_back({image, reason});
  return make_html_table(table);
}

std::string format_statistics(const Report& report) {
  std::string html;
  if (!report.metrics.empty()) {
    const bool intervals = std::any_of(report.metrics.begin(), report.metrics.end(),
                                       [](const auto& figure) { return !figure.interval.empty(); });
    HtmlTable table{"", {"metric", "value"}, {}};
    if (intervals) table.header.emplace_back("95 % confidence interval");
    for (const auto& [label, value, unit, interval] : report.metrics) {
      table.rows.push_back({label, append_unit(value, unit)});
      if (intervals) table.rows.back().push_back(append_unit(interval, unit));
    }
    html += make_html_table(table);
  }
  for (const auto& note : report.notes) html += make_html_element("p", note);
  return html;
}

std::string format_plots(const Report& report, ReportPart part) {
  std::string html;
  for (const auto& picture : report.plots) {
    if (picture.part == part) html += make_html_figure(picture);
  }
  return html;
}

std::string format_history(const Report& report) {
  std::vector<HistoryEntry> entries;
  if (report.calibration) entries = report.calibration->history;
  if (report.evaluation) entries.push_back(*report.evaluation);
  return make_history_list(entries);
}

}  // namespace

std::string render_report_html(const Report& report) {
  std::string camera, rotation, dispersion;
  if (const auto& calibration = report.calibration) {
    camera = make_camera_table(calibration->camera);
    if (calibration->intrinsics_report)
      camera += make_intrinsics_table(*calibration->intrinsics_report);
    if (calibration->rotation_center) rotation = make_rotation_table(*calibration);
    if (calibration->dispersion) dispersion = make_dispersion_table(*calibration);
  }
  const auto pictures = [&](ReportPart part) { return format_plots(report, part); };
  return make_html_page(
      report.title,
      format_report_verdict(report) + make_facts_table(report) +
          make_html_section("Fixes on the floor", pictures(ReportPart::floor)) +
          make_html_section("Gates", make_gates_table(report)) +
          make_html_section("Figures", format_statistics(report)) +
          make_html_section("Camera", camera + pictures(ReportPart::camera)) +
          make_html_section("Rotation center", rotation + pictures(ReportPart::rotation)) +
          make_html_section("Dispersion", dispersion + pictures(ReportPart::dispersion)) +
          make_html_section("Distribution of the errors", pictures(ReportPart::distribution)) +
          make_html_section("Moving tracks", pictures(ReportPart::tracks)) +
          make_html_section("More pictures", pictures(ReportPart::other)) +
          make_html_section("Images that were not used", format_rejected_images(report)) +
          make_html_section("History", format_history(report)));
}

}  // namespace vlp
