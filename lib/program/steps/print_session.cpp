// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "program/steps/print_session.h"

#include <fmt/core.h>

#include <array>
#include <cstdio>
#include <optional>

#include "evaluation/gate.h"
#include "program/steps/step_outcome.h"

namespace vlp {
namespace {

std::optional<double> find_session_metric_value(const SessionResult& result,
                                                const std::string& name) {
  for (const SessionStep& step : result.steps) {
    if (const auto value = find_metric_value(step.result.metrics, name)) return value;
  }
  return std::nullopt;
}

}  // namespace

SessionObserver SessionLog::make_observer() {
  return {[this](const std::string&) { step_start_ = Clock::now(); },
          [this](std::size_t done, std::size_t total) {
            if (!progress_) progress_ = std::make_unique<Progress>("images");
            progress_->update(done, total);
          },
          [this](const SessionStep& step) { print_step(step); }};
}

void SessionLog::print_step(const SessionStep& step) {
  progress_.reset();
  const double seconds = std::chrono::duration<double>(Clock::now() - step_start_).count();
  const bool missed = !describe_failed_gates(step.result.gates).empty();
  fmt::print("{:13} {}{}\n", step.name,
             step.is_up_to_date ? "up to date" : fmt::format("{:5.1f} s", seconds),
             step.result.has_succeeded() ? missed ? ", a gate is not met" : "" : ", failed");
  std::fflush(stdout);
  print_step_remarks(step.result);
}

void print_session(const SessionResult& result, const std::string& results) {
  struct MetricRow {
    const char *label, *metric, *unit;
  };
  constexpr std::array metric_rows{
      MetricRow{"residuals", "rms_px", "px rms, of the board's corners"},
      MetricRow{"tilt", "tilt_deg", "degrees"},
      MetricRow{"lever arm", "lever_arm_mm", "mm"},
      MetricRow{"dispersion", "dispersion_mm", "mm, before its correction"},
      MetricRow{"mean error", "mean_mm", "mm, horizontal"},
      MetricRow{"p90", "p90_mm", "mm"},
      MetricRow{"max", "max_mm", "mm"},
      MetricRow{"height", "height_rms_mm", "mm rms"},
      MetricRow{"missing", "missing_fraction", "fraction of the captures"}};
  fmt::print("\n");
  for (const auto& [label, name, unit] : metric_rows) {
    if (const auto value = find_session_metric_value(result, name))
      fmt::print("{:11} {:.4g} {}\n", label, *value, unit);
  }
  for (const CheckedMetric& gate : result.gates) {
    if (!gate.has_passed_gate()) fmt::print("NOT MET     {}\n", describe_gate(gate));
  }
  fmt::print("verdict     {}; results are in {}\n", verdict_text(result.verdict), results);
}

}  // namespace vlp
