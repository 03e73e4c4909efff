// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Calibration step or comparison that measures a metric.
enum class MetricSource {
  /// Metrics of the station alone: blur, differences from the nominal lens of the camera type, and
  /// errors at the known points.
  station,
  /// Metrics of the calibration steps lens, rotation and dispersion.
  lens,
  rotation,
  dispersion,
  /// Errors of fixes against ground truth.
  evaluation,
  /// Errors of fixes against a line, the theoretical limit or other fixes.
  reference
};

/// Direction of a limit: the metric has to be at most, or at least, the limit.
enum class Direction { at_most, at_least };

/// Returns "at most" or "at least".
std::string describe_direction(Direction direction);

/// Metric that can be measured and that a gate may limit.
struct MetricKind {
  const char* name;
  /// Unit of values and limits, for example "mm", "px", "deg", "%", "cycles/px"; empty for a
  /// fraction (0 to 1), a ratio or a number.
  const char* unit;
  MetricSource source;
  /// Description of the metric, and the data that it requires, human-readable.
  const char* description;
  /// Probable cause of a failed gate, for humans: "the lens is decentered".
  const char* cause;
  Direction direction = Direction::at_most;
  /// Largest limit that a gate of this metric may have; 1 for a fraction.
  double max_limit = 1e6;
  /// True for a property of the camera; false for one of the equipment or the procedure.
  bool is_camera_property = true;
};

/// Returns the metrics of these sources, causes before effects.
std::vector<MetricKind> list_metric_kinds(std::initializer_list<MetricSource> sources);

/// Returns the metric of this unique name; std::nullopt if there is none.
std::optional<MetricKind> find_metric_kind(const std::string& name);

/// Measured metric.
struct Metric {
  std::string name;
  double value;
  /// Lower limit of the 95 % interval of the value, if its gate applies to that limit.
  std::optional<double> interval_low = {};
};

/// Returns the value of a metric; std::nullopt if it was not measured or is not finite.
std::optional<double> find_metric_value(const std::vector<Metric>& metrics,
                                        const std::string& name);

}  // namespace vlp
