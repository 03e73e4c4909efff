// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "../camera/lens.h"
#include "../geometry/types.h"
#include "../rig/calibration.h"
#include "../rig/lamp_map.h"
#include "correction.h"
#include "fix.h"
#include "pose_estimation.h"
#include "pose_observations.h"

namespace vlp {

/// Sources of errors common to all fixes of a camera. The lever arm is not one: it does not affect
/// the position of the camera.
enum class CommonErrorSource { lens, zenith, offset, lamps };
inline constexpr std::array kCommonErrorSources{CommonErrorSource::lens, CommonErrorSource::zenith,
                                                CommonErrorSource::offset,
                                                CommonErrorSource::lamps};

/// Errors of calibration and lamp map, which are common to all fixes of a camera, with their joint
/// covariance C. The total covariance of a fix is
///   cov = (J' W J)^-1 + G C G',    G = (J' W J)^-1 J' W J_c
/// with
///   J    derivative of the predicted normalized points w.r.t. the states of the fix
///   W    inverse covariance of the measured points from pixel noise
///   J_c  derivative of (normalized points z - predictions) w.r.t. errors of calibrated quantities
///   C    joint covariance of these errors
/// Calibrated quantities: lens, zenith, offset of the dispersion calibration, positions of the
/// lamps.
class CommonErrors {
 public:
  /// Takes C from JointCovariance. The errors of the lens count alone if no step is applied. The
  /// other lamps have the sd_m of the survey, independently. An offset whose error is unknown has
  /// that of the zenith with the opposite sign, because it compensates it.
  ///
  /// @param lamps  the lamps of the map, in the order to which indices refer
  ///
  /// A lamp of the joint covariance is a lamp of the map if id and position agree, to 1 um.
  CommonErrors(std::span<const Lamp> lamps, const Calibration& calibration, Correction correction);

  /// Returns true if the error of any calibrated quantity or lamp is known.
  bool has_known_errors() const { return stated_; }
  /// Returns true if the errors of lens, zenith and every lamp of the map are known. Only then can
  /// a wrong lamp be identified by them.
  bool has_all_errors() const { return complete_; }
  /// Returns true if the errors of the part are known, or if the calibration lacks the part.
  bool is_known_or_absent(CommonErrorSource part) const {
    return part_stated_[static_cast<std::size_t>(part)];
  }
  /// Returns one part of C, with the others taken as exact. The parts add up to C, and no part
  /// makes a variance negative.
  ///
  /// A part is the reduction of C if its errors become known exactly (block Cholesky). All earlier
  /// parts, in the order of kCommonErrorSources, already are. For sequential steps a part holds the
  /// errors of its own step. The part of the lens includes its effects on later steps. The part of
  /// the lamps excludes errors that an offset found with the same map compensates.
  CommonErrors isolate_error_source(CommonErrorSource part) const;
  /// Returns the number of lamps of the adjustment that the map has at another position. Their
  /// correlation with the calibration is lost.
  int num_lamps_moved_since_calibration() const { return num_lamps_moved_since_calibration_; }

  /// Derivative of the ray of a pixel with respect to the shared errors, one column each. The ray
  /// is along the axes of the base, the camera frame after correction of its tilt.
  using RayJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 20>;
  RayJacobian differentiate_ray(const Eigen::Vector3d& ray_in_base, const Lens& lens) const;

  /// Matrix of derivatives G: of the first `States` states of a fix, or of the residuals of an
  /// observation. Columns: shared errors, then errors of each lamp.
  template <int States>
  struct GainMatrix {
    using SharedGain = Eigen::Matrix<double, States, Eigen::Dynamic, Eigen::ColMajor, States, 20>;
    using LampGain = Eigen::Matrix<double, States, 3>;

    SharedGain jacobian_wrt_shared;
    /// Derivatives with respect to the positions of the lamps of the fix, and the indices of these
    /// lamps in the map. The first `size` elements are valid.
    std::array<LampGain, kMaxSightings> jacobian_wrt_lamp;
    std::array<std::size_t, kMaxSightings> lamps;
    std::size_t size = 0;

    explicit GainMatrix(Eigen::Index shared)
        : jacobian_wrt_shared(SharedGain::Zero(States, shared)) {}
    void add(std::size_t lamp, const LampGain& effect) {
      jacobian_wrt_lamp[size] = effect;
      lamps[size++] = lamp;
    }
  };
  /// Observations of a fix. `lamps` are the indices in the map of the observed lamps, `lens` and
  /// `body_from_base` those of the camera.
  struct Observations {
    std::span<const LampObservation> sightings;
    std::span<const std::size_t> lamps;
    const Lens& lens;
    const Eigen::Matrix3d& body_from_base;
    const Eigen::Vector3d& arm_m;
  };
  /// Returns the gain of the least-squares fix (estimate_body_state()): of (X, Y, Z, yaw), or of
  /// all states of a body (BodyIndex).
  template <int States>
  GainMatrix<States> differentiate_fix(const Observations& observations, const BodyFix& fix) const;
  /// Computes the covariance of the residuals of each observation from the common errors, in
  /// standard deviations of the pixel.
  void add_covariances(const Observations& observations, const BodyState& state,
                       std::span<Matrix2> covariances) const;
  /// Returns G C G', the covariance of the states of a fix from the common errors, in the units of
  /// the states.
  template <int States>
  Eigen::Matrix<double, States, States, Eigen::DontAlign> propagate(
      const GainMatrix<States>& gain) const;

  /// Returns the joint covariance: intrinsics, zenith and offset, as far as they exist. Lamps with
  /// correlated errors follow, in the order of the map.
  const MatrixX& joint_covariance() const { return covariance_; }
  Eigen::Index num_shared_errors() const { return intrinsics_ + std::ssize(rotation_derivatives_); }

 private:
  bool has_zenith_uncertainty() const { return offset_ > intrinsics_; }
  bool has_offset_errors() const { return num_shared_errors() > offset_; }
  /// Errors of a lamp of the map. A large map has few lamps whose errors are correlated with
  /// others: those of JointCovariance have rows here.
  struct LampErrors {
    /// First row of the lamp, if it has rows.
    std::optional<Eigen::Index> row;
    /// Variance per axis of a lamp without rows; 0 if unknown.
    double variance_m2;
    bool is_known;
  };
  /// Derivatives of the residuals of one observation with respect to the errors.
  GainMatrix<2> differentiate_residuals(const Observations& observations, std::size_t index,
                                        const LinearizedObservation& linearized) const;
  /// Returns the row in `joint` of each row of the covariance, -1 if it is unknown. Adds the lamps.
  std::vector<Eigen::Index> assign_rows(std::span<const Lamp> lamps, const JointCovariance& joint);
  /// Returns the covariance of a lamp's position, m^2; `lamp` is its index in the map.
  Eigen::Matrix3d lamp_covariance(std::size_t lamp) const;
  /// Returns the covariance between the positions of two lamps, m^2, by their indices in the map.
  Eigen::Matrix3d lamp_cross_covariance(std::size_t lamp, std::size_t other) const;

  /// Number of intrinsics, and index of the first row of the offset.
  Eigen::Index intrinsics_, offset_ = 0;
  Eigen::Matrix3d base_from_camera_, camera_from_base_;
  /// Derivatives of base_from_camera with respect to the coordinates of zenith and offset.
  std::vector<Eigen::Matrix3d> rotation_derivatives_;
  MatrixX covariance_;
  std::vector<LampErrors> lamps_;
  bool stated_ = false, complete_ = false;
  std::array<bool, kCommonErrorSources.size()> part_stated_ = {};
  int num_lamps_moved_since_calibration_ = 0;
};

/// Computes the expected contribution of the common errors to chi-squared, from the covariances of
/// the residuals that they cause. Their covariance of the states is `common` = G C G':
///   tr(R C R') = tr(W J_c C J_c') - tr((N + 2 P) common),   R = W^1/2 (J_c - J G)
/// with N = J' W J and the information P of the priors.
double compute_expected_chi_squared(const CommonErrors::Observations& observations,
                                    std::span<const Matrix2> residual_covariances,
                                    const BodyFix& fix, const BodyCovariance& common);

}  // namespace vlp
