// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "station/records/run_record.h"
#include "station/unit/unit.h"

namespace vlp {

/// Style of a line on terminals with color.
enum class ScreenLineStyle { plain, heading, pass, fail };

/// Line of the operator's screen: text of at most 80 ASCII characters, and style.
struct ScreenLine {
  std::string text;
  ScreenLineStyle style = ScreenLineStyle::plain;
};

/// Returns the operator's screen while a unit is processed: the steps, progress of the current
/// step, the next instruction, and the result of the last image.
std::vector<ScreenLine> make_station_screen(const Unit& unit);

/// Returns the result of an image of a step, in one line.
std::string describe_step_image(const Unit& unit, StationStep step, const std::string& image);

/// Returns describe_pending_hook() with its remedy as lines; no line if it is empty.
std::vector<ScreenLine> make_hook_lines(const RunRecord& record);

/// Returns Spool::make_operator_notice() as lines; no line if it is empty.
std::vector<ScreenLine> make_notice_lines(const std::string& notice);

/// Returns the screen of a verdict: gates with value and limit, causes, the primary one first, and
/// PASS, FAIL or INVALID in large letters.
std::vector<ScreenLine> make_verdict_screen(const RunRecord& record);

}  // namespace vlp
