// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "geometry/frames.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"

/// The least-squares problem behind adjust_captures(): its unknowns in one vector, its residuals
/// with their derivatives, its solution by Ceres, its covariance.
namespace vlp {

/// Where the unknowns stand in the vector: first those that captures share, then those of each
/// capture. A part that is not there has size 0.
struct AdjustmentLayout {
  /// Of the lens, in units of its standard deviations (LensFreedom).
  Eigen::Index lens = 0, lens_size = 0;
  /// (x/z, y/z) of the zenith in the camera.
  Eigen::Index zenith = 0;
  Eigen::Index lever_arm = 0;
  /// Three a lamp, three (x, y of the axis, z of the camera) a spot.
  Eigen::Index lamps = 0, spots = 0;
  Eigen::Index shared = 0;

  Eigen::Index lamp(std::size_t i) const { return lamps + 3 * static_cast<Eigen::Index>(i); }
  Eigen::Index spot(std::size_t i) const { return spots + 3 * static_cast<Eigen::Index>(i); }
};

/// The directions in which a lens may move: intrinsics = start + directions u, where u has unit
/// covariance; those of which errors are stated (stated_intrinsics()). Directions in which the
/// covariance is nothing but rounding are left out.
struct LensFreedom {
  Eigen::VectorXd start;
  Eigen::MatrixXd directions;

  LensFreedom(const Camera& camera, const std::optional<MatrixX>& covariance);
};

class AdjustmentProblem {
 public:
  struct Sighting {
    std::size_t capture, lamp;
    Eigen::Vector2d pixel;
    double sigma_px;
    /// Scales residuals in pixels to standard deviations.
    Eigen::Matrix2d whitening;
    /// When it is read.
    double time_s;
    bool used = true;
  };
  struct Capture {
    /// Index of the spot; nothing when it stands by itself.
    std::optional<std::size_t> spot;
    /// From the level frame to that of the robot's inclination.
    Eigen::Matrix3d base_from_level;
    /// Of the camera; on a spot the yaw rate alone.
    KnownMotion motion = {};
    /// Where its own unknowns stand: (X, Y, Z, yaw), or, on a spot, the yaw; then, as far as they
    /// are not known, the velocity and the yaw rate.
    Eigen::Index own = 0;

    bool velocity_is_free() const { return !spot && motion.velocity_sd_m_per_s > 0; }
    bool yaw_rate_is_free() const { return motion.yaw_rate_sd_rad_per_s > 0; }
    Eigen::Index pose_size() const { return spot ? 1 : 4; }
    Eigen::Index motion_size() const {
      return (velocity_is_free() ? 2 : 0) + (yaw_rate_is_free() ? 1 : 0);
    }
    Eigen::Index size() const { return pose_size() + motion_size(); }
  };
  struct LampPrior {
    Eigen::Vector3d surveyed_m;
    /// 0: exact. Infinite: it counts for nothing.
    double sd_m;
  };
  /// What one known place says of one capture.
  struct PlaceSighting {
    std::size_t capture, place;
    bool of_axis;
    Eigen::Vector3d stated_m;
    /// 2 without a height.
    Eigen::Index size;
    /// With which it counts: that of the place, times the root of its number of captures.
    double sd_m;
  };

  AdjustmentProblem(LensModel model, LensFreedom freedom, std::size_t lamps, std::size_t spots);

  /// Adds a capture with its unknowns at this place.
  void add_capture(const Capture& capture, const Pose& start);

  const AdjustmentLayout& layout() const { return layout_; }
  Eigen::VectorXd& state() { return state_; }
  const Eigen::VectorXd& state() const { return state_; }

  std::vector<Capture> captures;
  std::vector<Sighting> sightings;
  std::vector<LampPrior> lamps;
  /// Directions of the lamps' coordinates that stay as surveyed, a column each, over the standard
  /// deviation with which they do. Without columns, nothing is held.
  Eigen::MatrixXd gauge;
  std::vector<PlaceSighting> places;
  std::vector<bool> place_used;
  /// Whether some residual depends on the lever arm.
  bool has_lever_arm = false;
  /// What sigma_px is multiplied with.
  double noise_scale = 1;

  /// Least squares from the state as it is, which it moves; with `robust`, Cauchy's loss on
  /// sightings, lamps and places. False when it does not converge to something finite.
  bool solve(bool robust);

  /// The whitened residual of a sighting, seen less predicted; nothing where the lens has no such
  /// ray. Derivatives by the shared unknowns it depends on and by the capture's own.
  struct Linearized {
    Eigen::Vector2d residual;
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 16> by_lens;
    Eigen::Matrix2d by_zenith, by_lever_arm;
    Eigen::Matrix<double, 2, 3> by_lamp, by_spot;
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 7> by_own;
  };
  std::optional<Linearized> linearize(const Sighting& sighting, const Lens& lens) const;

  /// Of the camera (or of the axis it turns about) in the capture.
  Eigen::Vector3d place_of(const PlaceSighting& place) const;

  /// What is known of a capture's motion, where it is not known exactly: the state less it, in
  /// standard deviations, and one over these.
  struct MotionPrior {
    Eigen::VectorXd deviations, weights;
  };
  MotionPrior motion_prior(const Capture& capture) const;

  /// How many unknowns of a capture's motion its sightings determine, where what is known does not:
  /// of each one less its variance over that which was known before.
  double told_of_motion(std::size_t capture) const;

  /// The lens that the state stands for; nothing where that is none.
  std::optional<Lens> lens() const;
  std::vector<double> intrinsics() const;

  struct SharedCovariance {
    /// Covariance of the shared unknowns, zero for exact ones. Unknowns that no residual depends on
    /// have the standard deviation of a guess: 1 rad, 10 m.
    Eigen::MatrixXd matrix;
    /// Number of unknowns that known places determine: the sum of tr(C_place) / sd^2 over the
    /// places that are used, C_place being the covariance of the adjusted place.
    double determined_by_places;
  };
  /// Computes the covariance of the shared unknowns at the state.
  SharedCovariance shared_covariance() const;

  const LensFreedom& freedom() const { return freedom_; }

 private:
  friend struct AdjustmentCosts;

  LensModel model_;
  LensFreedom freedom_;
  AdjustmentLayout layout_;
  Eigen::VectorXd state_;
};

/// camera_from_level of a zenith's normalized point, times x, and its derivative by the point.
struct ZenithTurn {
  Eigen::Vector3d x_in_camera;
  Eigen::Matrix<double, 3, 2> by_zenith;
  Eigen::Matrix3d camera_from_level;
};
ZenithTurn turn_by_zenith(const Eigen::Vector2d& zenith, const Eigen::Vector3d& x_in_level);

}  // namespace vlp
