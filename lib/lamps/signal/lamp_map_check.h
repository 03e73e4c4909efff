// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rig/calibration.h"
#include "rig/lamp_map_file.h"

namespace vlp {

/// Conditions that determine how accurately a stripe period can be measured.
struct StripeConditions {
  double row_time_s;
  /// Focal length in pixels, along the direction across the lines.
  std::optional<double> focal_px;
  /// Height of the camera above the world's origin.
  double camera_height_m;
  /// Exposure; if unknown, it is assumed to be short, the worst case for a period.
  std::optional<double> exposure_s;
};

/// Computes the number of lines of the image on the lamp, of which kUsedHeight are used: size focal
/// / height above the camera, with the shorter axis of the lamp, which crosses the lines at worst.
/// Returns std::nullopt without a size or a focal length, or if the lamp is not above the camera.
std::optional<double> lines_on(const Lamp& lamp, const StripeConditions& conditions);

/// Relative standard deviation of the period that stripes_of() measures on so many lines. A period
/// comes from the least-squares line through the numbered begins and through the numbered ends of
/// stripes, M = lines / period of each:
///
///     sd(period) / period = (e / period) sqrt(6 / (M (M^2 - 1))).
///
/// e is how well one begin or end is placed. In sharp stripes it lies anywhere between two lines,
/// e = 1 / sqrt(12); an exposure of x lines makes a ramp of it, on which noise of 2 % of a line's
/// brightness counts:
///
///     e^2 = max(0, 1 - x / 1.2)^2 / 12 + (0.02 x)^2,
///
/// which bounds what is measured on square waves (where whole numbers of lines make a period, it is
/// better). Infinity below kMinPeriods.
double period_sd(double period_lines, double lines, double exposure_lines);

/// Returns whether two lamps cannot be distinguished: their frequencies differ by less than
/// kLampDrift, and their duties are unknown or differ by less than twice kDutyMargin. Returns false
/// if a lamp has no frequency.
bool share_frequency(const Lamp& a, const Lamp& b);

/// Explains that a room has to be chosen, because two rooms have lamps with one frequency.
///
/// @param argument  where the room is chosen, such as "the argument room of vlp_open_room()"
/// @return          the message with the names of the rooms; empty if no room is needed
std::string explain_missing_room(const LampMapFile& lamps, const std::string& argument);

/// Two lamps that cannot be told apart with certainty.
struct LampsAlike {
  int first, second;
  /// Their frequencies' ratio less one, and the one that would be enough.
  double gap, needed;
};

/// Pairs of lamps that lamp_by_frequency() may call unknown: frequencies nearer than kLampDrift
/// plus four standard deviations of a period (95 % of lights are told apart), and duties that are
/// not known or nearer than twice kDutyMargin. Lamps without a frequency are left out; without a
/// diameter only the drift counts.
std::vector<LampsAlike> lamps_alike(const LampMap& lamps, const StripeConditions& conditions);

/// A lamp that shows too few stripes to be identified from there, whose stripes an exposure of
/// about a whole period wipes out, or that is too fast for the shutter's lines.
struct LampUnreadable {
  int lamp;
  double period_lines;
  /// Periods on the lamp.
  double periods;
  /// |sinc(frequency exposure)|, what is left of the stripes (lib/THEORY.md, "Identity").
  double contrast;
};

/// Lamps with a period below kShortestPeriod_lines, less than kMinPeriods, or a contrast below
/// kMinContrast.
std::vector<LampUnreadable> lamps_unreadable(const LampMap& lamps,
                                             const StripeConditions& conditions);

}  // namespace vlp
