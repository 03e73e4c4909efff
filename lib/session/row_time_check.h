// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "evaluation/metric.h"
#include "frontend/observation.h"
#include "lamps/signal/row_time.h"
#include "rig/lamp_map.h"

namespace vlp {

/// Row time given by a file or an option.
struct GivenRowTime {
  double row_time_s;
  /// Name of the file or of the option.
  std::string source;
};

/// Row time measured from identified lamps, compared with the given one.
struct RowTimeCheck {
  /// std::nullopt: fewer than three lamps show trustworthy stripes.
  std::optional<RowTime> measured = {};
  /// Contradiction in one line; empty if there is none.
  std::string error = {};
};

/// Compares a measured row time with the stated one, as check_row_time() does.
///
/// @return  the contradiction in one line; empty if there is none or fewer than three lamps were
///          measured
std::string compare_row_times(const RowTime& measured, const GivenRowTime& given);

/// Estimates the row time from the identified lamps of the kept images (estimate_row_time()) and
/// compares it with the given one. They contradict each other if
///
///     |log(measured / stated)| > kLampDrift + 3 sd / measured.
///
/// A lamp may deviate from its frequency by kLampDrift (frequency_identification.h). The mean of
/// several lamps then deviates by at most kLampDrift, whether their deviations are independent or
/// common. The second term covers the measurement, and lamps that deviate by more.
RowTimeCheck check_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                            const GivenRowTime& given);

/// Finds another row time that makes the lights of the images lamps of the map, by their periods
/// and positions, independently of their identification (choose_row_time()): a wrong row time
/// leaves lights unknown or exchanges lamps.
///
/// @return  the contradiction in one line; empty unless at least three lamps contradict the given
///          row time as in check_row_time()
std::string find_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                const std::optional<Lens>& lens, const GivenRowTime& given);

/// Returns the error of check_row_time() for the row time of `camera`, if the images gave a result.
/// Otherwise, and if identified lamps agree because each was taken for its neighbor, returns the
/// error of find_row_time_error(). Returns an empty string if the row time is
/// unknown.
std::string describe_row_time_error(const std::vector<Observation>& images, const LampMap& lamps,
                                    const Camera& camera, const std::string& source,
                                    bool has_result);

/// Returns the metrics row_time_us and row_time_sd_us; none if the row time was not measured.
std::vector<Metric> row_time_metrics(const RowTimeCheck& check);

}  // namespace vlp
