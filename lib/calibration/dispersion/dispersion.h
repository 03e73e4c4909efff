// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "geometry/circle_fit.h"
#include "positioning/fix.h"
#include "rig/calibration.h"
#include "rig/detection.h"
#include "rig/lamp_map.h"

namespace vlp {

/// A capture at a known place.
struct StationCapture {
  std::vector<Detection> detections;
  /// Where the camera is, in the world.
  Eigen::Vector2d station_m;
  std::optional<Inclination> inclination = {};
};

enum class DispersionMethod {
  /// What is fixed in the camera apart from what is fixed in the world; captures at various yaws.
  camera,
  /// The paper's: the centre of the dispersion circle is taken back; captures at one yaw.
  paper
};

/// What the paper's circle is: the mean fix and the farthest from it, or the smallest enclosing
/// one.
enum class DispersionCircle { mean, enclosing };

enum class DispersionStatus {
  ok,
  no_fix,            // no capture has one
  too_few_captures,  // fewer than three with a fix (`paper`: two)
  station_far,       // every fix is far from it
  one_yaw,           // `camera`: camera and world cannot be told apart
  many_yaws,         // `paper`
  diverged           // no offset explains the fixes
};

/// What it means and what to add, for people.
std::string_view explanation_of(DispersionStatus status);

/// Result of fit_dispersion(). Members after `noise_is_stated` are valid only if the status is
/// `ok`.
struct DispersionFit {
  DispersionStatus status = DispersionStatus::no_fix;
  /// Captures without a fix, and why the first has none.
  int captures_without_fix = 0;
  FixStatus no_fix_status = FixStatus::ok;
  /// True if all detections state their sigma_px.
  bool noise_is_stated = false;

  /// Its circle is that of `before`. The covariance is from the scatter of the fixes and their
  /// noise (compute_variance_factor()), `by_lamps` from the map's sd_m. There is neither for the
  /// enclosing circle.
  Dispersion dispersion = {{0, 0}, 0, {0, 0}, 0, {}};
  /// Fixed in the world, an error of the station or of the lamp map: mean fix minus station that
  /// stays, and its covariance from noise and map. Method `paper` takes it for zero.
  std::optional<Eigen::Vector2d> world_offset_m = {};
  Matrix2 world_covariance = Matrix2::Zero();

  struct StationFix {
    std::size_t capture;
    /// Fix minus station without any dispersion correction, and with that found.
    Eigen::Vector2d before_m, after_m;
    /// Otherwise it contradicts the others and is left out.
    bool used;
  };
  std::vector<StationFix> fixes = {};
  /// Dispersion circles of the fixes that are used.
  Circle before = {{0, 0}, 0}, after = {{0, 0}, 0};
};

/// The dispersion calibration (Chen and Guan, section 3.2; lib/THEORY.md, "Dispersion circle"). A
/// level camera of yaw g_k, H_k below the lamps, whose normalized points z are too large by delta,
/// and a station or map that is wrong by m, put
///   fix_k - station = -H_k e^{j g_k} delta + m.
/// Method `paper` (eq. 10 to 13 with the scale f / H and the turn by the yaw that they lack) takes
/// the circle's centre D for the whole of it: offset_px = -f e^{-jg} D / H, corrected until the
/// circle of the fixes made anew has its centre at the station (find_paper_offset). Method `camera`
/// estimates offset_px = f delta and m so that the fixes, made anew with the offset as
/// level_from_camera() applies it, agree with -H e^{jg} delta and m exactly; each weighs by its
/// covariance. Fixes farther off than five standard deviations, of the residuals' median, are left
/// out. A dispersion that `calibration` has already is not used.
DispersionFit fit_dispersion(std::span<const StationCapture> captures, const LampMap& map,
                             const Calibration& calibration, DispersionMethod method,
                             DispersionCircle circle = DispersionCircle::mean);

}  // namespace vlp
