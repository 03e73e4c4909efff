// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/station_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <sstream>
#include <vector>

#include "captures/printable.h"
#include "station/records/hook.h"
#include "station/unit/guidance.h"

namespace vlp {
namespace {

constexpr std::size_t kColumns = 80;

/// Adds a text in lines of the screen's width, the first one with a label.
void add_wrapped_lines(std::vector<ScreenLine>& lines, const std::string& label,
                       const std::string& text, ScreenLineStyle style) {
  std::istringstream words(text);
  std::string line = fmt::format("{:<9}", label), word;
  const std::size_t indent = line.size();
  while (words >> word) {
    if (line.size() > indent && line.size() + 1 + word.size() > kColumns) {
      lines.push_back({line, style});
      line = std::string(indent, ' ');
    }
    line += (line.size() > indent ? " " : "") + word;
  }
  lines.push_back({line.substr(0, kColumns), style});
}

/// Returns a problem as lines; no line if it is empty.
std::vector<ScreenLine> make_problem_lines(const std::string& label, const std::string& problem) {
  std::vector<ScreenLine> lines;
  if (!problem.empty()) add_wrapped_lines(lines, label, problem, ScreenLineStyle::fail);
  return lines;
}

std::string describe_outcome(const UnitImage& image) {
  if (!image.is_image_used()) return "refused: " + image.rejection_message();
  const std::string& doubt = image.observation.doubt;
  return doubt.empty() ? "taken" : "taken; " + doubt;
}

/// Returns the step of a unit's run that did not finish, with which its causes begin
/// (list_failure_causes()); std::nullopt if all did, and for golden units, whose steps are
/// optional. Metrics do not show it, because a failed step can have some.
std::optional<StationStep> find_unfinished_step(const RunRecord& record) {
  if (record.kind != "unit") return std::nullopt;
  std::istringstream causes(record.causes);
  for (std::string cause; std::getline(causes, cause);) {
    for (const StationStep step : kStationSteps) {
      const std::string name = station_step_name(step);
      if (cause.starts_with(name + ": ") || cause.starts_with(name + " (")) return step;
    }
  }
  return std::nullopt;
}

/// Describes the gates without a value and the reason: "20 gates, because boards did not finish";
/// their names if all steps finished. Returns an empty string if all gates have a value.
std::string describe_unmeasured(const RunRecord& record) {
  std::vector<std::string> names;
  for (const CheckedMetric& metric : record.metrics) {
    if (metric.limit && !metric.value) names.push_back(metric.name);
  }
  if (names.empty()) return "";
  const auto step = find_unfinished_step(record);
  if (!step) return fmt::format("{}", fmt::join(names, ", "));
  // [STATION-7] `did not finish` | step without result; gates without value | see the causes below
  //   it
  return fmt::format("{} {}, because {} did not finish", names.size(),
                     names.size() == 1 ? "gate" : "gates", station_step_name(*step));
}

ScreenLine make_gate_line(const CheckedMetric& metric) {
  const std::string value = metric.value ? fmt::format("{:.4g}", *metric.value) : "-";
  const std::string limit =
      fmt::format("{} {:.4g}",
                  metric.direction == Direction::at_least ? ">=" : "<=", metric.acceptance_limit());
  std::string outcome = metric.has_passed_gate() ? "met" : "NOT MET";
  if (const auto sure = metric.conformance_probability()) {
    outcome += fmt::format(", p {:.3f}", *sure);
  }
  return {
      fmt::format("{:<28}{:>12}{:>14} {:<4} {}", metric.name, value, limit, metric.unit, outcome),
      metric.has_passed_gate() ? ScreenLineStyle::plain : ScreenLineStyle::fail};
}

const std::array kPass{"  ####     #     ####    #### ", "  #   #   # #   #       #     ",
                       "  ####   #####   ###     ###  ", "  #      #   #      #       # ",
                       "  #      #   #  ####    ####  "};
const std::array kFail{"  #####    #     #####   #    ", "  #       # #      #     #    ",
                       "  ####   #####     #     #    ", "  #      #   #     #     #    ",
                       "  #      #   #   #####   #####"};

const std::array kInvalid{"  ###  #   #  #   #    #    #      ###  #### ",
                          "   #   ##  #  #   #   # #   #       #   #   #",
                          "   #   # # #  #   #  #####  #       #   #   #",
                          "   #   #  ##   # #   #   #  #       #   #   #",
                          "  ###  #   #    #    #   #  #####  ###  #### "};

}  // namespace

std::vector<ScreenLine> make_station_screen(const Unit& unit) {
  std::vector<ScreenLine> lines;
  lines.push_back({fmt::format("{}   camera {}", unit.station_config().station, unit.camera_id())
                       .substr(0, kColumns),
                   ScreenLineStyle::heading});
  const auto current = unit.first_incomplete();
  std::string steps;
  for (const StationStep step : kStationSteps) {
    const char* mark = unit.step_state(step).is_step_solved() ? "x" : step == current ? ">" : " ";
    steps +=
        fmt::format("[{}] {} {}   ", mark, station_step_name(step), format_image_count(unit, step));
  }
  lines.push_back({steps.substr(0, kColumns)});
  if (!unit.invalid_reason().empty()) {
    add_wrapped_lines(lines, "Station", unit.invalid_reason() + "; no unit passes",
                      ScreenLineStyle::fail);
  }
  lines.push_back({""});
  if (!current) return lines;
  const UnitStep& state = unit.step_state(*current);
  lines.push_back({station_step_name(*current), ScreenLineStyle::heading});
  for (std::string& line : describe_progress(unit, *current)) {
    lines.push_back({line.substr(0, kColumns)});
  }
  add_wrapped_lines(lines, "Next", describe_next_action(unit, *current), ScreenLineStyle::plain);
  if (const auto image = state.images.find(state.last_image); image != state.images.end()) {
    add_wrapped_lines(
        lines, "Last", image->first + ": " + describe_outcome(image->second),
        image->second.is_image_used() ? ScreenLineStyle::pass : ScreenLineStyle::fail);
  }
  for (const CheckedMetric& metric : unit.collect_metrics()) {
    // Blur of all current views: a few views can be misleading.
    const bool known = metric.value && metric.name != "blur_px";
    if (known && !metric.has_passed_gate())
      add_wrapped_lines(lines, "Fails", describe_failed_gate(metric), ScreenLineStyle::fail);
  }
  if (state.num_consecutive_rejections > 1) {
    add_wrapped_lines(
        lines, "Refused",
        fmt::format("{} in a row; after {} the run ends", state.num_consecutive_rejections,
                    unit.station_config().max_consecutive_rejections),
        ScreenLineStyle::fail);
  }
  return lines;
}

std::string describe_step_image(const Unit& unit, StationStep step, const std::string& image) {
  const auto& images = unit.step_state(step).images;
  const auto found = images.find(image);
  const std::string outcome =
      found == images.end() ? "waits for the step before" : describe_outcome(found->second);
  return fmt::format("{} {}: {} ({})", station_step_name(step), image, outcome,
                     format_image_count(unit, step));
}

std::vector<ScreenLine> make_notice_lines(const std::string& notice) {
  return make_problem_lines("Records", escape_for_terminal(notice));
}

std::vector<ScreenLine> make_hook_lines(const RunRecord& record) {
  const std::string problem = describe_pending_hook(record);
  return make_problem_lines("Hook",
                            problem.empty() ? "" : problem + "; 'vlp-station hook' runs it again");
}

std::vector<ScreenLine> make_verdict_screen(const RunRecord& record) {
  const std::string no_verdict = explain_void_verdict(record);
  const bool passed = record.has_run_passed() && no_verdict.empty();
  const ScreenLineStyle style = passed ? ScreenLineStyle::pass : ScreenLineStyle::fail;
  std::vector<ScreenLine> lines{
      {fmt::format("{:<28}{:>12}{:>14}", "gate", "value", "limit"), ScreenLineStyle::heading}};
  for (const CheckedMetric& metric : record.metrics) {
    if (metric.limit && metric.value) lines.push_back(make_gate_line(metric));
  }
  if (const std::string gates = describe_unmeasured(record); !gates.empty()) {
    add_wrapped_lines(lines, "Gates", "not measured: " + gates, ScreenLineStyle::plain);
  }
  std::istringstream causes(record.causes);
  if (!record.causes.empty()) lines.push_back({""});
  for (std::string cause; std::getline(causes, cause);) {
    add_wrapped_lines(lines, "Cause", cause, ScreenLineStyle::fail);
  }
  if (!no_verdict.empty()) add_wrapped_lines(lines, "Cause", no_verdict, ScreenLineStyle::fail);
  // Last, so that it is visible on a terminal of 24 lines.
  lines.push_back({""});
  const std::span<const char* const> banner = passed                        ? std::span(kPass)
                                              : record.is_verdict_invalid() ? std::span(kInvalid)
                                                                            : std::span(kFail);
  if (no_verdict.empty()) {
    for (const char* row : banner) lines.push_back({row, style});
  }
  lines.push_back({""});
  const std::string word = no_verdict.empty() ? record.verdict : "NO VERDICT";
  lines.push_back(
      {fmt::format("{}   camera {}   {}", word, record.camera, record.station).substr(0, kColumns),
       ScreenLineStyle::heading});
  return lines;
}

}  // namespace vlp
