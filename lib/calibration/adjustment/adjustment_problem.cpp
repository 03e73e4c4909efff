// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/symmetric.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using CaptureMatrix = Eigen::Matrix<double, 7, 7>;
using CaptureVector = Eigen::Matrix<double, 7, 1>;

/// Position, yaw and motion of the camera (or axis) of a capture, from the state.
struct CapturePose {
  Eigen::Vector3d position_m;
  double cosine, sine;
  Eigen::Vector2d velocity_m_per_s;
  double yaw_rate_rad_per_s;

  /// Returns the lamp relative to the axis (on a spot) or to the camera, in the level frame: Rz(-g)
  /// (P - A) or Rz(-g) (P - S).
  Eigen::Vector3d lamp_in_level(const Eigen::Vector3d& lamp_m) const {
    const Eigen::Vector3d w = lamp_m - position_m;
    return {cosine * w.x() + sine * w.y(), cosine * w.y() - sine * w.x(), w.z()};
  }
};

/// Returns the rotation Rz(-angle).
Eigen::Matrix3d make_inverse_yaw_rotation(double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Eigen::Matrix3d turn;
  turn << c, s, 0, -s, c, 0, 0, 0, 1;
  return turn;
}

}  // namespace

ZenithRotation rotate_by_zenith(const Eigen::Vector2d& zenith, const Eigen::Vector3d& x) {
  // Transpose of level_from_zenith(), the smallest rotation of n to +Z.
  const double nz = 1 / std::sqrt(1 + zenith.squaredNorm());
  const Eigen::Vector2d n = zenith * nz;
  const double a = n.dot(x.head<2>()), across = a / (1 + nz), lift = x.z() - across;
  ZenithRotation turn;
  turn.x_in_camera << x.head<2>() + n * lift, nz * x.z() - a;
  turn.camera_from_level << 1 - n.x() * n.x() / (1 + nz), -n.x() * n.y() / (1 + nz), n.x(),
      -n.x() * n.y() / (1 + nz), 1 - n.y() * n.y() / (1 + nz), n.y(), -n.x(), -n.y(), nz;
  for (int i = 0; i < 2; ++i) {
    const double d_nz = -nz * nz * nz * zenith[i];
    const Eigen::Vector2d d_n = nz * Eigen::Vector2d::Unit(i) + d_nz * zenith;
    const double d_a = d_n.dot(x.head<2>());
    const double d_across = d_a / (1 + nz) - a * d_nz / ((1 + nz) * (1 + nz));
    turn.jacobian_wrt_zenith.col(i) << d_n * lift - n * d_across, d_nz * x.z() - d_a;
  }
  return turn;
}

LensParametrization::LensParametrization(const Camera& camera,
                                         const std::optional<MatrixX>& covariance)
    : start(Eigen::Map<const Eigen::VectorXd>(camera.intrinsics.data(),
                                              std::ssize(camera.intrinsics))),
      directions(count_reported_intrinsics(camera), 0) {
  if (!covariance) return;
  // Scales pixels and coefficients by their standard deviations to make them comparable.
  const Eigen::VectorXd sd = covariance->diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse_sd =
      (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Zero(sd.size()));
  const auto eigen = decompose_symmetric(
      Eigen::MatrixXd(inverse_sd.asDiagonal() * *covariance * inverse_sd.asDiagonal()));
  constexpr double rounding = 1e-12;
  const Eigen::VectorXd& values = eigen.values;
  Eigen::Index kept = 0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    kept += values[i] > rounding * values[values.size() - 1] ? 1 : 0;
  }
  directions = sd.asDiagonal() * eigen.vectors.rightCols(kept) *
               values.tail(kept).cwiseMax(0).cwiseSqrt().asDiagonal();
}

AdjustmentProblem::AdjustmentProblem(LensModel model, LensParametrization freedom,
                                     std::size_t lamp_count, std::size_t spot_count)
    : model_(model), freedom_(std::move(freedom)) {
  layout_.lens_size = freedom_.directions.cols();
  layout_.zenith = layout_.lens_size;
  layout_.lever_arm = layout_.zenith + 2;
  layout_.lamps = layout_.lever_arm + 2;
  layout_.spots = layout_.lamp(lamp_count);
  layout_.global = layout_.spot(spot_count);
  state_ = Eigen::VectorXd::Zero(layout_.global);
}

void AdjustmentProblem::add_capture(const Capture& capture, const Pose& start) {
  Capture added = capture;
  added.local = state_.size();
  captures.push_back(added);
  state_.conservativeResize(state_.size() + capture.size());
  if (!capture.spot) state_.segment<3>(added.local) = start.position_m;
  Eigen::Index next = added.local + capture.pose_size();
  state_[next - 1] = start.yaw_rad;
  if (capture.velocity_is_free()) {
    state_.segment<2>(next) = capture.motion.velocity_m_per_s;
    next += 2;
  }
  if (capture.yaw_rate_is_free()) state_[next] = capture.motion.yaw_rate_rad_per_s;
}

std::vector<double> AdjustmentProblem::intrinsics() const {
  std::vector<double> values(static_cast<std::size_t>(freedom_.start.size()));
  Eigen::Map<Eigen::VectorXd> changed(values.data(), std::ssize(values));
  changed = freedom_.start;
  changed.head(freedom_.directions.rows()).noalias() +=
      freedom_.directions * state_.segment(layout_.lens, layout_.lens_size);
  return values;
}

std::optional<Lens> AdjustmentProblem::lens() const {
  const std::vector<double> values = intrinsics();
  for (const double value : values) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  if (!(values[0] > 0 && values[1] > 0)) return std::nullopt;
  return Lens(model_, values);
}

namespace {

CapturePose compute_capture_pose(const Eigen::VectorXd& state, const AdjustmentLayout& layout,
                                 const AdjustmentProblem::Capture& capture) {
  const Eigen::Index motion = capture.local + capture.pose_size();
  const double yaw_rad = state[motion - 1];
  const Eigen::Index position = capture.spot ? layout.spot(*capture.spot) : capture.local;
  CapturePose camera{state.segment<3>(position), std::cos(yaw_rad), std::sin(yaw_rad),
                     capture.motion.velocity_m_per_s, capture.motion.yaw_rate_rad_per_s};
  // The axis is stationary.
  if (capture.spot) camera.velocity_m_per_s.setZero();
  if (capture.velocity_is_free()) camera.velocity_m_per_s = state.segment<2>(motion);
  if (capture.yaw_rate_is_free()) {
    camera.yaw_rate_rad_per_s = state[capture.local + capture.size() - 1];
  }
  return camera;
}

}  // namespace

std::optional<AdjustmentProblem::Linearized> AdjustmentProblem::linearize(const Sighting& sighting,
                                                                          const Lens& lens) const {
  const Capture& capture = captures[sighting.capture];
  const CapturePose camera = compute_capture_pose(state_, layout_, capture);
  const Eigen::Vector2d arm_m =
      capture.spot ? Eigen::Vector2d(state_.segment<2>(layout_.lever_arm)) : Eigen::Vector2d(0, 0);
  const double time_s = sighting.time_s;
  const Eigen::Vector3d lamp_at_mid_exposure =
      camera.lamp_in_level(state_.segment<3>(layout_.lamp(sighting.lamp)));
  const Eigen::Matrix3d readout_from_middle =
      make_inverse_yaw_rotation(camera.yaw_rate_rad_per_s * time_s);
  Eigen::Vector3d rotated = lamp_at_mid_exposure;
  rotated.head<2>() -= camera.velocity_m_per_s * time_s;
  rotated = (readout_from_middle * rotated).eval();
  Eigen::Vector3d level = rotated;
  level.head<2>() -= arm_m;
  const ZenithRotation turn =
      rotate_by_zenith(state_.segment<2>(layout_.zenith), capture.base_from_level * level);
  const auto seen = lens.project_with_jacobians(turn.x_in_camera);
  if (!seen) return std::nullopt;
  const Eigen::Matrix2d weight = sighting.whitening / noise_scale;
  const Matrix23 jacobian_wrt_camera = -weight * seen->d_pixel_d_point;
  const Matrix23 jacobian_wrt_level =
      jacobian_wrt_camera * turn.camera_from_level * capture.base_from_level;
  Eigen::Matrix3d level_from_world;
  level_from_world << camera.cosine, camera.sine, 0, -camera.sine, camera.cosine, 0, 0, 0, 1;
  Linearized at;
  at.residual = weight * (sighting.pixel - seen->pixel);
  at.jacobian_wrt_lens = -weight * seen->d_pixel_d_parameters * freedom_.directions;
  at.jacobian_wrt_zenith = jacobian_wrt_camera * turn.jacobian_wrt_zenith;
  at.jacobian_wrt_lever_arm = -jacobian_wrt_level.leftCols<2>();
  const Matrix23 jacobian_wrt_lamp_in_level = jacobian_wrt_level * readout_from_middle;
  at.jacobian_wrt_lamp = jacobian_wrt_lamp_in_level * level_from_world;
  at.jacobian_wrt_spot = -at.jacobian_wrt_lamp;
  at.jacobian_wrt_local.resize(2, capture.size());
  Eigen::Index next = capture.pose_size();
  if (!capture.spot) at.jacobian_wrt_local.leftCols<3>() = at.jacobian_wrt_spot;
  at.jacobian_wrt_local.col(next - 1) =
      jacobian_wrt_lamp_in_level *
      Eigen::Vector3d(lamp_at_mid_exposure.y(), -lamp_at_mid_exposure.x(), 0);
  if (capture.velocity_is_free()) {
    at.jacobian_wrt_local.middleCols<2>(next) = -time_s * jacobian_wrt_lamp_in_level.leftCols<2>();
    next += 2;
  }
  if (capture.yaw_rate_is_free()) {
    at.jacobian_wrt_local.col(next) =
        time_s * (jacobian_wrt_level * Eigen::Vector3d(rotated.y(), -rotated.x(), 0));
  }
  return at;
}

AdjustmentProblem::MotionPrior AdjustmentProblem::motion_prior(const Capture& capture) const {
  const Eigen::Index size = capture.motion_size();
  MotionPrior prior{state_.segment(capture.local + capture.pose_size(), size),
                    Eigen::VectorXd(size)};
  const KnownMotion& known = capture.motion;
  if (capture.velocity_is_free()) {
    prior.deviations.head<2>() -= known.velocity_m_per_s;
    prior.weights.head<2>().setConstant(1 / known.velocity_sd_m_per_s);
  }
  if (capture.yaw_rate_is_free()) {
    prior.deviations[size - 1] -= known.yaw_rate_rad_per_s;
    prior.weights[size - 1] = 1 / known.yaw_rate_sd_rad_per_s;
  }
  prior.deviations = prior.deviations.cwiseProduct(prior.weights).eval();
  return prior;
}

double AdjustmentProblem::count_determined_motion(std::size_t index) const {
  const Capture& capture = captures[index];
  const Eigen::Index size = capture.motion_size();
  if (size == 0) return 0;
  const auto lens = this->lens();
  if (!lens) return 0;
  Eigen::MatrixXd local = Eigen::MatrixXd::Zero(capture.size(), capture.size());
  for (const Sighting& sighting : sightings) {
    if (!sighting.used || sighting.capture != index) continue;
    const auto at = linearize(sighting, *lens);
    if (at) local += at->jacobian_wrt_local.transpose() * at->jacobian_wrt_local;
  }
  const Eigen::VectorXd weights = motion_prior(capture).weights;
  local.diagonal().tail(size) += weights.cwiseAbs2();
  const Eigen::MatrixXd covariance =
      solve_symmetric(local, Eigen::MatrixXd::Identity(capture.size(), capture.size()));
  return static_cast<double>(size) - covariance.diagonal().tail(size).dot(weights.cwiseAbs2());
}

Eigen::Vector3d AdjustmentProblem::predict_position(const PlaceObservation& place) const {
  const Capture& capture = captures[place.capture];
  const CapturePose camera = compute_capture_pose(state_, layout_, capture);
  const Eigen::Vector2d arm_m = state_.segment<2>(layout_.lever_arm);
  const Eigen::Vector3d rotated(camera.cosine * arm_m.x() - camera.sine * arm_m.y(),
                                camera.sine * arm_m.x() + camera.cosine * arm_m.y(), 0);
  // On a spot the position is the axis', elsewhere the camera's.
  const double factor = (place.of_axis ? 0 : 1) - (capture.spot ? 0 : 1);
  return camera.position_m + factor * rotated;
}

namespace {

/// Derivatives of predict_position() with respect to the lever arm and to the yaw.
struct PlaceDerivatives {
  Eigen::Matrix<double, 3, 2> jacobian_wrt_arm;
  Eigen::Vector3d jacobian_wrt_yaw;
};

PlaceDerivatives compute_place_derivatives(const AdjustmentProblem& problem,
                                           const AdjustmentProblem::PlaceObservation& place) {
  const auto& capture = problem.captures[place.capture];
  const CapturePose camera = compute_capture_pose(problem.state(), problem.layout(), capture);
  const Eigen::Vector2d arm_m = problem.state().segment<2>(problem.layout().lever_arm);
  // On a spot the position is that of the axis, elsewhere that of the camera.
  const double factor = (place.of_axis ? 0 : 1) - (capture.spot ? 0 : 1);
  PlaceDerivatives at;
  at.jacobian_wrt_arm << camera.cosine, -camera.sine, camera.sine, camera.cosine, 0, 0;
  at.jacobian_wrt_arm *= factor;
  at.jacobian_wrt_yaw << factor * (-camera.sine * arm_m.x() - camera.cosine * arm_m.y()),
      factor * (camera.cosine * arm_m.x() - camera.sine * arm_m.y()), 0;
  return at;
}

bool depends_on_lever_arm(const AdjustmentProblem& problem,
                          const AdjustmentProblem::PlaceObservation& place) {
  return problem.captures[place.capture].spot.has_value() != place.of_axis;
}

}  // namespace

/// Cost functions and solver. The unknowns stay in the state vector of the problem. The order of
/// their addresses, and with it the rounding in Ceres, is therefore always the same.
struct AdjustmentCosts {
  struct LensUpdater : ceres::EvaluationCallback {
    explicit LensUpdater(const AdjustmentProblem& of) : problem(of) {}
    void PrepareForEvaluation(bool, bool new_point) override {
      if (new_point || !lens) lens = problem.lens();
    }
    const AdjustmentProblem& problem;
    std::optional<Lens> lens;
  };

  static void copy(double** jacobians, int& block, const Eigen::MatrixXd& values) {
    if (jacobians[block] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[block], values.rows(), values.cols()) = values;
    }
    ++block;
  }

  /// Residual of an observation. Blocks: local unknowns of the capture, [spot, lever arm], zenith,
  /// lamp, [lens].
  class ObservationCost : public ceres::CostFunction {
   public:
    ObservationCost(const AdjustmentProblem& problem, const LensUpdater& lenses,
                    const AdjustmentProblem::Sighting& sighting)
        : problem_(problem), lenses_(lenses), sighting_(sighting) {
      set_num_residuals(2);
      on_spot_ = problem.captures[sighting.capture].spot.has_value();
      auto& sizes = *mutable_parameter_block_sizes();
      const auto local = static_cast<int32_t>(problem.captures[sighting.capture].size());
      sizes =
          on_spot_ ? std::vector<int32_t>{local, 3, 2, 2, 3} : std::vector<int32_t>{local, 2, 3};
      const auto lens_size = static_cast<int32_t>(problem.layout().lens_size);
      if (lens_size > 0) sizes.push_back(lens_size);
    }
    bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
      if (!lenses_.lens) return false;
      const auto at = problem_.linearize(sighting_, *lenses_.lens);
      if (!at) return false;
      Eigen::Map<Eigen::Vector2d>(residuals, 2) = at->residual;
      if (jacobians == nullptr) return true;
      int block = 0;
      copy(jacobians, block, at->jacobian_wrt_local);
      if (on_spot_) {
        copy(jacobians, block, at->jacobian_wrt_spot);
        copy(jacobians, block, at->jacobian_wrt_lever_arm);
      }
      copy(jacobians, block, at->jacobian_wrt_zenith);
      copy(jacobians, block, at->jacobian_wrt_lamp);
      if (at->jacobian_wrt_lens.cols() > 0) copy(jacobians, block, at->jacobian_wrt_lens);
      return true;
    }

   private:
    const AdjustmentProblem& problem_;
    const LensUpdater& lenses_;
    const AdjustmentProblem::Sighting& sighting_;
    bool on_spot_;
  };

  /// Residual (unknowns - prior mean) / sd.
  class PriorCost : public ceres::CostFunction {
   public:
    PriorCost(Eigen::VectorXd value, double sd) : value_(std::move(value)), weight_(1 / sd) {
      set_num_residuals(static_cast<int>(value_.size()));
      mutable_parameter_block_sizes()->push_back(static_cast<int32_t>(value_.size()));
    }
    bool Evaluate(double const* const* parameters, double* residuals,
                  double** jacobians) const override {
      const Eigen::Index n = value_.size();
      Eigen::Map<Eigen::VectorXd>(residuals, n) =
          weight_ * (Eigen::Map<const Eigen::VectorXd>(parameters[0], n) - value_);
      int block = 0;
      if (jacobians != nullptr) {
        copy(jacobians, block, weight_ * Eigen::MatrixXd::Identity(n, n));
      }
      return true;
    }

   private:
    Eigen::VectorXd value_;
    double weight_;
  };

  /// Constraint of the fixed directions of the lamps. Blocks: all lamps.
  class GaugeCost : public ceres::CostFunction {
   public:
    explicit GaugeCost(const AdjustmentProblem& problem) : problem_(problem) {
      set_num_residuals(static_cast<int>(problem.gauge.cols()));
      mutable_parameter_block_sizes()->assign(problem.lamps.size(), 3);
    }
    bool Evaluate(double const* const* lamps, double* residuals,
                  double** jacobians) const override {
      const Eigen::MatrixXd& gauge = problem_.gauge;
      Eigen::Map<Eigen::VectorXd> constraint(residuals, gauge.cols());
      constraint.setZero();
      int block = 0;
      for (std::size_t i = 0; i < problem_.lamps.size(); ++i) {
        const Eigen::MatrixXd jacobian_wrt_lamp =
            gauge.middleRows<3>(3 * static_cast<Eigen::Index>(i)).transpose();
        constraint += jacobian_wrt_lamp *
                      (Eigen::Map<const Eigen::Vector3d>(lamps[i]) - problem_.lamps[i].surveyed_m);
        if (jacobians != nullptr) copy(jacobians, block, jacobian_wrt_lamp);
      }
      return true;
    }

   private:
    const AdjustmentProblem& problem_;
  };

  /// Prior of the motion of a capture. Block: local unknowns of the capture.
  class MotionCost : public ceres::CostFunction {
   public:
    MotionCost(const AdjustmentProblem& problem, const AdjustmentProblem::Capture& capture)
        : problem_(problem), capture_(capture) {
      set_num_residuals(static_cast<int>(capture.motion_size()));
      mutable_parameter_block_sizes()->push_back(static_cast<int32_t>(capture.size()));
    }
    bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
      const auto [deviations, weights] = problem_.motion_prior(capture_);
      Eigen::Map<Eigen::VectorXd>(residuals, deviations.size()) = deviations;
      if (jacobians == nullptr) return true;
      Eigen::MatrixXd jacobian_wrt_local = Eigen::MatrixXd::Zero(weights.size(), capture_.size());
      jacobian_wrt_local.rightCols(weights.size()) = weights.asDiagonal();
      int block = 0;
      copy(jacobians, block, jacobian_wrt_local);
      return true;
    }

   private:
    const AdjustmentProblem& problem_;
    const AdjustmentProblem::Capture& capture_;
  };

  /// Residual of a known position. Blocks: local unknowns of the capture, [spot], [lever arm].
  class PlaceCost : public ceres::CostFunction {
   public:
    PlaceCost(const AdjustmentProblem& problem, const AdjustmentProblem::PlaceObservation& place)
        : problem_(problem), place_(place) {
      set_num_residuals(static_cast<int>(place.size));
      auto& sizes = *mutable_parameter_block_sizes();
      on_spot_ = problem.captures[place.capture].spot.has_value();
      local_size_ = problem.captures[place.capture].size();
      sizes = {static_cast<int32_t>(local_size_)};
      if (on_spot_) sizes.push_back(3);
      if (depends_on_lever_arm(problem, place)) sizes.push_back(2);
    }
    bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
      const Eigen::Vector3d residual_m = problem_.predict_position(place_) - place_.stated_m;
      Eigen::Map<Eigen::VectorXd>(residuals, place_.size) =
          residual_m.head(place_.size) / place_.sd_m;
      if (jacobians == nullptr) return true;
      const PlaceDerivatives at = compute_place_derivatives(problem_, place_);
      int block = 0;
      const auto rows = [&](const Eigen::MatrixXd& values) -> Eigen::MatrixXd {
        return values.topRows(place_.size) / place_.sd_m;
      };
      Eigen::MatrixXd jacobian_wrt_local = Eigen::MatrixXd::Zero(3, local_size_);
      jacobian_wrt_local.col(on_spot_ ? 0 : 3) = at.jacobian_wrt_yaw;
      if (!on_spot_) jacobian_wrt_local.leftCols<3>().setIdentity();
      copy(jacobians, block, rows(jacobian_wrt_local));
      if (on_spot_) copy(jacobians, block, rows(Eigen::Matrix3d::Identity()));
      if (depends_on_lever_arm(problem_, place_)) copy(jacobians, block, rows(at.jacobian_wrt_arm));
      return true;
    }

   private:
    const AdjustmentProblem& problem_;
    const AdjustmentProblem::PlaceObservation& place_;
    bool on_spot_;
    Eigen::Index local_size_;
  };

  static bool solve(AdjustmentProblem& problem, bool robust) {
    // 95 % efficiency for normal noise, approximately in two and in three dimensions.
    constexpr double width = 2.385;
    const auto loss = [robust]() -> ceres::LossFunction* {
      return robust ? new ceres::CauchyLoss(width) : nullptr;
    };
    LensUpdater lenses(problem);
    ceres::Problem::Options problem_options;
    problem_options.evaluation_callback = &lenses;
    ceres::Problem ceres(problem_options);
    const AdjustmentLayout& layout = problem.layout();
    double* const state = problem.state_.data();
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    const auto add = [&](Eigen::Index at, Eigen::Index size, int group) {
      ceres.AddParameterBlock(state + at, static_cast<int>(size));
      order->AddElementToGroup(state + at, group);
      return state + at;
    };
    std::vector<bool> spot_seen((static_cast<std::size_t>(layout.global - layout.spots)) / 3);
    std::vector<bool> lamp_seen(problem.lamps.size());
    const bool has_lens = layout.lens_size > 0;
    if (has_lens) {
      add(layout.lens, layout.lens_size, 1);
      ceres.AddResidualBlock(new PriorCost(Eigen::VectorXd::Zero(layout.lens_size), 1), nullptr,
                             state + layout.lens);
    }
    add(layout.zenith, 2, 1);
    for (const auto& sighting : problem.sightings) {
      if (!sighting.used) continue;
      const auto& capture = problem.captures[sighting.capture];
      std::vector<double*> blocks{add(capture.local, capture.size(), 0)};
      if (capture.spot) {
        blocks.push_back(add(layout.spot(*capture.spot), 3, 1));
        blocks.push_back(add(layout.lever_arm, 2, 1));
      }
      blocks.push_back(state + layout.zenith);
      blocks.push_back(add(layout.lamp(sighting.lamp), 3, 1));
      lamp_seen[sighting.lamp] = true;
      if (has_lens) blocks.push_back(state + layout.lens);
      ceres.AddResidualBlock(new ObservationCost(problem, lenses, sighting), loss(), blocks);
    }
    for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
      const auto& [surveyed_m, sd_m] = problem.lamps[i];
      double* const lamp = state + layout.lamp(i);
      if (!lamp_seen[i] || std::isinf(sd_m)) continue;
      if (sd_m == 0) {
        ceres.SetParameterBlockConstant(lamp);
      } else {
        ceres.AddResidualBlock(new PriorCost(surveyed_m, sd_m), loss(), lamp);
      }
    }
    if (problem.gauge.cols() > 0) {
      std::vector<double*> blocks;
      for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
        blocks.push_back(add(layout.lamp(i), 3, 1));
        if (!lamp_seen[i]) ceres.SetParameterBlockConstant(blocks.back());
      }
      ceres.AddResidualBlock(new GaugeCost(problem), nullptr, blocks);
    }
    for (const auto& place : problem.places) {
      if (!problem.place_used[place.place]) continue;
      const auto& capture = problem.captures[place.capture];
      std::vector<double*> blocks{state + capture.local};
      if (!ceres.HasParameterBlock(state + capture.local)) continue;  // none of its lamps is used
      if (capture.spot) blocks.push_back(state + layout.spot(*capture.spot));
      if (depends_on_lever_arm(problem, place)) blocks.push_back(add(layout.lever_arm, 2, 1));
      ceres.AddResidualBlock(new PlaceCost(problem, place), loss(), blocks);
    }
    for (const auto& capture : problem.captures) {
      if (capture.motion_size() == 0 || !ceres.HasParameterBlock(state + capture.local)) continue;
      ceres.AddResidualBlock(new MotionCost(problem, capture), nullptr, state + capture.local);
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = order;
    options.max_num_iterations = 100;
    // Plain least squares starts near its solution: Gauss-Newton steps with barely any damping.
    if (!robust) options.initial_trust_region_radius = 1e8;
    options.function_tolerance = robust ? 1e-5 : 1e-14;
    options.gradient_tolerance = 1e-14;
    options.parameter_tolerance = 1e-12;
    options.num_threads = 1;  // keeps the order of sums and so their rounding
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres, &summary);
    return summary.IsSolutionUsable() && problem.state_.allFinite();
  }
};

bool AdjustmentProblem::solve(bool robust) { return AdjustmentCosts::solve(*this, robust); }

namespace {

/// Information of the local unknowns of a capture, and the cross block with global unknowns, for
/// marginalization.
struct LocalBlock {
  CaptureMatrix local = CaptureMatrix::Zero();
  std::vector<Eigen::Index> columns;
  std::vector<CaptureVector> cross;

  void add(const Eigen::MatrixXd& jacobian_wrt_local, Eigen::Index first,
           const Eigen::MatrixXd& jacobian_wrt_global) {
    const Eigen::MatrixXd product = jacobian_wrt_local.transpose() * jacobian_wrt_global;
    for (Eigen::Index i = 0; i < product.cols(); ++i) {
      CaptureVector column = CaptureVector::Zero();
      column.head(product.rows()) = product.col(i);
      const auto place = std::find(columns.begin(), columns.end(), first + i);
      if (place == columns.end()) {
        columns.push_back(first + i);
        cross.push_back(column);
      } else {
        cross[static_cast<std::size_t>(place - columns.begin())] += column;
      }
    }
  }
};

/// Derivatives of residuals with respect to global unknowns: first column and block of each part.
using Parts = std::vector<std::pair<Eigen::Index, Eigen::MatrixXd>>;

/// Returns the derivatives of the whitened residual of a known position with respect to the local
/// unknowns of the capture. Stores those with respect to the global unknowns in `parts`.
Eigen::MatrixXd whitened_derivatives(const AdjustmentProblem& problem,
                                     const AdjustmentProblem::PlaceObservation& place,
                                     Parts& parts) {
  const AdjustmentLayout& at = problem.layout();
  const auto& capture = problem.captures[place.capture];
  const PlaceDerivatives derivatives = compute_place_derivatives(problem, place);
  const Eigen::Index rows = place.size;
  const Eigen::MatrixXd jacobian_wrt_position =
      Eigen::MatrixXd(Eigen::Matrix3d::Identity()).topRows(rows) / place.sd_m;
  parts.clear();
  Eigen::MatrixXd jacobian_wrt_local(rows, capture.spot ? 1 : 4);
  if (capture.spot) {
    jacobian_wrt_local = derivatives.jacobian_wrt_yaw.head(rows) / place.sd_m;
    parts.emplace_back(at.spot(*capture.spot), jacobian_wrt_position);
  } else {
    jacobian_wrt_local << jacobian_wrt_position,
        derivatives.jacobian_wrt_yaw.head(rows) / place.sd_m;
  }
  if (depends_on_lever_arm(problem, place)) {
    parts.emplace_back(at.lever_arm, derivatives.jacobian_wrt_arm.topRows(rows) / place.sd_m);
  }
  return jacobian_wrt_local;
}

/// Marginalization of the local unknowns of a capture: their information N, and N^-1 times the
/// cross block.
struct Marginalization {
  Eigen::MatrixXd local, local_from_global;
};

/// Returns the trace of the covariance of whitened residuals,
///   tr(B N^-1 B' + (A - B N^-1 M) C (A - B N^-1 M)')
/// with their derivatives B (`jacobian_wrt_local`) with respect to the local unknowns and A
/// (`parts`) with respect to the global unknowns `columns`. M is the cross block, C the covariance
/// of the global unknowns.
double predicted_variance(const Eigen::MatrixXd& jacobian_wrt_local, const Parts& parts,
                          const std::vector<Eigen::Index>& columns,
                          const Marginalization& marginalized,
                          const Eigen::MatrixXd& global_covariance) {
  Eigen::MatrixXd local_rows =
      Eigen::MatrixXd::Zero(jacobian_wrt_local.rows(), marginalized.local.rows());
  local_rows.leftCols(jacobian_wrt_local.cols()) = jacobian_wrt_local;
  Eigen::MatrixXd global_rows =
      Eigen::MatrixXd::Zero(jacobian_wrt_local.rows(), global_covariance.cols());
  for (const auto& [first, jacobian_wrt_global] : parts) {
    global_rows.middleCols(first, jacobian_wrt_global.cols()) = jacobian_wrt_global;
  }
  const Eigen::MatrixXd rows =
      global_rows(Eigen::all, columns) - local_rows * marginalized.local_from_global;
  return local_rows
             .cwiseProduct(solve_symmetric(marginalized.local, local_rows.transpose()).transpose())
             .sum() +
         rows.cwiseProduct(rows * global_covariance(columns, columns)).sum();
}

void add_information(const Parts& parts, Eigen::MatrixXd& information) {
  for (const auto& [row, a] : parts) {
    for (const auto& [col, b] : parts) {
      information.block(row, col, a.cols(), b.cols()) += a.transpose() * b;
    }
  }
}

/// Returns the prior information of the global unknowns. Unknowns without a prior have the
/// information of a guess.
Eigen::MatrixXd prior_information(const AdjustmentProblem& problem) {
  const AdjustmentLayout& at = problem.layout();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(at.global, at.global);
  constexpr double guess_rad = 1, guess_m = 10;
  information.diagonal().segment(at.lens, at.lens_size).setOnes();
  information.diagonal().segment<2>(at.zenith).setConstant(1 / (guess_rad * guess_rad));
  information.diagonal().tail(at.global - at.lever_arm).setConstant(1 / (guess_m * guess_m));
  for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
    const double sd_m = problem.lamps[i].sd_m;
    if (std::isinf(sd_m)) continue;
    information.diagonal().segment<3>(at.lamp(i)).setConstant(sd_m > 0 ? 1 / (sd_m * sd_m) : 1);
  }
  const Eigen::MatrixXd& gauge = problem.gauge;
  if (gauge.cols() > 0) {
    information.block(at.lamps, at.lamps, gauge.rows(), gauge.rows()) += gauge * gauge.transpose();
  }
  return information;
}

/// Stores the derivatives of an observation with respect to the global unknowns in `parts`.
void set_parts(const AdjustmentProblem& problem, const AdjustmentProblem::Sighting& sighting,
               const AdjustmentProblem::Linearized& seen, Parts& parts) {
  const AdjustmentLayout& at = problem.layout();
  const auto& spot = problem.captures[sighting.capture].spot;
  parts.clear();
  if (at.lens_size > 0) parts.emplace_back(at.lens, seen.jacobian_wrt_lens);
  parts.emplace_back(at.zenith, seen.jacobian_wrt_zenith);
  if (problem.lamps[sighting.lamp].sd_m > 0) {
    parts.emplace_back(at.lamp(sighting.lamp), seen.jacobian_wrt_lamp);
  }
  if (spot) {
    parts.emplace_back(at.lever_arm, seen.jacobian_wrt_lever_arm);
    parts.emplace_back(at.spot(*spot), seen.jacobian_wrt_spot);
  }
}

/// Adds the information of residuals with these derivatives to that of the global unknowns and of
/// the local unknowns.
void add_residuals(const Eigen::MatrixXd& jacobian_wrt_local, const Parts& parts,
                   Eigen::MatrixXd& information, LocalBlock& block) {
  add_information(parts, information);
  block.local.topLeftCorner(jacobian_wrt_local.cols(), jacobian_wrt_local.cols()) +=
      jacobian_wrt_local.transpose() * jacobian_wrt_local;
  for (const auto& [first, jacobian_wrt_global] : parts)
    block.add(jacobian_wrt_local, first, jacobian_wrt_global);
}

/// Marginalizes the local unknowns of a capture from the information of the global ones.
/// @pre the capture is used
Marginalization marginalize(const AdjustmentProblem& problem,
                            const AdjustmentProblem::Capture& capture, const LocalBlock& block,
                            Eigen::MatrixXd& information) {
  const Eigen::Index size = capture.size(), n = std::ssize(block.columns);
  CaptureMatrix known = block.local;
  const Eigen::VectorXd weights = problem.motion_prior(capture).weights;
  known.diagonal().segment(capture.pose_size(), weights.size()) += weights.cwiseAbs2();
  Eigen::MatrixXd cross(size, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    cross.col(i) = block.cross[static_cast<std::size_t>(i)].head(size);
  }
  const Marginalization marginalized{known.topLeftCorner(size, size),
                                     solve_symmetric(known.topLeftCorner(size, size), cross)};
  const Eigen::MatrixXd subtracted = cross.transpose() * marginalized.local_from_global;
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      information(block.columns[static_cast<std::size_t>(i)],
                  block.columns[static_cast<std::size_t>(j)]) -= subtracted(i, j);
    }
  }
  return marginalized;
}

/// Returns the inverse of the information; zero for exact lamps.
Eigen::MatrixXd covariance_from_information(const AdjustmentProblem& problem,
                                            const Eigen::MatrixXd& information) {
  const AdjustmentLayout& at = problem.layout();
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * information * scale.asDiagonal();
  Eigen::MatrixXd covariance =
      scale.asDiagonal() *
      solve_symmetric(scaled, Eigen::MatrixXd::Identity(at.global, at.global)) * scale.asDiagonal();
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
    if (problem.lamps[i].sd_m > 0) continue;
    covariance.middleRows<3>(at.lamp(i)).setZero();
    covariance.middleCols<3>(at.lamp(i)).setZero();
  }
  return covariance;
}

}  // namespace

AdjustmentProblem::GlobalCovariance AdjustmentProblem::global_covariance() const {
  Eigen::MatrixXd information = prior_information(*this);
  std::vector<LocalBlock> local(captures.size());
  std::vector<bool> capture_used(captures.size());
  const auto lens = this->lens();
  Parts parts;
  for (const Sighting& sighting : sightings) {
    if (!sighting.used || !lens) continue;
    const auto seen = linearize(sighting, *lens);
    if (!seen) continue;
    capture_used[sighting.capture] = true;
    set_parts(*this, sighting, *seen, parts);
    add_residuals(seen->jacobian_wrt_local, parts, information, local[sighting.capture]);
  }
  for (const PlaceObservation& place : places) {
    if (!place_used[place.place] || !capture_used[place.capture]) continue;
    const Eigen::MatrixXd jacobian_wrt_local = whitened_derivatives(*this, place, parts);
    add_residuals(jacobian_wrt_local, parts, information, local[place.capture]);
  }
  std::vector<Marginalization> marginalized(captures.size());
  for (std::size_t k = 0; k < captures.size(); ++k) {
    if (local[k].columns.empty()) continue;
    marginalized[k] = marginalize(*this, captures[k], local[k], information);
  }
  const Eigen::MatrixXd covariance = covariance_from_information(*this, information);
  double determined_by_places = 0;
  for (const PlaceObservation& place : places) {
    if (!place_used[place.place] || !capture_used[place.capture]) continue;
    const Eigen::MatrixXd jacobian_wrt_local = whitened_derivatives(*this, place, parts);
    determined_by_places +=
        predicted_variance(jacobian_wrt_local, parts, local[place.capture].columns,
                           marginalized[place.capture], covariance);
  }
  return {covariance, determined_by_places};
}

}  // namespace vlp
