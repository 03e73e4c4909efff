// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/lamp_map.h"

namespace vlp {

/// A light whose stripe period was measured.
struct MeasuredPeriod {
  double period_lines;
  /// The lamp that it is of, where somebody says so.
  std::optional<int> lamp;
};

struct RowTime {
  double row_time_s;
  /// Standard deviation, from the scatter of the lamps about their frequencies, of the lights
  /// about their lamps, and half a thousandth, by which all measured periods may be off together.
  /// Of one lamp alone the error of its frequency comes on top.
  double sd_s;
  /// Lamps that it rests on, and lights of them.
  int lamps, lights;
};

/// The row time, or why there is none and what to add.
struct RowTimeResult {
  std::optional<RowTime> found;
  std::string problem;
};

/// The row time from lights of lamps whose frequencies the map knows: a lamp of frequency f has a
/// period of 1 / (f row_time) lines (lib/THEORY.md, "Identity"), so that for lamp k of light i
///
///     log row_time = -log period_i - log f_k.
///
/// Lights of one lamp, or of one period, are made one by their median. Which lamp an unlabelled
/// one is of is not known: of the row times that put some lamp's frequency to some period the one
/// stands for which the sum over the periods of
///
///     min over lamps of log(1 + r^2 / s^2),   r the residual above, s^2 = sd^2 + 0.003^2,
///
/// is least, where a lamp serves for one period, and a residual beyond 6 % counts as 6 %: a lamp
/// that is off its frequency, or another light, misleads it little. Iterated least squares with the
/// weights of that sum refine it. There is no answer when another row time explains the periods
/// nearly as well (the sum is larger by less than 4), as when all ratios of frequencies are equal,
/// or when less than half of the periods are explained.
RowTimeResult estimate_row_time(std::span<const MeasuredPeriod> lights, const LampMap& lamps);

}  // namespace vlp
