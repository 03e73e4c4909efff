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

std::optional<double> find(const SessionResult& result, const std::string& name) {
  for (const SessionStep& step : result.steps) {
    if (const auto value = value_of(step.result.metrics, name)) return value;
  }
  return std::nullopt;
}

}  // namespace

SessionObserver SessionLog::observer() {
  return {[this](const std::string&) { begin_ = Clock::now(); },
          [this](std::size_t done, std::size_t total) {
            if (!progress_) progress_ = std::make_unique<Progress>("images");
            progress_->update(done, total);
          },
          [this](const SessionStep& step) { ended(step); }};
}

void SessionLog::ended(const SessionStep& step) {
  progress_.reset();
  const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  const bool missed = !words_of_missed(step.result.gates).empty();
  fmt::print("{:13} {}{}\n", step.name,
             step.as_before ? "as before" : fmt::format("{:5.1f} s", seconds),
             step.result.ok() ? missed ? ", a gate is not met" : "" : ", failed");
  std::fflush(stdout);
  tell(step.result);
}

void print_session(const SessionResult& result, const std::string& results) {
  struct Shown {
    const char *label, *metric, *unit;
  };
  constexpr std::array shown{Shown{"residuals", "rms_px", "px rms, of the board's corners"},
                             Shown{"tilt", "tilt_deg", "degrees"},
                             Shown{"lever arm", "lever_arm_mm", "mm"},
                             Shown{"dispersion", "dispersion_mm", "mm, before it is taken off"},
                             Shown{"mean error", "mean_mm", "mm, horizontal"},
                             Shown{"p90", "p90_mm", "mm"},
                             Shown{"max", "max_mm", "mm"},
                             Shown{"height", "height_rms_mm", "mm rms"},
                             Shown{"missing", "missing", "of the captures, as a share"}};
  fmt::print("\n");
  for (const auto& [label, name, unit] : shown) {
    if (const auto value = find(result, name)) fmt::print("{:11} {:.4g} {}\n", label, *value, unit);
  }
  for (const CheckedMetric& gate : result.gates) {
    if (!gate.met()) fmt::print("NOT MET     {}\n", words_of(gate));
  }
  fmt::print("verdict     {}; results are in {}\n", name_of(result.verdict), results);
}

}  // namespace vlp
