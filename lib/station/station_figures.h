// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "session/step_result.h"
#include "station/station_config.h"

namespace vlp {

/// A figure that the station measures of each unit, and that may be a gate.
struct FigureKind {
  const char* name;
  const char* unit;
  /// A gate wants so much at least; otherwise at most.
  bool at_least;
  /// What a gate not met means, for people: "the lens is decentred".
  const char* cause;
  /// What the figure is.
  const char* meaning;
};

/// All of them, in the order of the steps; what explains others comes before them.
std::span<const FigureKind> station_figures();

/// One of them, measured; no value where the step did not come to it.
struct StationFigure {
  std::string name;
  std::optional<double> value;
  /// Nothing when it is no gate.
  std::optional<double> limit;
  bool at_least;

  /// A gate without a value is not met.
  bool met() const;
};

/// The figures in their order with the limits of the gates; `values` are by name.
std::vector<StationFigure> with_gates(std::span<const Metric> values,
                                      std::span<const StationGate> gates);

/// One line: what a gate that is not met means, its figure and limit.
std::string cause_of(const StationFigure& figure);

}  // namespace vlp
