// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace vlp {

/// Who measures a metric.
enum class MetricSource {
  /// Of a unit's images, against the camera's type and the known points.
  station,
  /// The steps of the procedure.
  lens,
  rotation,
  dispersion,
  /// Errors of fixes.
  evaluation,
  /// Errors of fixes, too, held against a line, the theoretical limit or other fixes.
  reference
};

/// What a gate of a metric asks.
enum class Direction { at_most, at_least };

/// "at most" or "at least".
std::string words_of(Direction asked);

/// A figure that is measured, and that a gate can be of.
struct MetricKind {
  const char* name;
  /// Of its values and limits: "mm", "px", "deg", "%"; empty of a share, from 0 to 1, or a ratio.
  const char* unit;
  MetricSource source;
  /// What it is, and what it needs.
  const char* meaning;
  /// What it means when its gate is not met, for people: "the lens is decentred".
  const char* cause;
  Direction asked = Direction::at_most;
  /// That a limit can be: 1 of a share.
  double largest = 1e6;
  /// Whether it tells of the camera; otherwise of what it was measured with, or how.
  bool of_camera = true;
};

/// Those of some sources; what explains others comes before them.
std::vector<MetricKind> metric_kinds(std::initializer_list<MetricSource> sources);

/// The one of this name, which no two have; nothing when there is none.
std::optional<MetricKind> metric_kind(const std::string& name);

/// A metric that was measured.
struct Metric {
  std::string name;
  double value;
};

/// Nothing where it was not measured, or is not finite.
std::optional<double> value_of(const std::vector<Metric>& metrics, const std::string& name);

}  // namespace vlp
