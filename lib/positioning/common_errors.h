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
#include "body_fix.h"
#include "camera_mount.h"
#include "correction.h"
#include "fix.h"
#include "least_squares_fix.h"
#include "robust_fix.h"

namespace vlp {

/// What errors are common to all fixes of a unit. The lever arm is none: it moves no fix of the
/// camera.
enum class CommonPart { lens, zenith, offset, lamps };
inline constexpr std::array kCommonParts{CommonPart::lens, CommonPart::zenith, CommonPart::offset,
                                         CommonPart::lamps};

/// What calibration and lamp map got wrong, which all fixes of a unit have in common:
///   cov = (J' W J)^-1 + G C G',    G = (J' W J)^-1 J' W J_c,
/// where J_c is how the errors of what was calibrated move the normalized points z less their
/// predictions, and C their joint covariance. What was calibrated: the lens, the zenith, the
/// dispersion's offset, the lamps' places.
class CommonErrors {
 public:
  /// C from the adjustment; without one from the steps in a row: with e_lens from the boards
  ///   e_zenith = own + by_intrinsics e_lens,
  ///   e_offset = own + by_intrinsics e_lens + by_zenith e_zenith + by_lamps e_lamps
  /// (by_zenith is -1 where it is not stated; the lens counts where the first of these that is
  /// applied states by_intrinsics, and where none is applied),
  /// and of the lamps the survey's sd_m. `lamps` are the map's, in the order in which indices name
  /// them. Lamps of an adjustment or a dispersion are those of the map if they have the same id and
  /// place, to 1 um. The errors of other lamps of a dispersion are independent of the map.
  CommonErrors(std::span<const Lamp> lamps, const Calibration& calibration, Correction correction);

  /// Whether anything at all is known of them.
  bool stated() const { return stated_; }
  /// Whether they are known of lens, zenith and every lamp of the map: only then can a lamp be told
  /// to be wrong.
  bool complete() const { return complete_; }
  /// Whether the part's errors are known; also where there is no such part.
  bool stated(CommonPart part) const { return part_stated_[static_cast<std::size_t>(part)]; }
  /// One part of C, with the others taken as exact. The parts add up to C, and none makes a
  /// variance negative: each is what would go away were it known exactly, when those before it, in
  /// the order of kCommonParts, already are (block Cholesky). For steps in a row that is what each
  /// has of its own, and the lens' part is with all that the steps after it make of its errors. The
  /// lamps' part is without what an offset that was found with the same map compensates.
  CommonErrors only(CommonPart part) const;
  /// Lamps of the adjustment that the map has elsewhere: what they have in common with the
  /// calibration is lost.
  int lamps_elsewhere() const { return lamps_elsewhere_; }

  /// How the shared errors move the ray of a pixel, along the axes of the base (the level
  /// camera's).
  using ByRay = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, 20>;
  ByRay effect_on_ray(const Eigen::Vector3d& ray_in_base, const Lens& lens) const;

  /// How the errors move z of one lamp, a 2-row block each.
  struct Effect {
    Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::ColMajor, 2, 20> by_shared;
    Eigen::Matrix<double, 2, 3> by_lamp;
  };
  /// Of a sighting by the camera `level_from_camera` = level_from_base base_from_camera, at `pose`.
  Effect effect_on(const Sighting& sighting, const LevelPose& pose, const Lens& lens,
                   const Eigen::Matrix3d& level_from_base) const;

  /// G: what the errors do to the states of a fix, by the shared ones and by each lamp's own.
  template <int States>
  struct GainOf {
    using ByShared = Eigen::Matrix<double, States, Eigen::Dynamic, Eigen::ColMajor, States, 20>;
    using ByLamp = Eigen::Matrix<double, States, 3>;

    ByShared by_shared;
    /// Of the lamps of the fix: which of the map they are. The first `size` hold something.
    std::array<ByLamp, kMaxSightings> by_lamp;
    std::array<std::size_t, kMaxSightings> lamps;
    std::size_t size = 0;

    explicit GainOf(Eigen::Index shared) : by_shared(ByShared::Zero(States, shared)) {}
    void add(std::size_t lamp, const ByLamp& effect) {
      by_lamp[size] = effect;
      lamps[size++] = lamp;
    }
  };
  /// Of (X, Y, Z, yaw), and of all states of a body (BodyIndex).
  using Gain = GainOf<4>;
  using BodyGain = GainOf<kBodyStates>;
  /// Of a fix of least squares (fix_least_squares) with the covariance of `camera`, from sightings
  /// of these lamps of the map; of a single one, of fix_one_lamp().
  Gain gain_of(std::span<const Sighting> sightings, std::span<const std::size_t> lamps,
               const PoseEstimate& camera, const Lens& lens,
               const Eigen::Matrix3d& level_from_base) const;
  /// Of a body with the camera at `arm_m`: the gain of its pixels, in standard deviations, is that
  /// of its least squares (fix_body).
  BodyGain gain_of(std::span<const BodySighting> sightings, std::span<const std::size_t> lamps,
                   const Eigen::Vector3d& arm_m, const BodyFix& fix, const Lens& lens,
                   const Eigen::Matrix3d& body_from_base) const;
  /// Computes the sum of the squared residuals over their variances that the errors cause on
  /// average, from the common covariance `common` = G C G' of the fix:
  ///   tr(R C R') = tr(W J_c C J_c') - tr(N common),   R = W^1/2 (J_c - J G),   N = J' W J.
  /// For a body with priors of information P, N + 2 P takes the place of N.
  double expected_chi_squared(std::span<const Sighting> sightings,
                              std::span<const std::size_t> lamps, const PoseEstimate& camera,
                              const Matrix4& common, const Lens& lens,
                              const Eigen::Matrix3d& level_from_base) const;
  double expected_chi_squared(std::span<const BodySighting> sightings,
                              std::span<const std::size_t> lamps, const Eigen::Vector3d& arm_m,
                              const BodyFix& fix, const BodyCovariance& common, const Lens& lens,
                              const Eigen::Matrix3d& body_from_base) const;
  /// G C G', of one or the other.
  template <int States>
  Eigen::Matrix<double, States, States, Eigen::DontAlign> covariance_of(
      const GainOf<States>& gain) const;
  /// Of one sighting's z.
  Matrix2 covariance_of(const Effect& effect, std::size_t lamp) const;

  /// Returns the joint covariance of the intrinsics, zenith, offset (where there are such), then of
  /// the lamps whose errors are correlated with others, in the order of the map.
  const MatrixX& joint() const { return covariance_; }
  Eigen::Index intrinsics() const { return intrinsics_; }
  Eigen::Index shared() const { return intrinsics_ + std::ssize(turns_); }

 private:
  bool has_zenith() const { return offset_ > intrinsics_; }
  bool has_offset() const { return shared() > offset_; }
  /// Errors of a lamp of the map. A large map has few lamps whose errors are correlated with
  /// others: those of an adjustment or of a dispersion have rows in the joint covariance.
  struct LampErrors {
    /// First row of the lamp, if it has rows.
    std::optional<Eigen::Index> row;
    /// Variance per axis of a lamp without rows; 0 if unknown.
    double variance_m2 = 0;
  };
  /// Gives rows to the lamps that are correlated with other errors, and sets the size of the joint
  /// covariance.
  void assign_rows(std::span<const Lamp> lamps, const Calibration& calibration);
  /// Returns the covariance of a lamp's place.
  Eigen::Matrix3d covariance_of_lamp(std::size_t lamp) const;
  /// Returns the covariance of two lamps of the map.
  Eigen::Matrix3d covariance_of_lamps(std::size_t lamp, std::size_t other) const;
  /// Sets which parts are stated, and the covariances of lens and zenith without an adjustment.
  void state_lens_and_zenith(const Calibration& calibration);
  /// Sets the covariances of the lamps, and all that an adjustment states.
  void state_lamps(std::span<const Lamp> lamps, const std::optional<Adjustment>& adjustment);
  /// Adds the effects of earlier steps to zenith and offset. @pre one of them is applied
  void propagate_to_zenith_and_offset(std::span<const Lamp> lamps, const Calibration& calibration);
  /// Returns the first row of a lamp of the dispersion if the map has it at the same place and
  /// states its error.
  std::optional<Eigen::Index> find_stated_row(std::span<const Lamp> lamps,
                                              const Dispersion::UncertainLamp& uncertain) const;

  /// How many intrinsics, and where the offset stands.
  Eigen::Index intrinsics_, offset_ = 0;
  Eigen::Matrix3d base_from_camera_, camera_from_base_;
  /// Derivatives of base_from_camera by the zenith's and the offset's coordinates.
  std::vector<Eigen::Matrix3d> turns_;
  MatrixX covariance_;
  std::vector<LampErrors> lamps_;
  bool stated_ = false, complete_ = false;
  std::array<bool, kCommonParts.size()> part_stated_ = {};
  int lamps_elsewhere_ = 0;
};

/// The lamp that the others contradict by more than noise and common errors explain, and whether
/// the rest is explained without it; the lamps' errors are taken as independent of one another. By
/// the largest drop of the weighted squares of residuals (chi-squared; 1e-4 of those that are
/// right). The lamps that are left out, none, one or several: indices in the frame.
struct Unexplained {
  std::array<std::size_t, kMaxSightings> lamps;
  std::size_t count = 0;
};
Unexplained find_unexplained(std::span<const Sighting> sightings, std::span<const Matrix2> common,
                             const LeastSquaresFix& fix);

/// Of the zenith's normalized point, from all that it rests on: its captures and the lens, or of
/// the adjustment where there is one. Nothing where a part is not stated, or how the lens' errors
/// move it. Precondition: a rotation centre.
std::optional<Matrix2> whole_zenith_covariance(const Calibration& calibration);

/// The same of the dispersion's offset in pixels: its captures, the zenith, and the lens, which
/// moves both. Precondition: a dispersion.
std::optional<Matrix2> whole_offset_covariance(const Calibration& calibration);

}  // namespace vlp
