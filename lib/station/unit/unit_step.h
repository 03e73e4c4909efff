// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calibration/intrinsics/image_coverage.h"
#include "captures/detections_table.h"
#include "frontend/observation.h"
#include "report/report_picture.h"
#include "rig/calibration.h"
#include "session/step_result.h"
#include "station/station_config.h"

namespace vlp {

/// Steps of a station, in this order. Each has a folder of its name.
enum class StationStep { boards, rotation, dispersion, check };

inline constexpr std::array kStationSteps{StationStep::boards, StationStep::rotation,
                                          StationStep::dispersion, StationStep::check};

constexpr const char* station_step_name(StationStep step) {
  constexpr std::array names{"boards", "rotation", "dispersion", "check"};
  return names[static_cast<std::size_t>(step)];
}

/// Plot of a step for the unit's report, which another thread renders. get() waits for it and
/// returns std::nullopt if it could not be rendered.
using StepPlot = std::shared_future<std::optional<ReportPlot>>;

/// Makes and renders a drawing on its own thread, while the unit continues, because gnuplot would
/// delay the verdict. Destroying the last copy of the result waits for the thread.
StepPlot render_plot_async(std::function<Drawing()> drawing);

/// Image of a unit, with its observation.
struct UnitImage {
  Observation observation;
  std::string sha256;
  /// The file no longer exists: a frame of a camera or a video that was rejected.
  bool discarded = false;
  /// Rotation level_from_camera with which the lamps were detected; zero for the calibrated one.
  Eigen::Matrix3d level = Eigen::Matrix3d::Zero();

  bool is_image_used() const { return observation.is_image_kept(); }
  /// Returns true for an image without a fault that is redundant because of others.
  bool is_image_redundant() const {
    return !is_image_used() && vlp::is_redundancy_rejection(observation.rejection->reason);
  }
  /// Reason for the rejection, in one line; empty if the image is used.
  std::string rejection_message() const {
    return is_image_used() ? "" : observation.rejection->message;
  }
};

/// Observes an image file by `observe`, the intake of a step. A file that cannot be read is
/// rejected.
UnitImage observe_unit_image(const std::filesystem::path& file,
                             const std::function<Observation(const SourceImage&)>& observe);

/// State of one step of a unit.
struct UnitStep {
  /// Folder of captures.csv and truth.csv.
  std::filesystem::path folder = {};
  /// Images, by name.
  std::map<std::string, UnitImage> images = {};
  /// Images that wait for the previous step.
  std::vector<std::filesystem::path> pending_images = {};
  /// True if the images meet the station's completion criterion for this step.
  bool sufficient = false;
  /// Result of the step, once it was solved; std::nullopt before.
  std::optional<StepResult> result = {};
  /// Plot of the result, if it has one.
  StepPlot plot = {};
  /// Number of consecutive rejected images at the end.
  int num_consecutive_rejections = 0;
  /// Number of rejected images of an incomplete batch.
  int num_rejected_in_batch = 0;
  bool is_any_used_in_batch = false;
  /// Name of the last image that was processed.
  std::string last_image = {};

  bool is_step_solved() const { return sufficient && result && result->has_succeeded(); }
  int count_used_images() const;
};

/// Returns the observations of the images, by name.
Observations list_observations(const UnitStep& step);
/// Returns the frames of the images that are used, by name.
std::vector<Frame> list_used_detections(const UnitStep& step);
/// Returns the images that are used, by name.
std::vector<const UnitImage*> list_used_images(const UnitStep& step);

/// Counts the corners of the used views in the cells of the image.
ImageCoverage compute_board_coverage(const UnitStep& step, const std::array<int, 2>& imager_px);

/// Angles of a rotation in place that captures cover, from fixes without rotation center.
struct YawCoverage {
  struct Height {
    double z_m;
    int captures;
    double arc_rad;
    /// Yaw sectors with at least one capture at this height: `rotation_captures` sectors of equal
    /// size over the full rotation, in order of increasing yaw. The first one is centered at the
    /// yaw of the first capture.
    std::vector<bool> covered_sectors;
    /// True if captures and angular range meet the station's criteria.
    bool is_complete = false;
  };
  /// Heights, in increasing order.
  std::vector<Height> heights;
  /// True if heights, captures at each and angular range meet the station's criteria.
  bool sufficient = false;
};

YawCoverage compute_yaw_coverage(const std::vector<Frame>& frames, const StationConfig& config,
                                 const Calibration& calibration);

/// Returns the median blur of the used views, once the step is complete. Before that it includes
/// rejected views, because all views of a blurred lens are rejected.
std::optional<double> compute_median_blur_px(const UnitStep& boards);

}  // namespace vlp
