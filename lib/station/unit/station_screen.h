// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/records/run_record.h"
#include "station/unit/unit.h"

namespace vlp {

/// How a line is to be shown, where there is colour.
enum class Tone { plain, heading, good, bad };

/// A line of at most 80 columns of ASCII.
struct ScreenLine {
  std::string text;
  Tone tone = Tone::plain;
};

/// What the operator of a station sees while a unit is worked on: the steps, what there is of the
/// present one, what to do next, and what became of the last image.
std::vector<ScreenLine> station_screen(const Unit& unit);

/// The same in one line, of the image that came last.
std::string last_image_line(const Unit& unit, StationStep step, const std::string& image);

/// hook_problem() with what to do; nothing when that is nothing.
std::vector<ScreenLine> hook_lines(const RunRecord& record);

/// Returns Spool::notice() as lines; no line if it is empty.
std::vector<ScreenLine> spool_lines(const std::string& notice);

/// The gates with figure and limit, the causes, the root first, and PASS, FAIL or INVALID, large.
std::vector<ScreenLine> verdict_screen(const RunRecord& record);

}  // namespace vlp
