// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "camera/lens.h"
#include "geometry/frames.h"
#include "positioning/positioner.h"
#include "rig/calibration.h"

/// Least-squares problem of adjust_bundle(): unknowns in one vector, residuals with
/// derivatives, solution by Ceres, covariance.
namespace vlp {

/// Index of the first unknown of each kind in the state vector. Global unknowns come first, in the
/// order of the members; those of each capture follow. A kind without unknowns has size 0.
struct UnknownIndices {
  /// Index and number of the unknowns of the lens, in units of its standard deviations
  /// (LensParametrization).
  Eigen::Index lens = 0, lens_size = 0;
  /// Index of the normalized point (x/z, y/z) of the zenith in the camera frame.
  Eigen::Index zenith = 0;
  /// Index of the lever arm (x, y) in the level frame, m.
  Eigen::Index lever_arm = 0;
  /// Indices of the positions of the lamps and of the pivots, in the world, m. Each has three
  /// coordinates; those of a pivot are x, y of the axis and z of the camera.
  Eigen::Index lamps = 0, pivots = 0;
  /// Number of global unknowns, and index of the first local unknown.
  Eigen::Index global = 0;

  Eigen::Index lamp_state_index(std::size_t i) const {
    return lamps + 3 * static_cast<Eigen::Index>(i);
  }
  Eigen::Index pivot_state_index(std::size_t i) const {
    return pivots + 3 * static_cast<Eigen::Index>(i);
  }
};

/// Whitened parametrization of the lens: intrinsics = start + directions u, where u has unit
/// covariance. Comprises the intrinsics that have errors (count_intrinsics()).
/// Omits directions in which the covariance is numeric noise.
struct LensParametrization {
  Eigen::VectorXd nominal_intrinsics;
  Eigen::MatrixXd directions;

  LensParametrization(const Camera& camera, const std::optional<MatrixX>& covariance);
};

/// Whitened residual with its derivatives with respect to blocks of the state.
struct AdjustmentResidual {
  Eigen::VectorXd value;
  struct Block {
    /// Index of the first unknown of the block.
    Eigen::Index first;
    Eigen::MatrixXd jacobian;
  };
  std::vector<Block> blocks;
};

/// Unknowns, observations and priors of an adjustment.
class AdjustmentProblem {
 public:
  /// Detection of a lamp in a capture. `capture` and `lamp` are indices in the lists of the
  /// problem.
  struct Sighting {
    std::size_t capture, lamp;
    Eigen::Vector2d pixel;
    double sigma_px;
    /// Matrix that converts a residual in px to one in units of its standard deviation.
    Eigen::Matrix2d whitening;
    /// Readout time of the pixel, s, relative to that of the middle of the image.
    double time_s;
    bool used = true;
  };
  /// Capture with the location of its local unknowns.
  struct Capture {
    /// Index of the pivot of the capture; std::nullopt if the capture has a position of its own.
    std::optional<std::size_t> pivot;
    /// Rotation from the level frame to the frame of the base.
    Eigen::Matrix3d base_from_level;
    /// Motion of the camera; at a pivot only the yaw rate is used.
    KnownMotion motion = {};
    /// Index of its first local unknown. The local unknowns are (X, Y, Z, yaw), or only the yaw at
    /// a pivot. Velocity and yaw rate follow if these are not known exactly.
    Eigen::Index local = 0;

    bool is_velocity_estimated() const { return !pivot && motion.velocity_sd_m_per_s > 0; }
    bool is_yaw_rate_estimated() const { return motion.yaw_rate_sd_rad_per_s > 0; }
    Eigen::Index num_pose_unknowns() const { return pivot ? 1 : 4; }
    Eigen::Index num_motion_unknowns() const {
      return (is_velocity_estimated() ? 2 : 0) + (is_yaw_rate_estimated() ? 1 : 0);
    }
    Eigen::Index size() const { return num_pose_unknowns() + num_motion_unknowns(); }
  };
  /// Surveyed position of a lamp.
  struct LampPrior {
    Eigen::Vector3d surveyed_m;
    /// Standard deviation per axis. 0: the lamp is fixed; infinite: the survey is ignored.
    double sd_m;
    /// True if only the height is known.
    bool is_height_only = false;

    bool is_exact() const { return sd_m == 0 && !is_height_only; }
  };
  /// Observation of a known position by one capture.
  struct PositionObservation {
    std::size_t capture, known_position;
    bool is_axis_position;
    Eigen::Vector3d measured_m;
    /// Number of coordinates: 3, or 2 without a height.
    Eigen::Index size;
    /// Effective standard deviation: that of the known position times the square root of its number
    /// of captures.
    double sd_m;
  };

  AdjustmentProblem(LensModel model, LensParametrization lens, std::size_t lamps,
                    std::size_t pivots);

  /// Adds a capture and its local unknowns, with the initial pose `start`.
  void add_capture(const Capture& capture, const Pose& start);

  const UnknownIndices& layout() const { return layout_; }
  Eigen::VectorXd& state_vector() { return state_; }
  const Eigen::VectorXd& state_vector() const { return state_; }

  std::vector<Capture> captures;
  std::vector<Sighting> sightings;
  std::vector<LampPrior> lamps;
  /// Directions of the lamps' coordinates that stay as surveyed, one column each, divided by the
  /// standard deviation of this constraint. Without columns there is no constraint.
  Eigen::MatrixXd gauge;
  std::vector<PositionObservation> position_observations;
  std::vector<bool> is_known_position_used;
  /// True if some residual depends on the lever arm, and the lever arm is estimated.
  bool has_lever_arm = false;
  /// True if the zenith keeps its initial value.
  bool is_zenith_exact = false;
  /// True if the lens keeps its initial value. Its errors propagate to the other unknowns.
  bool is_lens_held = false;
  /// Factor by which all sigma_px are multiplied.
  double noise_scale = 1;

  /// Solves by least squares from the current state and updates it. With `robust`, applies a Cauchy
  /// loss to observations, lamps and known positions. Returns false if the solution is not usable
  /// or not finite.
  bool solve_adjustment(bool robust);

  /// Linearizes an observation at the current state, measured minus predicted. Returns std::nullopt
  /// if the lens cannot project the point.
  std::optional<AdjustmentResidual> linearize_sighting(const Sighting& sighting,
                                                       const Lens& lens) const;

  /// Returns the position of the camera (or of the axis) in the capture, from the current state.
  Eigen::Vector3d predict_position(const PositionObservation& place) const;

  /// Returns the lens of the current state; std::nullopt if its intrinsics are invalid.
  std::optional<Lens> current_lens() const;
  std::vector<double> current_intrinsics() const;

  /// Result of compute_covariance().
  struct GlobalCovariance {
    /// Covariance of the global unknowns, zero for exact ones and for a lens that is held. Unknowns
    /// without any residual have the standard deviation of a guess: 1 rad, 10 m.
    Eigen::MatrixXd matrix;
    /// Derivative of the global unknowns with respect to those of a lens that is held, -N^-1 M with
    /// the information N of the others and its block M of the lens; otherwise no columns.
    Eigen::MatrixXd jacobian_wrt_lens;
    /// Degrees of freedom of the detections that are used: the number of their coordinates minus
    /// the trace of their hat matrix.
    double degrees_of_freedom;
  };
  /// Computes the covariance of the global unknowns at the current state, after marginalization of
  /// the local ones.
  GlobalCovariance compute_covariance() const;

  const LensParametrization& lens_parametrization() const { return lens_parametrization_; }

 private:
  /// Residual of the least-squares problem: a detection, another observation, or a prior.
  struct Term {
    std::function<std::optional<AdjustmentResidual>()> linearize;
    /// True if the robust solution limits its influence.
    bool has_loss = false;
    bool is_detection = false;
    /// Capture on whose local unknowns it depends.
    std::optional<std::size_t> capture = {};
  };
  /// Returns all terms, those of the detections first. They refer to this object and to `lens`, the
  /// lens of the current state.
  std::vector<Term> list_cost_terms(const std::optional<Lens>& lens) const;
  AdjustmentResidual linearize_place(const PositionObservation& place) const;
  AdjustmentResidual linearize_motion(const Capture& capture) const;
  AdjustmentResidual linearize_prior(std::size_t lamp) const;
  AdjustmentResidual linearize_gauge() const;
  /// Returns true if the block of the state is exact: the zenith, or the position of a lamp.
  bool is_block_exact(Eigen::Index first) const;
  /// Returns the information of the global unknowns without a prior, for a guess.
  Eigen::MatrixXd make_weak_prior() const;

  LensModel model_;
  LensParametrization lens_parametrization_;
  UnknownIndices layout_;
  Eigen::VectorXd state_;
};

/// Result of rotate_to_camera(): point in the camera frame, its derivative with respect
/// to the zenith's normalized point, and the rotation.
struct ZenithRotation {
  Eigen::Vector3d x_in_camera;
  Eigen::Matrix<double, 3, 2> jacobian_wrt_zenith;
  Eigen::Matrix3d camera_from_level;
};
/// Rotates a point of the level frame into the camera by camera_from_level of a zenith, given as a
/// normalized point.
ZenithRotation rotate_to_camera(const Eigen::Vector2d& zenith, const Eigen::Vector3d& x_in_level);

}  // namespace vlp
