// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/adjustment/adjustment_problem.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <utility>

#include "calibration/ceres_solve.h"
#include "geometry/symmetric.h"
#include "rig/calibration_error.h"

namespace vlp {
namespace {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
/// Position, yaw and motion of the camera (or axis) of a capture, from the state.
struct CapturePose {
  Eigen::Vector3d position_m;
  /// Rz(-g).
  Eigen::Matrix3d level_from_world;
  Eigen::Vector2d velocity_m_per_s;
  double yaw_rate_rad_per_s;
};

}  // namespace

ZenithRotation rotate_to_camera(const Eigen::Vector2d& zenith, const Eigen::Vector3d& x) {
  // Transpose of level_rotation_from_zenith(), the smallest rotation of n to +Z.
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
    : nominal_intrinsics(Eigen::Map<const Eigen::VectorXd>(camera.intrinsics.data(),
                                                           std::ssize(camera.intrinsics))),
      directions(count_intrinsics(camera), 0) {
  if (!covariance) return;
  // Scales pixels and coefficients by their standard deviations to make them comparable.
  const Eigen::VectorXd sd = covariance->diagonal().cwiseSqrt();
  const Eigen::VectorXd inverse_sd =
      (sd.array() > 0).select(sd.cwiseInverse(), Eigen::VectorXd::Zero(sd.size()));
  const auto eigen = eigendecompose(
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

AdjustmentProblem::AdjustmentProblem(LensModel model, LensParametrization lens,
                                     std::size_t lamp_count, std::size_t spot_count)
    : model_(model), lens_parametrization_(std::move(lens)) {
  layout_.lens_size = lens_parametrization_.directions.cols();
  layout_.zenith = layout_.lens_size;
  layout_.lever_arm = layout_.zenith + 2;
  layout_.lamps = layout_.lever_arm + 2;
  layout_.pivots = layout_.lamp_state_index(lamp_count);
  layout_.global = layout_.pivot_state_index(spot_count);
  state_ = Eigen::VectorXd::Zero(layout_.global);
}

void AdjustmentProblem::add_capture(const Capture& capture, const Pose& start) {
  Capture added = capture;
  added.local = state_.size();
  captures.push_back(added);
  state_.conservativeResize(state_.size() + capture.size());
  if (!capture.pivot) state_.segment<3>(added.local) = start.position_m;
  Eigen::Index next = added.local + capture.num_pose_unknowns();
  state_[next - 1] = start.yaw_rad;
  if (capture.is_velocity_estimated()) {
    state_.segment<2>(next) = capture.motion.velocity_m_per_s;
    next += 2;
  }
  if (capture.is_yaw_rate_estimated()) state_[next] = capture.motion.yaw_rate_rad_per_s;
}

std::vector<double> AdjustmentProblem::current_intrinsics() const {
  std::vector<double> values(
      static_cast<std::size_t>(lens_parametrization_.nominal_intrinsics.size()));
  Eigen::Map<Eigen::VectorXd> changed(values.data(), std::ssize(values));
  changed = lens_parametrization_.nominal_intrinsics;
  changed.head(lens_parametrization_.directions.rows()).noalias() +=
      lens_parametrization_.directions * state_.segment(layout_.lens, layout_.lens_size);
  return values;
}

std::optional<Lens> AdjustmentProblem::current_lens() const {
  const std::vector<double> values = current_intrinsics();
  for (const double value : values) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  if (!(values[0] > 0 && values[1] > 0)) return std::nullopt;
  return Lens(model_, values);
}

namespace {

CapturePose compute_capture_pose(const Eigen::VectorXd& state, const UnknownIndices& layout,
                                 const AdjustmentProblem::Capture& capture) {
  const Eigen::Index motion = capture.local + capture.num_pose_unknowns();
  const double yaw_rad = state[motion - 1];
  const Eigen::Index position =
      capture.pivot ? layout.pivot_state_index(*capture.pivot) : capture.local;
  CapturePose camera{state.segment<3>(position), rotation_about_z(-yaw_rad),
                     capture.motion.velocity_m_per_s, capture.motion.yaw_rate_rad_per_s};
  // The axis is stationary.
  if (capture.pivot) camera.velocity_m_per_s.setZero();
  if (capture.is_velocity_estimated()) camera.velocity_m_per_s = state.segment<2>(motion);
  if (capture.is_yaw_rate_estimated()) {
    camera.yaw_rate_rad_per_s = state[capture.local + capture.size() - 1];
  }
  return camera;
}

/// Returns the factor of the lever arm in a known position. At a pivot the position of the capture
/// is the axis', elsewhere the camera's.
double arm_factor(const AdjustmentProblem::PositionObservation& place,
                  const AdjustmentProblem::Capture& capture) {
  return (place.is_axis_position ? 0 : 1) - (capture.pivot ? 0 : 1);
}

}  // namespace

std::optional<AdjustmentResidual> AdjustmentProblem::linearize_sighting(const Sighting& sighting,
                                                                        const Lens& lens) const {
  const Capture& capture = captures[sighting.capture];
  const CapturePose camera = compute_capture_pose(state_, layout_, capture);
  const Eigen::Index lamp = layout_.lamp_state_index(sighting.lamp);
  const double time_s = sighting.time_s;
  const Eigen::Vector3d lamp_at_mid_exposure =
      camera.level_from_world * (state_.segment<3>(lamp) - camera.position_m);
  const Eigen::Matrix3d readout_from_middle = rotation_about_z(-camera.yaw_rate_rad_per_s * time_s);
  Eigen::Vector3d rotated = lamp_at_mid_exposure;
  rotated.head<2>() -= camera.velocity_m_per_s * time_s;
  rotated = (readout_from_middle * rotated).eval();
  Eigen::Vector3d level = rotated;
  if (capture.pivot) level.head<2>() -= state_.segment<2>(layout_.lever_arm);
  const ZenithRotation turn =
      rotate_to_camera(state_.segment<2>(layout_.zenith), capture.base_from_level * level);
  const auto seen = lens.project_with_jacobians(turn.x_in_camera);
  if (!seen) return std::nullopt;
  const Eigen::Matrix2d weight = sighting.whitening / noise_scale;
  const Matrix23 by_camera = -weight * seen->d_pixel_d_point;
  const Matrix23 by_level = by_camera * turn.camera_from_level * capture.base_from_level;
  const Matrix23 by_lamp_in_level = by_level * readout_from_middle;
  const Matrix23 by_lamp = by_lamp_in_level * camera.level_from_world;
  Eigen::MatrixXd by_local(2, capture.size());
  Eigen::Index next = capture.num_pose_unknowns();
  if (!capture.pivot) by_local.leftCols<3>() = -by_lamp;
  by_local.col(next - 1) =
      by_lamp_in_level * Eigen::Vector3d(lamp_at_mid_exposure.y(), -lamp_at_mid_exposure.x(), 0);
  if (capture.is_velocity_estimated()) {
    by_local.middleCols<2>(next) = -time_s * by_lamp_in_level.leftCols<2>();
    next += 2;
  }
  if (capture.is_yaw_rate_estimated()) {
    by_local.col(next) = time_s * (by_level * Eigen::Vector3d(rotated.y(), -rotated.x(), 0));
  }
  AdjustmentResidual at{weight * (sighting.pixel - seen->pixel), {{capture.local, by_local}}};
  if (capture.pivot) {
    at.blocks.push_back({layout_.pivot_state_index(*capture.pivot), -by_lamp});
    if (has_lever_arm) at.blocks.push_back({layout_.lever_arm, -by_level.leftCols<2>()});
  }
  at.blocks.push_back({layout_.zenith, by_camera * turn.jacobian_wrt_zenith});
  at.blocks.push_back({lamp, by_lamp});
  if (layout_.lens_size > 0) {
    at.blocks.push_back(
        {layout_.lens, -weight * seen->d_pixel_d_parameters * lens_parametrization_.directions});
  }
  return at;
}

Eigen::Vector3d AdjustmentProblem::predict_position(const PositionObservation& place) const {
  const Capture& capture = captures[place.capture];
  const CapturePose camera = compute_capture_pose(state_, layout_, capture);
  Eigen::Vector3d arm_m = Eigen::Vector3d::Zero();
  arm_m.head<2>() = state_.segment<2>(layout_.lever_arm);
  return camera.position_m +
         arm_factor(place, capture) * (camera.level_from_world.transpose() * arm_m);
}

AdjustmentResidual AdjustmentProblem::linearize_place(const PositionObservation& place) const {
  const Capture& capture = captures[place.capture];
  const CapturePose camera = compute_capture_pose(state_, layout_, capture);
  const double factor = arm_factor(place, capture);
  const Eigen::Vector3d position_m = predict_position(place);
  const Eigen::Vector3d arm_m = position_m - camera.position_m;
  Eigen::MatrixXd by_local = Eigen::MatrixXd::Zero(3, capture.size());
  if (!capture.pivot) by_local.leftCols<3>().setIdentity();
  by_local.col(capture.num_pose_unknowns() - 1) << -arm_m.y(), arm_m.x(), 0;
  AdjustmentResidual at{position_m - place.measured_m, {{capture.local, by_local}}};
  if (capture.pivot)
    at.blocks.push_back({layout_.pivot_state_index(*capture.pivot), Eigen::Matrix3d::Identity()});
  if (factor != 0 && has_lever_arm) {
    at.blocks.push_back(
        {layout_.lever_arm, factor * camera.level_from_world.transpose().leftCols<2>()});
  }
  at.value = (at.value.head(place.size) / place.sd_m).eval();
  for (auto& [first, jacobian] : at.blocks) {
    jacobian = (jacobian.topRows(place.size) / place.sd_m).eval();
  }
  return at;
}

AdjustmentResidual AdjustmentProblem::linearize_motion(const Capture& capture) const {
  const Eigen::Index size = capture.num_motion_unknowns();
  AdjustmentResidual at{state_.segment(capture.local + capture.num_pose_unknowns(), size),
                        {{capture.local, Eigen::MatrixXd::Zero(size, capture.size())}}};
  Eigen::VectorXd weights(size);
  const KnownMotion& known = capture.motion;
  if (capture.is_velocity_estimated()) {
    at.value.head<2>() -= known.velocity_m_per_s;
    weights.head<2>().setConstant(1 / known.velocity_sd_m_per_s);
  }
  if (capture.is_yaw_rate_estimated()) {
    at.value[size - 1] -= known.yaw_rate_rad_per_s;
    weights[size - 1] = 1 / known.yaw_rate_sd_rad_per_s;
  }
  at.value.array() *= weights.array();
  at.blocks.front().jacobian.rightCols(size) = weights.asDiagonal();
  return at;
}

AdjustmentResidual AdjustmentProblem::linearize_gauge() const {
  AdjustmentResidual at{Eigen::VectorXd::Zero(gauge.cols()), {}};
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const Eigen::MatrixXd by_lamp =
        gauge.middleRows<3>(3 * static_cast<Eigen::Index>(i)).transpose();
    if (by_lamp.isZero(0)) continue;  // not detected
    at.value += by_lamp * (state_.segment<3>(layout_.lamp_state_index(i)) - lamps[i].surveyed_m);
    at.blocks.push_back({layout_.lamp_state_index(i), by_lamp});
  }
  return at;
}

bool AdjustmentProblem::is_block_exact(Eigen::Index first) const {
  if (first == layout_.zenith) return is_zenith_exact;
  return first >= layout_.lamps && first < layout_.pivots &&
         lamps[static_cast<std::size_t>(first - layout_.lamps) / 3].is_exact();
}

AdjustmentResidual AdjustmentProblem::linearize_prior(std::size_t lamp) const {
  const auto& [surveyed_m, sd_m, is_height_only] = lamps[lamp];
  const Eigen::Index at = layout_.lamp_state_index(lamp), size = is_height_only ? 1 : 3;
  // Far below the resolution of detections, and far above rounding.
  constexpr double min_sd_m = 1e-6;
  const double weight = 1 / std::max(sd_m, min_sd_m);
  return {weight * (state_.segment<3>(at) - surveyed_m).tail(size),
          {{at, weight * Eigen::Matrix3d::Identity().bottomRows(size)}}};
}

std::vector<AdjustmentProblem::Term> AdjustmentProblem::list_cost_terms(
    const std::optional<Lens>& lens) const {
  std::vector<Term> terms;
  std::vector<bool> capture_used(captures.size());
  for (const Sighting& sighting : sightings) {
    if (!sighting.used) continue;
    capture_used[sighting.capture] = true;
    terms.push_back({[this, &sighting, &lens] {
                       return lens ? linearize_sighting(sighting, *lens) : std::nullopt;
                     },
                     true, true, sighting.capture});
  }
  if (layout_.lens_size > 0) {
    terms.push_back({[this] {
      const Eigen::Index size = layout_.lens_size;
      return AdjustmentResidual{state_.segment(layout_.lens, size),
                                {{layout_.lens, Eigen::MatrixXd::Identity(size, size)}}};
    }});
  }
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (lamps[i].is_exact() || std::isinf(lamps[i].sd_m)) continue;
    terms.push_back({[this, i] { return linearize_prior(i); }, true});
  }
  if (gauge.cols() > 0) terms.push_back({[this] { return linearize_gauge(); }});
  for (const PositionObservation& place : position_observations) {
    if (!is_known_position_used[place.known_position] || !capture_used[place.capture]) continue;
    terms.push_back(
        {[this, &place] { return linearize_place(place); }, true, false, place.capture});
  }
  for (std::size_t k = 0; k < captures.size(); ++k) {
    if (captures[k].num_motion_unknowns() == 0 || !capture_used[k]) continue;
    terms.push_back({[this, k] { return linearize_motion(captures[k]); }, false, false, k});
  }
  return terms;
}

namespace {

/// Lens of the state at which Ceres evaluates the terms.
struct LensUpdater : ceres::EvaluationCallback {
  explicit LensUpdater(const AdjustmentProblem& of) : problem(of), lens(of.current_lens()) {}
  void PrepareForEvaluation(bool, bool new_point) override {
    if (new_point) lens = problem.current_lens();
  }
  const AdjustmentProblem& problem;
  std::optional<Lens> lens;
};

/// Cost of one term. The unknowns stay in the state vector of the problem, from which the term
/// reads them. The order of their addresses, and with it the rounding in Ceres, is therefore always
/// the same.
class TermCost : public ceres::CostFunction {
 public:
  using Linearize = std::function<std::optional<AdjustmentResidual>()>;

  TermCost(Linearize linearize, const AdjustmentResidual& start)
      : linearize_(std::move(linearize)) {
    set_num_residuals(static_cast<int>(start.value.size()));
    for (const auto& [first, jacobian] : start.blocks) {
      mutable_parameter_block_sizes()->push_back(static_cast<int32_t>(jacobian.cols()));
    }
  }
  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const auto at = linearize_();
    if (!at) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, at->value.size()) = at->value;
    for (std::size_t i = 0; jacobians != nullptr && i < at->blocks.size(); ++i) {
      const Eigen::MatrixXd& jacobian = at->blocks[i].jacobian;
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[i], jacobian.rows(), jacobian.cols()) = jacobian;
    }
    return true;
  }

 private:
  Linearize linearize_;
};

}  // namespace

bool AdjustmentProblem::solve_adjustment(bool robust) {
  // 95 % efficiency for normal noise, approximately in two and in three dimensions.
  constexpr double width = 2.385;
  LensUpdater lenses(*this);
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &lenses;
  ceres::Problem ceres(problem_options);
  auto order = std::make_shared<ceres::ParameterBlockOrdering>();
  for (const Term& term : list_cost_terms(lenses.lens)) {
    const auto start = term.linearize();
    if (!start) return false;
    std::vector<double*> blocks;
    for (const auto& [first, jacobian] : start->blocks) {
      double* const block = blocks.emplace_back(state_.data() + first);
      ceres.AddParameterBlock(block, static_cast<int>(jacobian.cols()));
      order->AddElementToGroup(block, first < layout_.global ? 1 : 0);
      const bool is_lens = first < layout_.lens + layout_.lens_size;
      if (is_block_exact(first) || (is_lens && is_lens_held))
        ceres.SetParameterBlockConstant(block);
    }
    ceres::LossFunction* const loss =
        robust && term.has_loss ? new ceres::CauchyLoss(width) : nullptr;
    ceres.AddResidualBlock(new TermCost(term.linearize, *start), loss, blocks);
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
  return solve_with_ceres(options, ceres) && state_.allFinite();
}

Eigen::MatrixXd AdjustmentProblem::make_weak_prior() const {
  constexpr double guess_rad = 1, guess_m = 10;
  Eigen::VectorXd information = Eigen::VectorXd::Zero(layout_.global);
  information.segment<2>(layout_.zenith).setConstant(1 / (guess_rad * guess_rad));
  information.segment<2>(layout_.lever_arm).setConstant(1 / (guess_m * guess_m));
  information.tail(layout_.global - layout_.pivots).setConstant(1 / (guess_m * guess_m));
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (lamps[i].is_height_only || std::isinf(lamps[i].sd_m)) {
      information.segment<3>(layout_.lamp_state_index(i)).setConstant(1 / (guess_m * guess_m));
    }
    if (lamps[i].is_exact()) information.segment<3>(layout_.lamp_state_index(i)).setOnes();
  }
  return information.asDiagonal();
}

namespace {

/// Residuals of a capture, those of its detections first, and the marginalization of its local
/// unknowns.
struct CaptureRows {
  std::vector<AdjustmentResidual> residuals = {};
  Eigen::Index rows = 0, detection_rows = 0;
  /// Global unknowns on which the residuals depend.
  std::set<Eigen::Index> unknowns = {};
  std::vector<Eigen::Index> columns = {};
  /// Derivatives of all rows with respect to `columns` and to the local unknowns.
  Eigen::MatrixXd by_global = {}, by_local = {};
  /// N^-1, with the information N of the local unknowns; N^-1 times the cross block M.
  Eigen::MatrixXd local_covariance = {}, local_from_global = {};

  void add(const AdjustmentResidual& residual, bool is_detection, Eigen::Index local) {
    residuals.push_back(residual);
    rows += residual.value.size();
    if (is_detection) detection_rows = rows;
    for (const auto& [first, jacobian] : residual.blocks) {
      for (Eigen::Index i = 0; first < local && i < jacobian.cols(); ++i)
        unknowns.insert(first + i);
    }
  }

  /// Computes the marginalization, and subtracts it from the information of the global unknowns.
  void marginalize(const AdjustmentProblem::Capture& capture, Eigen::MatrixXd& information) {
    columns.assign(unknowns.begin(), unknowns.end());
    by_global = Eigen::MatrixXd::Zero(rows, std::ssize(columns));
    by_local = Eigen::MatrixXd::Zero(rows, capture.size());
    Eigen::Index row = 0;
    for (const auto& [value, parts] : residuals) {
      for (const auto& [first, jacobian] : parts) {
        const auto column = std::ranges::lower_bound(columns, first) - columns.begin();
        Eigen::MatrixXd& rows_of = first < capture.local ? by_global : by_local;
        rows_of.block(row, first < capture.local ? column : first - capture.local, jacobian.rows(),
                      jacobian.cols()) = jacobian;
      }
      row += value.size();
    }
    // A guess determines local unknowns that no observation does.
    constexpr double guess_information = 1e-2;
    Eigen::MatrixXd local = by_local.transpose() * by_local;
    local.diagonal().head(capture.num_pose_unknowns()).array() += guess_information;
    local_covariance =
        solve_symmetric(local, Eigen::MatrixXd::Identity(capture.size(), capture.size()));
    const Eigen::MatrixXd cross = by_local.transpose() * by_global;
    local_from_global = local_covariance * cross;
    information(columns, columns) +=
        by_global.transpose() * by_global - cross.transpose() * local_from_global;
  }

  /// Returns the trace of the covariance of the predicted detections,
  ///   tr(B N^-1 B' + (A - B N^-1 M) C (A - B N^-1 M)')
  /// with their derivatives B with respect to the local and A with respect to the global unknowns.
  /// C is the covariance of the global unknowns.
  double predict_variance(const Eigen::MatrixXd& global_covariance) const {
    const auto of_local = by_local.topRows(detection_rows);
    const Eigen::MatrixXd of_global =
        by_global.topRows(detection_rows) - of_local * local_from_global;
    return of_local.cwiseProduct(of_local * local_covariance).sum() +
           of_global.cwiseProduct(of_global * global_covariance(columns, columns)).sum();
  }
};

}  // namespace

AdjustmentProblem::GlobalCovariance AdjustmentProblem::compute_covariance() const {
  Eigen::MatrixXd information = make_weak_prior();
  std::vector<CaptureRows> rows(captures.size());
  const auto lens = this->current_lens();
  for (const Term& term : list_cost_terms(lens)) {
    auto at = term.linearize();
    if (!at) continue;
    std::erase_if(at->blocks, [&](const auto& part) { return is_block_exact(part.first); });
    if (term.capture) {
      rows[*term.capture].add(*at, term.is_detection, captures[*term.capture].local);
      continue;
    }
    for (const auto& [row, a] : at->blocks) {
      for (const auto& [column, b] : at->blocks) {
        information.block(row, column, a.cols(), b.cols()) += a.transpose() * b;
      }
    }
  }
  for (std::size_t k = 0; k < captures.size(); ++k) rows[k].marginalize(captures[k], information);
  const Eigen::VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::Index held = is_lens_held ? layout_.lens_size : 0, free = layout_.global - held;
  const Eigen::VectorXd free_scale = scale.tail(free);
  Eigen::MatrixXd free_covariance = solve_symmetric(
      free_scale.asDiagonal() * information.bottomRightCorner(free, free) * free_scale.asDiagonal(),
      Eigen::MatrixXd::Identity(free, free));
  free_covariance = (free_scale.asDiagonal() * free_covariance * free_scale.asDiagonal()).eval();
  Eigen::MatrixXd jacobian_wrt_lens = Eigen::MatrixXd::Identity(layout_.global, held);
  jacobian_wrt_lens.bottomRows(free) = -free_covariance * information.bottomLeftCorner(free, held);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(layout_.global, layout_.global);
  covariance.bottomRightCorner(free, free) =
      0.5 * (free_covariance + free_covariance.transpose()).eval();
  if (is_zenith_exact) covariance.diagonal().segment<2>(layout_.zenith).setZero();
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    if (is_block_exact(layout_.lamp_state_index(i)))
      covariance.diagonal().segment<3>(layout_.lamp_state_index(i)).setZero();
  }
  double freedom = 0;
  for (const CaptureRows& capture : rows) {
    freedom += static_cast<double>(capture.detection_rows) - capture.predict_variance(covariance);
  }
  return {covariance, jacobian_wrt_lens, freedom};
}

}  // namespace vlp
