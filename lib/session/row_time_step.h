// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "camera/lens.h"
#include "evaluation/metric.h"
#include "frontend/labeled_lights.h"
#include "frontend/lamp_intake.h"
#include "frontend/options.h"
#include "lamps/signal/row_time.h"
#include "rig/calibration.h"
#include "rig/lamp_map.h"
#include "session/step_result.h"

namespace vlp {

/// Lights in folders of images, not identified as lamps.
struct DetectedLights {
  /// Observations of all images, folder after folder, with their lights. `folder_sizes` has the
  /// number of images of each folder.
  Observations observations;
  /// Number of images of each folder, in the order of `observations`.
  std::vector<std::size_t> folder_sizes;
  DetectorCamera camera;

  /// Returns the observations of each folder.
  std::vector<std::span<const Observation>> by_folder() const;
};

/// Detects the lights in the images of each folder without identifying lamps. `calibration`
/// supplies the lens and the readout direction if it has them. If `with_row_time` is false, its row
/// time is ignored. Throws InputError if no image can be read.
DetectedLights detect_in_folders(const std::vector<std::filesystem::path>& folders,
                                 const LampMap& lamps,
                                 const std::optional<Calibration>& calibration, bool with_row_time,
                                 const FrontendOptions& options,
                                 const IntakeProgress& progress = {});

/// Chooses a row time by periods and duty cycles of the lights in the images of each folder. Also
/// uses their positions if several row times fit (compute_position_costs()).
///
/// @param labels  for each folder its lights that are lamps; an empty list: all lights of the
/// folder
RowTimeResult estimate_row_time(std::span<const std::span<const Observation>> folders,
                                const std::vector<std::vector<Frame>>& labels, const LampMap& lamps,
                                const std::optional<Lens>& lens);

/// Result of run_row_time_step().
struct RowTimeStepResult : StepResult {
  RowTime row_time{};
};

/// Estimates the row time from lamps with a frequency in the map (list_row_time_candidates()).
/// If several row times explain their periods, chooses by their positions
/// (compute_position_costs()). Adds row time and readout direction to the
/// camera of `calibration`, if given, and warns if it states another row time
/// (describe_wrong_row_time()). Failure: undetermined. Throws InputError if no lamp has a
/// frequency.
RowTimeStepResult run_row_time_step(const DetectedLights& seen,
                                    const std::vector<std::vector<Frame>>& labels,
                                    const LampMap& lamps, const std::filesystem::path& lamps_file,
                                    const std::optional<Calibration>& calibration,
                                    HistoryEntry entry);

/// Row time given by a file or an option.
struct GivenRowTime {
  double row_time_s;
  /// Name of the file or of the option that gives the row time, for messages.
  std::string source;
};

/// Row time measured from identified lamps, compared with the given one.
struct RowTimeCheck {
  /// Measured row time; std::nullopt if fewer than three lamps show reliable stripes.
  std::optional<RowTime> measured = {};
  /// Contradiction between measured and given row time, in one line; empty if they agree.
  std::string error = {};
  /// |log(measured / given)| - 3 sd / measured, at least 0; std::nullopt if it was not compared.
  std::optional<double> error_fraction = {};
};

/// Compares a measured row time with the stated one, as check_row_time() does.
///
/// @return  the contradiction in one line; empty if there is none or fewer than three lamps were
///          measured
std::string describe_wrong_row_time(const RowTime& measured, const GivenRowTime& given);

/// Estimates the row time from the identified lamps of the kept images
/// (list_row_time_candidates()) and compares it with the given one. They contradict each other
/// if
///
///     |log(measured / stated)| > kLampDrift + 3 sd / measured.
///
/// A lamp may deviate from its frequency by kLampDrift (frequency_identification.h). The mean of
/// several lamps then deviates by at most kLampDrift, whether their deviations are independent or
/// common. The second term covers the measurement, and lamps that deviate by more.
RowTimeCheck check_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                            const GivenRowTime& given);

/// Compares the given row time with the one that makes the lights of the images lamps of the map,
/// by their periods and positions, independently of their identification (select_row_time()): a
/// wrong row time leaves lights unknown or exchanges lamps. The result is as that of
/// check_row_time().
RowTimeCheck search_row_time(const std::vector<Observation>& images, const LampMap& lamps,
                             const std::optional<Lens>& lens, const GivenRowTime& given);

/// Adds a contradiction of the row time of `camera` to the result of a step: in place of the reason
/// if the step failed, as a warning otherwise, because fixes at rest are valid. The contradiction
/// is that of check_row_time() if there is a result. Otherwise, and if identified
/// lamps agree because each was taken for its neighbor, it is that of
/// search_row_time(). An unknown row time adds nothing.
///
/// @param source  name of the file or of the option that gives the row time
void add_row_time_remark(const std::vector<Observation>& images, const LampMap& lamps,
                         const DetectorCamera& camera, const std::string& source,
                         StepResult& result);

/// Returns the metrics row_time_us, row_time_sd_us and, if it was compared, row_time_error_percent;
/// none if the row time was not measured.
std::vector<Metric> make_row_time_metrics(const RowTimeCheck& check);

}  // namespace vlp
