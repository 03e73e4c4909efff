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
  /// Focal length of the camera along the readout direction, that is, across the scanlines, px.
  /// std::nullopt if unknown.
  std::optional<double> focal_px;
  /// Height of the camera above the world origin.
  double camera_height_m;
  /// Exposure time; if unknown, a short exposure is assumed, the worst case for a period.
  std::optional<double> exposure_s;
};

/// Returns the number of scanlines on the lamp: size * focal length / height above the camera. The
/// size is the shorter axis of the lamp, which is across the scanlines in the worst case. Only the
/// fraction kUsedHeight of the scanlines is used. Returns std::nullopt without a size or a focal
/// length, or if the lamp is not above the camera.
std::optional<double> count_scanlines(const Lamp& lamp, const StripeConditions& conditions);

/// Predicts the relative standard deviation of the period that measure_stripes() measures on
/// `lines` scanlines. A period is the slope of least-squares lines through the numbered begins and
/// ends of stripes. There are M = kUsedHeight lines / period of each:
///
///     sd(period) / period = (e / period) sqrt(6 / (M (M^2 - 1))).
///
/// e is the standard deviation of the position of one begin or end. In sharp stripes the position
/// is uniform between two scanlines, e = 1 / sqrt(12). An exposure of x scanlines turns the edge
/// into a ramp. Noise of 2 % of the brightness of a scanline then has an effect:
///
///     e^2 = max(0, 1 - x / 1.2)^2 / 12 + (0.02 x)^2.
///
/// This is an upper bound of the error measured on square waves; periods of an integer number of
/// scanlines have smaller errors. Returns infinity below kMinPeriods.
double predict_period_sd(double period_lines, double lines, double exposure_lines);

/// Returns whether two lamps cannot be distinguished: their frequencies differ by less than
/// kLampDrift, and their duties are unknown or differ by less than twice kDutyMargin. Returns false
/// if a lamp has no frequency.
bool are_indistinguishable(const Lamp& a, const Lamp& b);

/// Explains that a room has to be chosen, because two rooms have lamps with one frequency.
///
/// @param argument  where the room is chosen, such as "the argument room of vlp_open_room()"
/// @return          the message with the names of the rooms; empty if no room is needed
std::string explain_room_choice(const LampMapFile& lamps, const std::string& argument);

/// Two lamps that cannot be distinguished reliably.
struct AmbiguousLamps {
  int first, second;
  /// Ratio of their frequencies minus 1, and the minimum of it that would be sufficient.
  double frequency_gap, required_gap;
};

/// Returns the pairs of lamps that identify_by_frequency() may fail to identify. Their
/// frequencies differ by less than kLampDrift plus four standard deviations of a period, at which
/// 95 % of the lights are identified. Their duties are unknown or differ by less than twice
/// kDutyMargin. Lamps without a frequency are skipped; for lamps without a size only the drift
/// counts.
std::vector<AmbiguousLamps> list_ambiguous_lamps(const LampMap& lamps,
                                                 const StripeConditions& conditions);

/// Lamp that cannot be identified under the given conditions: it shows too few stripes, an exposure
/// of about a whole period removes them, or its period is too short for the shutter.
struct UnreadableLamp {
  int lamp;
  double period_lines;
  /// Number of stripe periods across the image of the lamp.
  double periods;
  /// Stripe contrast that remains after the exposure, |sinc(frequency exposure)| (lib/THEORY.md,
  /// "Identity").
  double contrast;
};

/// Returns the lamps with a period below kMinPeriod_lines, less than kMinPeriods periods, or a
/// contrast below kMinContrast.
std::vector<UnreadableLamp> list_unreadable_lamps(const LampMap& lamps,
                                                  const StripeConditions& conditions);

}  // namespace vlp
