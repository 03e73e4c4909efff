// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment.h"

#include <fmt/core.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "calibration/adjustment/adjustment_problem.h"
#include "geometry/robust_scatter.h"
#include "geometry/statistical_bounds.h"
#include "geometry/symmetric.h"
#include "positioning/outlier_rejection.h"
#include "positioning/row_clock.h"
#include "rig/calibration_error.h"
#include "rig/find_lamp.h"

namespace vlp {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// Chi-squared with three degrees of freedom beyond which a lamp counts as moved: 1e-4 of the
/// unmoved lamps exceed it.
constexpr double kMovedChiSquared = 21.1;
/// Number of standard deviations beyond which a known position is wrong, and a detection an
/// outlier.
constexpr double kMaxPlaceSigmas = 5, kDetectionOutlierSigmas = 4.5;
/// Message if no capture determines a pose.
constexpr const char* kTooFewLampsMessage =
    "no capture shows two lamps of the map clearly enough for a fix";
/// Smallest noise of detections without sigma_px, in pixels.
constexpr double kMinNoise_px = 1e-4;

/// Problem with the constant data of the input.
struct AssembledProblem {
  AdjustmentProblem problem;
  Eigen::Vector3d origin_m;
  std::vector<AdjustmentResult::PositionResidual> known_positions = {};
  std::vector<double> position_sd_m = {};
  std::vector<bool> lamp_seen = {};
  /// Index in the input of each capture of the problem.
  std::vector<std::size_t> capture_indices = {};
  int rejected_captures = 0;
  bool noise_is_stated = true;
};

Eigen::Vector3d compute_centroid(const LampMap& map) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Lamp& lamp : map.lamps) sum += lamp.position_m - map.lamps.front().position_m;
  return map.lamps.front().position_m + sum / static_cast<double>(map.lamps.size());
}

/// Estimates an approximate pose of a level camera from two lamps or more, even if the map has
/// small errors. With more than three lamps, tries the lamps that agree with each other first.
/// Returns std::nullopt for fewer than two lamps, or if there is no pose.
std::optional<Pose> estimate_rough_pose(const std::vector<LampObservation>& sightings,
                                        const std::vector<std::size_t>& lamps,
                                        const std::vector<Eigen::Vector3d>& lamps_m) {
  if (sightings.size() < 2) return std::nullopt;
  constexpr double max_residual_fraction = 0.1;
  FrameObservations frame;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    double nearest_m = kInfinite;
    for (std::size_t j = 0; j < lamps_m.size(); ++j) {
      if (j == lamps[i]) continue;
      nearest_m = std::min(nearest_m, (lamps_m[j] - sightings[i].lamp_m).head<2>().norm());
    }
    frame.add_current_observation(sightings[i], static_cast<int>(i), nearest_m);
  }
  const Eigen::Vector3d no_arm_m = Eigen::Vector3d::Zero();
  const BodyPrior level_at_rest;
  const BodyProblem problem{no_arm_m, level_at_rest};
  // Before estimate_pose_robustly(), which removes lamps from the frame.
  const BodySolution all = estimate_pose_from_all_lamps(frame, problem);
  if (sightings.size() > 3) {
    const BodySolution most = estimate_pose_robustly(frame, problem, max_residual_fraction);
    if (most.status == FixStatus::ok) return most.fix.state.pose;
  }
  return all.status == FixStatus::ok ? std::optional(all.fix.state.pose) : std::nullopt;
}

/// Returns the directions of yaw, scale and translation of the detected lamps, each divided by the
/// standard deviation of its constraint. With MapPrior::heights they are horizontal, and the scale
/// has the standard deviation that follows from sd_m.
Eigen::MatrixXd make_gauge(const std::vector<Eigen::Vector3d>& lamps_m,
                           const std::vector<bool>& seen, const AdjustmentInput& input) {
  constexpr double min_sd_m = 1e-6;  // far below the sd of lamps, and far above rounding
  const bool is_plan = input.map_prior == MapPrior::heights;
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) mean_m += lamps_m[i];
  }
  mean_m /= static_cast<double>(std::count(seen.begin(), seen.end(), true));
  Eigen::MatrixXd gauge = Eigen::MatrixXd::Zero(3 * std::ssize(lamps_m), is_plan ? 4 : 5);
  Eigen::VectorXd variances = Eigen::VectorXd::Zero(gauge.cols());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (!seen[i]) continue;
    Eigen::Vector3d p = lamps_m[i] - mean_m;
    if (is_plan) p.z() = 0;
    auto lamp_rows = gauge.middleRows<3>(3 * static_cast<Eigen::Index>(i));
    lamp_rows.col(0) = Eigen::Vector3d(-p.y(), p.x(), 0);
    lamp_rows.col(1) = p;
    lamp_rows.rightCols(gauge.cols() - 2).setIdentity();
    if (is_plan)
      variances[1] += p.squaredNorm() * std::pow(input.lamps.lamps[i].sd_m.value_or(0), 2);
  }
  // The directions are orthogonal, because p is relative to the mean.
  const Eigen::VectorXd norms = gauge.colwise().norm().cwiseMax(min_sd_m);
  const Eigen::VectorXd sd_m = variances.cwiseSqrt().cwiseQuotient(norms).cwiseMax(min_sd_m);
  return gauge * norms.cwiseProduct(sd_m).cwiseInverse().asDiagonal();
}

/// Returns the derivative of a pixel of the undistorted image with respect to the pixel of the ray.
Eigen::Matrix2d d_ideal_d_pixel(const Lens& lens, const Lens::Ray& ray) {
  const Eigen::Vector2d z = ray.direction.hnormalized();
  return lens.focal_px().asDiagonal() *
         (ray.d_direction_d_pixel.topRows<2>() - z * ray.d_direction_d_pixel.row(2)) /
         ray.direction.z();
}

/// Key of a known position that captures have in common: their pivot, or the position itself.
using PlaceKey = std::tuple<std::string, double, double, double, MeasuredPoint>;

/// Lamps of a capture that the map has, in the order of their detections.
struct CaptureLamps {
  std::vector<std::size_t> indices;
  /// For the rough pose.
  std::vector<LampObservation> sightings;
  /// For the adjustment; their capture is set with its pose.
  std::vector<AdjustmentProblem::Sighting> terms;
};

/// Builds the problem of the adjustment with its initial values, capture by capture.
class ProblemAssembler {
 public:
  explicit ProblemAssembler(const AdjustmentInput& input)
      : input_(input),
        lens_(input.calibration.camera.lens_model, input.calibration.camera.intrinsics),
        row_clock_(make_readout_clock(input.calibration.camera)),
        pivots_(list_pivots(input)),
        all_(make_empty_problem(input, pivots_.size())),
        sums_m_(pivots_.size(), Eigen::Vector3d::Zero()),
        num_captures_(pivots_.size(), 0) {
    problem_.is_zenith_exact = input.zenith_is_exact;
    problem_.is_lens_held = input.lens_is_held;
    set_lamps();
    set_tilt_and_arm();
  }

  /// Adds a capture with its known position; counts it as rejected if it determines no pose.
  void add_or_reject_capture(std::size_t input_index) {
    const AdjustmentCapture& capture = input_.captures[input_index];
    const Eigen::Matrix3d level_from_base =
        level_rotation_from_inclination(capture.inclination.value_or(Inclination{0, 0}));
    CaptureLamps lamps = resolve_lamps(capture, level_from_base);
    auto pose = capture.initial_pose;
    if (pose) {
      pose->position_m -= all_.origin_m;
    } else {
      pose = estimate_rough_pose(lamps.sightings, lamps.indices, lamps_m_);
    }
    if (!pose) {
      ++all_.rejected_captures;
      return;
    }
    const std::size_t index = problem_.captures.size();
    all_.capture_indices.push_back(input_index);
    problem_.add_capture(
        {add_to_pivot(capture, *pose), level_from_base.transpose(), capture.motion}, *pose);
    for (auto& term : lamps.terms) {
      term.capture = index;
      problem_.sightings.push_back(term);
      all_.lamp_seen[term.lamp] = true;
    }
    if (capture.known_position) add_known_position(capture, *capture.known_position, index);
  }

  /// Returns the problem; the standard deviation of a position is that of all its captures
  /// together.
  AssembledProblem finish() && {
    for (auto& place : problem_.position_observations) {
      place.sd_m *=
          std::sqrt(static_cast<double>(all_.known_positions[place.known_position].captures));
    }
    problem_.is_known_position_used.assign(all_.known_positions.size(), true);
    if (input_.map_prior != MapPrior::survey)
      problem_.gauge = make_gauge(lamps_m_, all_.lamp_seen, input_);
    for (std::size_t i = 0; i < sums_m_.size(); ++i) {
      problem_.state_vector().segment<3>(problem_.layout().pivot_state_index(i)) =
          sums_m_[i] / std::max(1, num_captures_[i]);
    }
    return std::move(all_);
  }

 private:
  static std::map<std::string, std::size_t> list_pivots(const AdjustmentInput& input) {
    std::map<std::string, std::size_t> pivots;
    for (const AdjustmentCapture& capture : input.captures) {
      if (!capture.pivot.empty()) pivots.emplace(capture.pivot, pivots.size());
    }
    return pivots;
  }

  static AssembledProblem make_empty_problem(const AdjustmentInput& input, std::size_t pivots) {
    const Camera& camera = input.calibration.camera;
    const auto& report = input.calibration.intrinsics_report;
    return {
        AdjustmentProblem(camera.lens_model,
                          LensParametrization(camera, report ? report->covariance : std::nullopt),
                          input.lamps.lamps.size(), pivots),
        compute_centroid(input.lamps)};
  }

  void set_lamps() {
    for (const Lamp& lamp : input_.lamps.lamps) {
      lamps_m_.emplace_back(lamp.position_m - all_.origin_m);
      problem_.state_vector().segment<3>(problem_.layout().lamp_state_index(lamps_m_.size() - 1)) =
          lamps_m_.back();
      problem_.lamps.push_back(
          {lamps_m_.back(), input_.map_prior == MapPrior::frame ? kInfinite : lamp.sd_m.value_or(0),
           input_.map_prior == MapPrior::heights});
    }
    all_.lamp_seen.resize(lamps_m_.size());
  }

  void set_tilt_and_arm() {
    Eigen::Vector2d zenith(0, 0);
    if (const auto& center = input_.calibration.rotation_center) {
      zenith = compute_zenith_point(*center);
      lever_arm_m_ = center->lever_arm_m.value_or(lever_arm_m_);
    }
    problem_.state_vector().segment<2>(problem_.layout().zenith) = zenith;
    problem_.state_vector().segment<2>(problem_.layout().lever_arm) = lever_arm_m_;
    base_from_camera_ =
        rotate_to_camera(zenith, Eigen::Vector3d::UnitZ()).camera_from_level.transpose();
  }

  /// Returns the first detection of each lamp above the camera, at most kMaxSightings.
  CaptureLamps resolve_lamps(const AdjustmentCapture& capture,
                             const Eigen::Matrix3d& level_from_base) {
    CaptureLamps found;
    for (const Detection& detection : capture.detections) {
      const Lamp* lamp = find_lamp_by_id(input_.lamps.lamps, detection.lamp);
      if (lamp == nullptr || found.sightings.size() == kMaxSightings) continue;
      const auto index = static_cast<std::size_t>(lamp - input_.lamps.lamps.data());
      const auto ray = lens_.unproject_pixel(detection.pixel);
      if (!ray || std::ranges::find(found.indices, index) != found.indices.end()) continue;
      const Eigen::Vector3d level = level_from_base * base_from_camera_ * ray->direction;
      if (!(level.z() > 0)) continue;
      const double sigma_px = detection.sigma_px.value_or(1);
      if (!detection.sigma_px) all_.noise_is_stated = false;
      Eigen::Matrix2d whitening = Eigen::Matrix2d::Identity() / sigma_px;
      if (input_.weighs_in_undistorted_image && !detection.sigma_px && ray->direction.z() > 0) {
        whitening = d_ideal_d_pixel(lens_, *ray);
      }
      found.terms.push_back({0, index, detection.pixel, sigma_px, whitening,
                             row_clock_ ? row_clock_->compute_readout_time_s(detection.pixel) : 0});
      found.indices.push_back(index);
      found.sightings.push_back(make_level_observation(
          lamps_m_[index], level.hnormalized(), Eigen::Matrix2d(lens_.focal_px().asDiagonal()), 1));
    }
    return found;
  }

  /// Adds the axis of a pose to the mean of its pivot. Returns the index of the pivot, if there is
  /// one.
  std::optional<std::size_t> add_to_pivot(const AdjustmentCapture& capture, const Pose& pose) {
    if (capture.pivot.empty()) return std::nullopt;
    const std::size_t pivot = pivots_.at(capture.pivot);
    const Eigen::Matrix2d turn = rotation_about_z(pose.yaw_rad).topLeftCorner<2, 2>();
    sums_m_[pivot] += pose.position_m;
    sums_m_[pivot].head<2>() -= turn * lever_arm_m_;
    ++num_captures_[pivot];
    problem_.has_lever_arm = input_.estimates_lever_arm;
    return pivot;
  }

  void add_known_position(const AdjustmentCapture& capture, const KnownPosition& place,
                          std::size_t capture_index) {
    const PlaceKey key = capture.pivot.empty()
                             ? PlaceKey{"", place.xy_m.x(), place.xy_m.y(),
                                        place.z_m.value_or(kInfinite), place.measured_point}
                             : PlaceKey{capture.pivot, 0, 0, 0, place.measured_point};
    const auto [entry, is_new] = place_of_key_.emplace(key, all_.known_positions.size());
    if (is_new) {
      all_.known_positions.push_back({capture.pivot.empty() ? capture.name : capture.pivot,
                                      place.measured_point, 0, Eigen::Vector3d::Zero(), false});
      all_.position_sd_m.push_back(place.sd_m);
    }
    ++all_.known_positions[entry->second].captures;
    Eigen::Vector3d stated_m(place.xy_m.x(), place.xy_m.y(), place.z_m.value_or(0));
    stated_m -= all_.origin_m;
    if (place.measured_point == MeasuredPoint::axis)
      problem_.has_lever_arm = input_.estimates_lever_arm;
    problem_.position_observations.push_back({capture_index, entry->second,
                                              place.measured_point == MeasuredPoint::axis, stated_m,
                                              place.z_m ? 3 : 2, place.sd_m});
  }

  const AdjustmentInput& input_;
  Lens lens_;
  std::optional<RowClock> row_clock_;
  std::map<std::string, std::size_t> pivots_;
  AssembledProblem all_;
  AdjustmentProblem& problem_ = all_.problem;
  std::vector<Eigen::Vector3d> lamps_m_;
  Eigen::Vector2d lever_arm_m_{0, 0};
  Eigen::Matrix3d base_from_camera_;
  /// Sums of the axes of each pivot's captures, and their numbers.
  std::vector<Eigen::Vector3d> sums_m_;
  std::vector<int> num_captures_;
  std::map<PlaceKey, std::size_t> place_of_key_;
};

AssembledProblem assemble_problem(const AdjustmentInput& input) {
  ProblemAssembler assembler(input);
  for (std::size_t i = 0; i < input.captures.size(); ++i) assembler.add_or_reject_capture(i);
  return std::move(assembler).finish();
}

/// Returns the norms of the whitened residuals; infinite if the lens cannot project the point.
std::vector<double> list_residual_norms(const AdjustmentProblem& problem) {
  std::vector<double> lengths;
  lengths.reserve(problem.sightings.size());
  const auto lens = problem.current_lens();
  for (const auto& sighting : problem.sightings) {
    const auto at = lens ? problem.linearize_sighting(sighting, *lens) : std::nullopt;
    lengths.push_back(at ? at->value.norm() : kInfinite);
  }
  return lengths;
}

/// Rejects detections beyond the scatter of the residuals, estimated from their median, and
/// reinstates the other ones. Rejects only those beyond half the largest residual, because an
/// outlier also changes the residuals of other detections. Returns true if the set of used
/// detections changes.
bool update_inliers(AdjustmentProblem& problem, bool noise_is_stated, double degrees_of_freedom) {
  const std::vector<double> lengths = list_residual_norms(problem);
  std::vector<double> squares;
  double worst = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (!problem.sightings[i].used) continue;
    squares.push_back(lengths[i] * lengths[i]);
    worst = std::max(worst, lengths[i]);
  }
  if (squares.empty()) return false;
  const double scatter =
      std::sqrt(estimate_variance_2d(std::move(squares), degrees_of_freedom) *
                compute_outlier_bound_2d(kDetectionOutlierSigmas, degrees_of_freedom));
  const double limit =
      std::max(scatter, kDetectionOutlierSigmas *
                            (noise_is_stated ? 1 : kMinNoise_px / problem.noise_scale));
  bool changed = false;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const bool use = lengths[i] <= (problem.sightings[i].used ? std::max(limit, worst / 2) : limit);
    changed |= use != problem.sightings[i].used;
    problem.sightings[i].used = use;
  }
  return changed;
}

/// Computes the residuals of the known positions, adjusted minus measured, as means over their
/// captures.
void set_place_residuals(AssembledProblem& all) {
  for (auto& place : all.known_positions) place.residual_m.setZero();
  for (const auto& seen : all.problem.position_observations) {
    auto& place = all.known_positions[seen.known_position];
    place.residual_m.head(seen.size) +=
        (all.problem.predict_position(seen) - seen.measured_m).head(seen.size) / place.captures;
  }
}

double normalize_residual(const AssembledProblem& all, std::size_t place) {
  return all.known_positions[place].residual_m.norm() / all.position_sd_m[place];
}

/// Returns the squared correction r of a lamp, adjusted minus surveyed, normalized by its expected
/// covariance: r' (sd^2 - C)^-1 r if the survey is used, r' (sd^2 + C)^-1 r if it is not.
double normalize_correction(const AdjustmentProblem& problem, const Eigen::MatrixXd& covariance,
                            std::size_t lamp, double sd_m, bool counts) {
  const Eigen::Index at = problem.layout().lamp_state_index(lamp);
  const Eigen::Vector3d r_m =
      problem.state_vector().segment<3>(at) - problem.lamps[lamp].surveyed_m;
  const Eigen::Matrix3d found = covariance.block<3, 3>(at, at);
  const Eigen::Matrix3d survey = sd_m * sd_m * Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(
      counts ? Eigen::Matrix3d(survey - found) : Eigen::Matrix3d(survey + found));
  // Skips directions in which only the survey determines the lamp, because no data contradict it
  // there.
  constexpr double determined = 1e-6;
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    const double variance = eigen.eigenvalues()[i];
    if (!(variance > determined * sd_m * sd_m)) continue;
    const double along = eigen.eigenvectors().col(i).dot(r_m);
    sum += along * along / variance;
  }
  return sum;
}

/// Outliers among surveyed lamps and known positions, identified one at a time.
class Contradictions {
 public:
  explicit Contradictions(AssembledProblem& all) : all_(all) {
    for (const auto& lamp : all.problem.lamps)
      sd_m_.push_back(lamp.is_height_only ? kInfinite : lamp.sd_m);
    moved_.resize(sd_m_.size());
  }

  const std::vector<bool>& is_lamp_moved() const { return moved_; }
  /// Returns true if most lamps contradict their survey, so that the moved ones cannot be
  /// identified.
  bool has_majority() const { return has_contradicting_majority_; }
  double expected_lamp_sd_m(std::size_t lamp) const { return sd_m_[lamp]; }

  /// Rejects everything far from the robust solution, which outliers do not bias.
  void reject_far() {
    constexpr double max_sigmas = 8;  // standard deviations
    for (std::size_t i = 0; i < sd_m_.size(); ++i) {
      const Eigen::Vector3d& surveyed_m = all_.problem.lamps[i].surveyed_m;
      const Eigen::Vector3d found_m =
          all_.problem.state_vector().segment<3>(all_.problem.layout().lamp_state_index(i));
      if (all_.lamp_seen[i] && sd_m_[i] > 0 &&
          (found_m - surveyed_m).norm() > max_sigmas * sd_m_[i]) {
        release_lamp(i);
      }
    }
    set_place_residuals(all_);
    for (std::size_t i = 0; i < all_.known_positions.size(); ++i) {
      all_.problem.is_known_position_used[i] = normalize_residual(all_, i) <= kMaxPlaceSigmas;
    }
  }

  /// Rejects the worst lamp or known position, or reinstates one that no longer contradicts the
  /// solution. Returns true if anything changes.
  bool refine(const Eigen::MatrixXd& covariance) {
    set_place_residuals(all_);
    for (std::size_t i = 0; i < all_.known_positions.size(); ++i) {
      if (reinstated_places_.contains(i) || all_.problem.is_known_position_used[i]) continue;
      if (normalize_residual(all_, i) > kMaxPlaceSigmas) continue;
      reinstated_places_.insert(i);
      all_.problem.is_known_position_used[i] = true;
      return true;
    }
    std::size_t worst_place = all_.known_positions.size();
    double worst = kMaxPlaceSigmas;
    for (std::size_t i = 0; i < all_.known_positions.size(); ++i) {
      if (!all_.problem.is_known_position_used[i] || normalize_residual(all_, i) <= worst) continue;
      worst = normalize_residual(all_, i);
      worst_place = i;
    }
    if (worst_place < all_.known_positions.size()) {
      all_.problem.is_known_position_used[worst_place] = false;
      return true;
    }
    std::size_t worst_lamp = sd_m_.size();
    double worst_chi = kMovedChiSquared;
    for (std::size_t i = 0; i < sd_m_.size(); ++i) {
      if (!all_.lamp_seen[i] || !(sd_m_[i] > 0) || std::isinf(sd_m_[i])) continue;
      const double chi = normalize_correction(all_.problem, covariance, i, sd_m_[i], !moved_[i]);
      if (moved_[i] && chi < kMovedChiSquared && !reinstated_.contains(i)) {
        reinstated_.insert(i);
        moved_[i] = false;
        all_.problem.lamps[i].sd_m = sd_m_[i];
        return true;
      }
      if (moved_[i] || chi <= worst_chi) continue;
      worst_chi = chi;
      worst_lamp = i;
    }
    if (worst_lamp == sd_m_.size() || has_contradicting_majority_) return false;
    const auto seen = std::count(all_.lamp_seen.begin(), all_.lamp_seen.end(), true);
    const auto released = std::count(moved_.begin(), moved_.end(), true);
    if (2 * (released + 1) >= seen) {
      has_contradicting_majority_ = true;
      for (std::size_t i = 0; i < sd_m_.size(); ++i) all_.problem.lamps[i].sd_m = sd_m_[i];
      moved_.assign(moved_.size(), false);
      return true;
    }
    release_lamp(worst_lamp);
    return true;
  }

 private:
  void release_lamp(std::size_t lamp) {
    moved_[lamp] = true;
    all_.problem.lamps[lamp].sd_m = kInfinite;
  }

  AssembledProblem& all_;
  std::vector<double> sd_m_;
  std::vector<bool> moved_;
  std::set<std::size_t> reinstated_, reinstated_places_;
  bool has_contradicting_majority_ = false;
};

/// Returns the square root of the variance factor of the detections: their RMS whitened residual.
double compute_noise_ratio(const AdjustmentProblem& problem, double degrees_of_freedom) {
  const std::vector<double> lengths = list_residual_norms(problem);
  double squares = 0;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (problem.sightings[i].used) squares += lengths[i] * lengths[i];
  }
  return std::sqrt(squares / std::max(degrees_of_freedom, 1.0));
}

/// Solves until the sets of used detections, lamps and known positions and the noise are unchanged,
/// at most 40 times. Returns std::nullopt if a solution fails.
std::optional<AdjustmentProblem::GlobalCovariance> refine_adjustment(
    AssembledProblem& all, Contradictions& contradictions) {
  AdjustmentProblem& problem = all.problem;
  constexpr int max_iterations = 40;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    if (!problem.solve_adjustment(false)) return std::nullopt;
    const auto found = problem.compute_covariance();
    const double ratio = compute_noise_ratio(problem, found.degrees_of_freedom);
    bool changed = update_inliers(problem, all.noise_is_stated, found.degrees_of_freedom);
    if (!changed) changed = contradictions.refine(found.matrix);
    constexpr double rounding = 1e-6;
    if (found.degrees_of_freedom > rounding) {
      const double scale = problem.noise_scale * ratio;
      const double next = std::max(scale, all.noise_is_stated ? 1 : kMinNoise_px);
      constexpr double tolerance = 0.01;
      if (std::abs(next / problem.noise_scale - 1) > tolerance) {
        problem.noise_scale = next;
        changed = true;
      }
    }
    if (!changed) return found;
  }
  if (!problem.solve_adjustment(false)) return std::nullopt;
  return problem.compute_covariance();
}

/// Returns the covariance for equal noise in the image, and estimates that noise. The estimates
/// keep the weights that they were solved with.
Eigen::MatrixXd compute_noise_covariance(AssembledProblem& all) {
  AdjustmentProblem& problem = all.problem;
  for (auto& sighting : problem.sightings) {
    sighting.whitening = Eigen::Matrix2d::Identity() / sighting.sigma_px;
  }
  const double ratio =
      compute_noise_ratio(problem, problem.compute_covariance().degrees_of_freedom);
  problem.noise_scale = std::max(problem.noise_scale * ratio, kMinNoise_px);
  return problem.compute_covariance().matrix;
}

std::string explain_undetermined(const AdjustmentProblem& problem,
                                 const Eigen::MatrixXd& covariance, double height_m,
                                 const AdjustmentLimits& limits, bool& has_lever_arm) {
  const UnknownIndices& at = problem.layout();
  const auto compute_max_sd = [&](Eigen::Index first) {
    const Eigen::Matrix2d block = covariance.block<2, 2>(first, first);
    return std::sqrt(eigendecompose(block).values.maxCoeff());
  };
  const bool zenith = compute_max_sd(at.zenith) <= limits.zenith_rad;
  has_lever_arm =
      problem.has_lever_arm && compute_max_sd(at.lever_arm) <= limits.lever_arm_fraction * height_m;
  if (zenith) return "";
  if (problem.has_lever_arm && !has_lever_arm) {
    return "tilt and lever arm cannot be separated; add a rotation in place at a second height, or "
           "captures at known camera positions and several yaws";
  }
  return "the captures do not determine the tilt: add a rotation in place over 90 degrees or more, "
         "or captures with more lamps at other yaws";
}

/// Moves the problem to its robust solution and rejects everything far from it. Returns false if
/// the solution fails.
bool solve_robustly(AssembledProblem& all, Contradictions& contradictions) {
  AdjustmentProblem& problem = all.problem;
  // A wide loss brings lamps and poses near their solution, from where the narrow one continues.
  constexpr double wide_scale = 30;
  problem.noise_scale = wide_scale;
  bool is_solved = problem.solve_adjustment(true);
  problem.noise_scale = 1;
  is_solved = is_solved && problem.solve_adjustment(true);
  if (!is_solved) return false;
  contradictions.reject_far();
  // The loss assumes a noise of 1 px if none is stated, and outliers bias its solution by less.
  update_inliers(problem, true, problem.compute_covariance().degrees_of_freedom);
  return true;
}

/// Solves the problem, starting with a robust solution unless the captures are checked. Returns
/// std::nullopt if it does not converge.
std::optional<AdjustmentProblem::GlobalCovariance> solve_all_stages(
    const AdjustmentInput& input, AssembledProblem& all, Contradictions& contradictions) {
  // A misidentified lamp may be at a point that the lens cannot project.
  const std::vector<double> initial_norms = list_residual_norms(all.problem);
  for (std::size_t i = 0; i < initial_norms.size(); ++i) {
    all.problem.sightings[i].used = initial_norms[i] < kInfinite;
  }
  if (!input.captures_are_checked && !solve_robustly(all, contradictions)) return std::nullopt;
  auto adjusted = refine_adjustment(all, contradictions);
  if (adjusted && input.weighs_in_undistorted_image && !all.noise_is_stated) {
    adjusted->matrix = compute_noise_covariance(all);
  }
  return adjusted;
}

/// Returns the mean height above the camera of the lamps used.
double compute_mean_height_m(const AdjustmentProblem& problem) {
  const UnknownIndices& at = problem.layout();
  const Eigen::VectorXd& state = problem.state_vector();
  double sum_m = 0;
  int count = 0;
  for (const auto& sighting : problem.sightings) {
    if (!sighting.used) continue;
    const auto& capture = problem.captures[sighting.capture];
    sum_m += state[at.lamp_state_index(sighting.lamp) + 2] -
             state[(capture.pivot ? at.pivot_state_index(*capture.pivot) : capture.local) + 2];
    ++count;
  }
  return sum_m / std::max(1, count);
}

/// Sets the counts of captures and detections, and their residuals. `lamps` are those of the
/// problem.
void set_lamp_residuals(const AssembledProblem& all, const LampMap& lamps, double freedom,
                        AdjustmentResult& result) {
  const AdjustmentProblem& problem = all.problem;
  double squares_px = 0;
  std::vector<bool> capture_used(problem.captures.size());
  const std::vector<double> lengths = list_residual_norms(problem);
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const auto& sighting = problem.sightings[i];
    const double distance_px = lengths[i] * sighting.sigma_px * problem.noise_scale;
    result.residuals.push_back({all.capture_indices[sighting.capture],
                                lamps.lamps[sighting.lamp].id, distance_px, sighting.used});
    if (!sighting.used) continue;
    ++result.detections;
    capture_used[sighting.capture] = true;
    squares_px += distance_px * distance_px;
  }
  result.rejected_detections -= result.detections;
  result.captures = static_cast<int>(std::count(capture_used.begin(), capture_used.end(), true));
  result.rejected_captures += static_cast<int>(capture_used.size()) - result.captures;
  result.degrees_of_freedom = freedom;
  result.residual_px = std::sqrt(squares_px / std::max(freedom, 1.0));
  result.noise_scale = problem.noise_scale;
  const double chance = 3 * std::sqrt(0.5 / std::max(freedom, 1.0));
  result.noise_is_contradicted = all.noise_is_stated && problem.noise_scale > 1 + chance;
}

/// Sets lens, zenith and lever arm.
void set_rotation_center(const AdjustmentProblem& problem, bool has_lever_arm,
                         AdjustmentResult& result) {
  const UnknownIndices& at = problem.layout();
  const Eigen::VectorXd& state = problem.state_vector();
  result.camera.intrinsics = problem.current_intrinsics();
  const Eigen::Vector2d focal_px = result.camera.focal_px();
  const Eigen::Vector2d zenith = state.segment<2>(at.zenith);
  result.center.model = RotationModel::tilt;
  result.center.zenith_in_camera = zenith.homogeneous().normalized();
  result.center.center_px = result.camera.principal_point_px() + focal_px.cwiseProduct(zenith);
  if (has_lever_arm) result.center.lever_arm_m = state.segment<2>(at.lever_arm);
}

/// Sets the joint covariance of intrinsics (from the directions of the lens), zenith, lever arm and
/// lamps, without the pivots. The one for the surveyed map excludes the lamps.
void set_joint_covariance(const AdjustmentProblem& problem,
                          const AdjustmentProblem::GlobalCovariance& found, bool has_lever_arm,
                          AdjustmentResult& result) {
  const UnknownIndices& at = problem.layout();
  const Eigen::Index intrinsics = count_intrinsics(result.camera);
  const Eigen::Index rows = intrinsics + at.pivots - at.zenith;
  Eigen::MatrixXd from_state = Eigen::MatrixXd::Zero(rows, at.global);
  from_state.block(0, at.lens, intrinsics, at.lens_size) =
      problem.lens_parametrization().directions;
  from_state.block(intrinsics, at.zenith, at.pivots - at.zenith, at.pivots - at.zenith)
      .setIdentity();
  if (!has_lever_arm) from_state.middleRows<2>(intrinsics + 2).setZero();
  const Eigen::Index center_size = has_lever_arm ? 4 : 2;
  result.center_covariance = found.matrix.block(at.zenith, at.zenith, center_size, center_size);
  result.refined_covariance =
      from_state * (found.matrix + found.jacobian_wrt_lens * found.jacobian_wrt_lens.transpose()) *
      from_state.transpose();
  result.refined_covariance =
      0.5 * (result.refined_covariance + result.refined_covariance.transpose()).eval();
  result.surveyed_covariance = result.refined_covariance;
  const Eigen::Index first_lamp = intrinsics + 4;
  result.surveyed_covariance.bottomRightCorner(rows - first_lamp, rows - first_lamp).setZero();
}

/// Returns the lamps with a detection, in the order of the map.
LampMap select_detected_lamps(const AdjustmentInput& input) {
  std::set<int> ids;
  for (const AdjustmentCapture& capture : input.captures) {
    for (const Detection& detection : capture.detections) ids.insert(detection.lamp);
  }
  LampMap map = input.lamps;
  std::erase_if(map.lamps, [&](const Lamp& lamp) { return !ids.contains(lamp.id); });
  return map;
}

/// Adds a note if a lamp of the map is visible in no capture.
void note_undetected(AdjustmentResult& result) {
  const std::size_t count = result.refined_map.lamps.size() - result.lamps.size();
  if (count == 0) return;
  const auto first = std::ranges::find_if(result.refined_map.lamps, [&](const Lamp& lamp) {
    return std::ranges::find(result.lamps, lamp.id, &AdjustmentResult::LampCorrection::id) ==
           result.lamps.end();
  });
  result.notes.push_back(
      count == 1
          ? fmt::format("lamp {} is visible in no capture: its position stays unchanged", first->id)
          : fmt::format("{} lamps, such as {}, are visible in no capture: their positions stay "
                        "unchanged",
                        count, first->id));
}

/// Sets the lamps with their covariances, in both joint covariances.
void set_adjusted_map(const AssembledProblem& all, const LampMap& detected_lamps,
                      const Contradictions& contradictions, AdjustmentResult& result) {
  const AdjustmentProblem& problem = all.problem;
  const UnknownIndices& at = problem.layout();
  const Eigen::VectorXd& state = problem.state_vector();
  const Eigen::Index first_lamp = count_intrinsics(result.camera) + 4;
  for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
    const int id = detected_lamps.lamps[i].id;
    Lamp& lamp = *std::ranges::find(result.refined_map.lamps, id, &Lamp::id);
    result.covariance_lamp_ids.push_back(id);
    const Eigen::Index row = first_lamp + 3 * static_cast<Eigen::Index>(i);
    const double surveyed_sd_m = contradictions.expected_lamp_sd_m(i);
    const Eigen::Vector3d correction_m =
        state.segment<3>(at.lamp_state_index(i)) - problem.lamps[i].surveyed_m;
    const Eigen::Matrix3d found = result.refined_covariance.block<3, 3>(row, row);
    const bool moved = contradictions.is_lamp_moved()[i];
    if (moved) {
      // The error of its survey is independent of the errors of other lamps.
      result.surveyed_covariance.middleRows<3>(row).setZero();
      result.surveyed_covariance.middleCols<3>(row).setZero();
    }
    // Applies to a moved lamp also, so that fixes with this map detect that its position is wrong.
    result.surveyed_covariance.block<3, 3>(row, row) =
        surveyed_sd_m * surveyed_sd_m * Eigen::Matrix3d::Identity();
    if (!all.lamp_seen[i]) continue;
    result.lamps.push_back(
        {lamp.id, correction_m, found.diagonal().cwiseMax(0).cwiseSqrt(), moved});
    if (!(surveyed_sd_m > 0)) continue;
    lamp.position_m += correction_m;
    lamp.sd_m = std::sqrt(found.trace() / 3);
  }
  note_undetected(result);
  if (contradictions.has_majority()) {
    // [ROTATION-3] `half the lamps or more` | `sd_m` too small, or other map frame than of the
    //   known positions | correct it
    result.notes.emplace_back(
        "the captures contradict the survey of half the lamps or more: is its sd_m right?");
  }
}

/// Sets the known positions, and the properties of the map that only the survey determines.
void set_position_residuals(AssembledProblem& all, AdjustmentResult& result) {
  set_place_residuals(all);
  result.known_positions = all.known_positions;
  std::size_t places_used = 0;
  for (std::size_t i = 0; i < all.known_positions.size(); ++i) {
    result.known_positions[i].is_outlier = !all.problem.is_known_position_used[i];
    if (all.problem.is_known_position_used[i]) ++places_used;
  }
  if (places_used < 3) {
    constexpr std::array<const char*, 3> undetermined_parts{
        "position, yaw and scale of the map", "yaw and scale of the map",
        "rotation of the map about the line through both positions"};
    result.notes.push_back(
        fmt::format("{} known position{}: only the survey determines {}; captures at {} more known "
                    "positions would determine it",
                    places_used, places_used == 1 ? "" : "s", undetermined_parts.at(places_used),
                    3 - places_used));
  }
}

/// Tests the correction of the lens against its covariance.
void set_adjusted_lens(const AdjustmentProblem& problem, const Eigen::MatrixXd& covariance,
                       AdjustmentResult& result) {
  const UnknownIndices& at = problem.layout();
  const Eigen::VectorXd& state = problem.state_vector();
  const Eigen::VectorXd u = state.segment(at.lens, at.lens_size);
  if (at.lens_size > 0 && !problem.is_lens_held) {
    const auto determined = eigendecompose(
        Eigen::MatrixXd(Eigen::MatrixXd::Identity(at.lens_size, at.lens_size) -
                        covariance.block(at.lens, at.lens, at.lens_size, at.lens_size)));
    for (Eigen::Index i = 0; i < at.lens_size; ++i) {
      constexpr double min_determined = 1e-3;
      if (!(determined.values[i] > min_determined)) continue;
      const double along = determined.vectors.col(i).dot(u);
      result.lens_chi_squared += along * along / determined.values[i];
      ++result.lens_degrees_of_freedom;
    }
    result.lens_is_contradicted =
        result.lens_degrees_of_freedom > 0 &&
        result.lens_chi_squared >
            compute_chi_squared_bound(kSigmasOfOneInTenThousand, result.lens_degrees_of_freedom);
  }
}

}  // namespace

MatrixX make_intrinsics_covariance(const Camera& camera, double sd_px) {
  const Lens lens(camera.lens_model, camera.intrinsics);
  constexpr int across = 16;
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(count_intrinsics(camera));
  int rays = 0;
  for (int row = 0; row < across; ++row) {
    for (int column = 0; column < across; ++column) {
      const Eigen::Vector2d fraction((column + 0.5) / across, (row + 0.5) / across);
      const auto ray = lens.unproject_pixel(
          {fraction.x() * camera.imager_px[0] - 0.5, fraction.y() * camera.imager_px[1] - 0.5});
      if (!ray) continue;
      const auto seen = lens.project_with_jacobians(ray->direction);
      if (!seen) continue;
      squares += seen->d_pixel_d_parameters.colwise().squaredNorm().transpose() / 2;
      ++rays;
    }
  }
  // An intrinsic that displaces no pixel has variance 0.
  const Eigen::ArrayXd variances = sd_px * sd_px * rays / squares.array();
  return Eigen::MatrixXd((squares.array() > 0).select(variances, 0).matrix().asDiagonal());
}

AdjustmentResult adjust_bundle(const AdjustmentInput& all_lamps, const AdjustmentLimits& limits) {
  AdjustmentResult result;
  AdjustmentInput input = all_lamps;
  input.lamps = select_detected_lamps(all_lamps);
  result.camera = input.calibration.camera;
  result.refined_map = all_lamps.lamps;
  if (input.lamps.lamps.empty()) {
    result.undetermined = kTooFewLampsMessage;
    return result;
  }
  AssembledProblem all = assemble_problem(input);
  const AdjustmentProblem& problem = all.problem;
  result.rejected_captures = all.rejected_captures;
  result.rejected_detections = static_cast<int>(problem.sightings.size());
  if (problem.captures.empty()) {
    result.undetermined = kTooFewLampsMessage;
    return result;
  }
  Contradictions contradictions(all);
  const auto adjusted = solve_all_stages(input, all, contradictions);
  if (!adjusted) {
    result.undetermined =
        "no zenith and no lamp positions fit the captures: is it the map of this room, and the "
        "calibration of this camera?";
    return result;
  }
  const Eigen::MatrixXd& covariance = adjusted->matrix;
  set_lamp_residuals(all, input.lamps, adjusted->degrees_of_freedom, result);
  bool has_lever_arm = false;
  result.lamp_height_m = compute_mean_height_m(problem);
  result.undetermined =
      explain_undetermined(problem, covariance, result.lamp_height_m, limits, has_lever_arm);
  set_rotation_center(problem, has_lever_arm, result);
  set_joint_covariance(problem, *adjusted, has_lever_arm, result);
  set_adjusted_map(all, input.lamps, contradictions, result);
  set_position_residuals(all, result);
  set_adjusted_lens(problem, covariance, result);
  return result;
}

}  // namespace vlp
