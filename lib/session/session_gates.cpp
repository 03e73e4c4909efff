// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/session_gates.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include "lamps/signal/frequency_identification.h"
#include "session/lens_step.h"

namespace vlp {
namespace {

/// Steps whose metrics can have gates.
constexpr std::array<std::pair<MetricSource, std::string_view>, 4> kStepsOfMetrics{
    {{MetricSource::lens, "lens"},
     {MetricSource::rotation, "rotation"},
     {MetricSource::dispersion, "dispersion"},
     {MetricSource::evaluation, "evaluate"}}};

}  // namespace

std::vector<MetricKind> list_session_metrics() {
  return list_metric_kinds({MetricSource::lens, MetricSource::rotation, MetricSource::dispersion,
                            MetricSource::evaluation});
}

std::vector<Gate> read_session_gates(const SessionFolder& session, const SessionOptions& options) {
  std::vector<Gate> gates;
  if (!session.camera_calibration_path()) gates = make_lens_gates();
  const std::filesystem::path file = session.gates_file().value_or(options.gates_file);
  if (!file.empty())
    gates = merge_gates(std::move(gates), read_gates(file, list_session_metrics()));
  return options.strict ? merge_gates(std::move(gates), {{"warnings", 0}}) : gates;
}

std::vector<Gate> select_step_gates(const std::vector<Gate>& gates, std::string_view step) {
  std::vector<Gate> selected;
  for (const Gate& gate : gates) {
    const std::pair gated(find_metric_kind(gate.metric)->source, step);
    if (std::ranges::find(kStepsOfMetrics, gated) != kStepsOfMetrics.end())
      selected.push_back(gate);
  }
  return selected;
}

std::vector<Gate> make_step_gates(const std::vector<Metric>& metrics) {
  constexpr double max_reference_error_mm = 5;
  const auto exceeds_reference_error = [&](const char* error) {
    return find_metric_value(metrics, error).value_or(max_reference_error_mm) >=
           max_reference_error_mm;
  };
  std::vector<Gate> gates{{"row_time_error_percent", 100 * kLampDrift},
                          {"dispersion_offset_px", 3}};
  if (exceeds_reference_error("rms_mm")) gates.push_back({"normalized_error_rms", 3});
  if (exceeds_reference_error("height_rms_mm")) {
    gates.push_back({"normalized_height_error_rms", 5});
  }
  constexpr double max_yaw_error_deg = 5;  // of a heading that is set by hand
  if (find_metric_value(metrics, "yaw_rms_deg").value_or(max_yaw_error_deg) >= max_yaw_error_deg) {
    gates.push_back({"normalized_yaw_error_rms", 5});
  }
  std::erase_if(gates, [&](const Gate& gate) { return !find_metric_value(metrics, gate.metric); });
  return gates;
}

}  // namespace vlp
