// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the adjustment with an independent implementation of its equations: numeric
/// derivatives, one dense matrix, QR, Eigen only. Compares its analytic derivatives with finite
/// differences.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/QR>
#include <map>
#include <numbers>

#include "calibration/adjustment/adjustment_problem.h"
#include "calibration/adjustment/survey.h"
#include "support/matchers.h"

namespace vlp {
namespace {

/// Returns two rotations in place, one about a known axis, a capture at a known position, and a
/// capture of a tilted robot.
Survey small_survey(double map_sd_m, bool lens, Random& random) {
  Survey survey(map_sd_m);
  survey.turn({-0.4, -0.2, 0}, 4, 2e-4);
  survey.turn({0.4, 0.2, 0.2}, 5);
  survey.stand({{0.1, -0.2, 0.1}, 1.2});
  survey.input.captures.back().known_position =
      KnownPosition{MeasuredPoint::camera, {0.1, -0.2}, 0.1, 3e-4};
  survey.truth.inclination = Inclination{0.03, -0.02};
  survey.stand({{-0.2, 0.1, 0}, -2});
  survey.input.captures.back().inclination = survey.truth.inclination;
  Calibration& calibration = survey.input.calibration;
  if (lens) draw_lens(calibration, lens_covariance(calibration.camera, 0.1, 8), random);
  survey.add_noise(random, true, map_sd_m > 0, false);
  // Larger than the noise, so that the residuals do not increase it.
  for (AdjustmentCapture& capture : survey.input.captures) {
    for (Detection& detection : capture.detections) *detection.sigma_px *= 1.5;
  }
  return survey;
}

/// Reference solution. Unknowns: lens (whitened), zenith, lever arm, lamps; per pivot the axis and
/// the height of its camera; per capture the yaw, preceded by its position if it is at no pivot.
class DenseAdjustment {
 public:
  explicit DenseAdjustment(const Survey& survey) : input_(survey.input) {
    const Camera& camera = input_.calibration.camera;
    const auto& report = input_.calibration.intrinsics_report;
    intrinsics_ =
        Eigen::Map<const Eigen::VectorXd>(camera.intrinsics.data(), std::ssize(camera.intrinsics));
    lens_root_.resize(intrinsics_.size(), 0);
    if (report) lens_root_ = report->covariance->llt().matrixL();
    zenith_ = lens_root_.cols();
    lamps_ = zenith_ + 4;
    std::vector<double> start(static_cast<std::size_t>(lamps_), 0.0);
    for (const Lamp& lamp : input_.lamps.lamps) {
      start.insert(start.end(), lamp.position_m.begin(), lamp.position_m.end());
    }
    std::map<std::string, Eigen::Index> spots;
    // Initial values near the ground truth.
    const std::map<std::string, Eigen::Vector3d> axes{{"spot-0", {-0.4, -0.2, 0}},
                                                      {"spot-4", {0.4, 0.2, 0.2}}};
    int k = 0;
    for (const AdjustmentCapture& capture : input_.captures) {
      LocalUnknowns local{};
      if (capture.pivot.empty()) {
        local.at = std::ssize(start);
        const Pose pose = k == 9 ? Pose{{0.1, -0.2, 0.1}, 1.2} : Pose{{-0.2, 0.1, 0}, -2};
        start.insert(start.end(), pose.position_m.begin(), pose.position_m.end());
        start.push_back(pose.yaw_rad);
        local.yaw = local.at + 3;
      } else {
        const auto [spot, fresh] = spots.emplace(capture.pivot, std::ssize(start));
        if (fresh) {
          const Eigen::Vector3d& axis_m = axes.at(capture.pivot);
          start.insert(start.end(), axis_m.begin(), axis_m.end());
        }
        local.at = spot->second;
        local.on_spot = true;
        local.yaw = std::ssize(start);
        const int in_spot = k < 4 ? k : k - 4, captures = k < 4 ? 4 : 5;
        start.push_back(0.3 + 2 * std::numbers::pi * in_spot / captures);
      }
      local_.push_back(local);
      ++k;
    }
    state_ = Eigen::Map<Eigen::VectorXd>(start.data(), std::ssize(start));
  }

  void solve() {
    for (int round = 0; round < 8; ++round) {
      const Eigen::MatrixXd jacobian = differences();
      const Eigen::VectorXd step = jacobian.colPivHouseholderQr().solve(residuals(state_));
      for (Eigen::Index i = 0; i < step.size(); ++i) state_[free(i)] -= step[i];
      if (step.norm() < 1e-9) break;
    }
    const Eigen::MatrixXd jacobian = differences();
    const Eigen::MatrixXd root =
        jacobian.householderQr().matrixQR().topRows(jacobian.cols()).triangularView<Eigen::Upper>();
    const Eigen::MatrixXd inverse = root.triangularView<Eigen::Upper>().solve(
        Eigen::MatrixXd::Identity(root.rows(), root.cols()));
    const Eigen::MatrixXd covariance = inverse * inverse.transpose();
    covariance_ = Eigen::MatrixXd::Zero(state_.size(), state_.size());
    for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
      for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
        covariance_(free(i), free(j)) = covariance(i, j);
      }
    }
  }

  /// Returns intrinsics, zenith, lever arm and lamps.
  Eigen::VectorXd global() const {
    Eigen::VectorXd values(intrinsics_.size() + 4 + 3 * lamp_count());
    values << intrinsics_ + lens_root_ * state_.head(zenith_),
        state_.segment(zenith_, 4 + 3 * lamp_count());
    return values;
  }
  Eigen::MatrixXd covariance() const {
    const Eigen::Index rest = 4 + 3 * lamp_count();
    Eigen::MatrixXd from_state = Eigen::MatrixXd::Zero(intrinsics_.size() + rest, zenith_ + rest);
    from_state.topLeftCorner(intrinsics_.size(), zenith_) = lens_root_;
    from_state.bottomRightCorner(rest, rest).setIdentity();
    return from_state * covariance_.topLeftCorner(zenith_ + rest, zenith_ + rest) *
           from_state.transpose();
  }

 private:
  struct LocalUnknowns {
    Eigen::Index at, yaw;
    bool on_spot;
  };
  Eigen::Index lamp_count() const { return std::ssize(input_.lamps.lamps); }
  bool map_is_exact() const { return *input_.lamps.lamps.front().sd_m == 0; }
  /// Returns the state index of estimated unknown i.
  Eigen::Index free(Eigen::Index i) const {
    return map_is_exact() && i >= lamps_ ? i + 3 * lamp_count() : i;
  }

  Eigen::VectorXd residuals(const Eigen::VectorXd& state) const {
    std::vector<double> all(state.data(), state.data() + zenith_);  // prior of the lens
    const auto add = [&all](const auto& values) {
      for (const double value : values) all.push_back(value);
    };
    const Eigen::VectorXd intrinsics = intrinsics_ + lens_root_ * state.head(zenith_);
    const Lens lens(input_.calibration.camera.lens_model,
                    std::vector<double>(intrinsics.begin(), intrinsics.end()));
    // Smallest rotation of Z to the zenith; that of Eigen costs the compiler a decomposition.
    const Eigen::Vector3d zenith =
        Eigen::Vector3d(state[zenith_], state[zenith_ + 1], 1).normalized();
    const Eigen::Quaterniond camera_from_base =
        Eigen::Quaterniond(1 + zenith.z(), -zenith.y(), zenith.x(), 0).normalized();
    const Eigen::Vector3d arm_m(state[zenith_ + 2], state[zenith_ + 3], 0);
    std::map<std::string, bool> axis_counted;
    for (std::size_t k = 0; k < local_.size(); ++k) {
      const AdjustmentCapture& capture = input_.captures[k];
      const LocalUnknowns& local = local_[k];
      const Eigen::AngleAxisd world_from_level(state[local.yaw], Eigen::Vector3d::UnitZ());
      const Eigen::Vector3d axis_m = state.segment<3>(local.at);
      Eigen::Vector3d camera_m = axis_m;
      if (local.on_spot) camera_m += world_from_level * arm_m;
      Eigen::Quaterniond level_from_base = Eigen::Quaterniond::Identity();
      if (capture.inclination) {
        level_from_base =
            Eigen::AngleAxisd(capture.inclination->pitch_rad, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(capture.inclination->roll_rad, Eigen::Vector3d::UnitX());
      }
      for (const Detection& detection : capture.detections) {
        const Eigen::Vector3d lamp_m = state.segment<3>(lamps_ + 3 * (detection.lamp - 1));
        const Eigen::Vector3d level = world_from_level.inverse() * (lamp_m - camera_m);
        const Eigen::Vector2d pixel =
            lens.project_point(camera_from_base * (level_from_base.inverse() * level)).value();
        add(Eigen::Vector2d((detection.pixel - pixel) / *detection.sigma_px));
      }
      if (!capture.known_position || (local.on_spot && axis_counted[capture.pivot])) continue;
      axis_counted[capture.pivot] = true;
      Eigen::Vector3d stated_m;
      stated_m << capture.known_position->xy_m, *capture.known_position->z_m;
      add(Eigen::Vector3d((axis_m - stated_m) / capture.known_position->sd_m));
    }
    if (!map_is_exact()) {
      for (Eigen::Index i = 0; i < lamp_count(); ++i) {
        const Lamp& lamp = input_.lamps.lamps[static_cast<std::size_t>(i)];
        add(Eigen::Vector3d((state.segment<3>(lamps_ + 3 * i) - lamp.position_m) / *lamp.sd_m));
      }
    }
    return Eigen::Map<Eigen::VectorXd>(all.data(), std::ssize(all));
  }

  Eigen::MatrixXd differences() const {
    const Eigen::Index unknowns = state_.size() - (map_is_exact() ? 3 * lamp_count() : 0);
    Eigen::MatrixXd jacobian(residuals(state_).size(), unknowns);
    for (Eigen::Index i = 0; i < unknowns; ++i) {
      const double step = free(i) < zenith_ ? 1e-3 : 1e-6;
      Eigen::VectorXd less = state_, more = state_;
      less[free(i)] -= step;
      more[free(i)] += step;
      jacobian.col(i) = (residuals(more) - residuals(less)) / (2 * step);
    }
    return jacobian;
  }

  AdjustmentInput input_;
  Eigen::VectorXd intrinsics_, state_;
  Eigen::MatrixXd lens_root_, covariance_;
  Eigen::Index zenith_ = 0, lamps_ = 0;
  std::vector<LocalUnknowns> local_;
};

struct Known {
  const char* name;
  double map_sd_m;
  bool lens;
};
class RunBundleAdjustmentReference : public testing::TestWithParam<Known> {};

TEST_P(RunBundleAdjustmentReference, ParametersAndCovarianceMatchDenseLeastSquares) {
  Random random(31);
  const Survey survey = small_survey(GetParam().map_sd_m, GetParam().lens, random);
  const AdjustmentResult found = run_bundle_adjustment(survey.input);
  ASSERT_TRUE(found.has_succeeded()) << found.undetermined;
  ASSERT_EQ(found.rejected_detections, 0);
  ASSERT_EQ(found.noise_scale, 1);
  ASSERT_TRUE(found.center.lever_arm_m);
  ASSERT_EQ(found.refined_map.lamps.size(), 8U);
  DenseAdjustment dense(survey);
  dense.solve();

  const Eigen::VectorXd expected = dense.global();
  Eigen::VectorXd values(expected.size());
  const auto& intrinsics = found.camera.intrinsics;
  values << Eigen::Map<const Eigen::VectorXd>(intrinsics.data(), std::ssize(intrinsics)),
      found.center.zenith_in_camera.hnormalized(), *found.center.lever_arm_m,
      Eigen::VectorXd::Zero(24);
  for (Eigen::Index i = 0; i < 8; ++i) {
    values.tail<24>().segment<3>(3 * i) =
        found.refined_map.lamps[static_cast<std::size_t>(i)].position_m;
  }
  const Eigen::MatrixXd covariance = dense.covariance();
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  // In standard deviations: stop tolerance of Ceres, and error of finite differences.
  constexpr double stopped = 1e-5, least = 1e-13;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    EXPECT_NEAR(values[i], expected[i], stopped * sd[i] + least * (1 + std::abs(expected[i]))) << i;
  }
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    for (Eigen::Index j = 0; j < values.size(); ++j) {
      EXPECT_NEAR(found.refined_covariance(i, j), covariance(i, j), 1e-5 * sd[i] * sd[j])
          << i << ", " << j;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Adjustment, RunBundleAdjustmentReference,
                         testing::Values(Known{"ExactMap", 0, false},
                                         Known{"RefinedMap", 2e-3, false},
                                         Known{"ExactMapAndLens", 0, true},
                                         Known{"RefinedMapAndLens", 2e-3, true}),
                         [](const auto& one) { return one.param.name; });

/// Problem with a free lens, two lamps, a capture at a pivot, and a moving capture of a tilted
/// robot.
class AdjustmentDerivatives : public testing::Test {
 protected:
  Camera camera = synthetic_camera();
  AdjustmentProblem problem{camera.lens_model,
                            LensParametrization(camera, lens_covariance(camera, 0.1, 6)), 2, 1};

  AdjustmentDerivatives() {
    const AdjustmentLayout& at = problem.state_vector_layout();
    problem.has_lever_arm = true;
    problem.lamps = {{{0.4, 0.3, 1.6}, 0.001}, {{-0.5, 0.2, 1.5}, 0.001}};
    KnownMotion motion;
    motion.yaw_rate_rad_per_s = 1.5;
    motion.yaw_rate_sd_rad_per_s = 0.1;
    problem.add_capture_with_initial_pose({0, Eigen::Matrix3d::Identity(), motion},
                                          {{0, 0, 0}, 0.7});
    motion.velocity_m_per_s = {0.8, -0.5};
    motion.velocity_sd_m_per_s = 0.2;
    problem.add_capture_with_initial_pose(
        {{}, level_rotation_from_inclination({0.05, -0.04}).transpose(), motion},
        {{0.1, -0.2, 0.1}, -2});
    Eigen::VectorXd& state = problem.state_vector();
    for (Eigen::Index i = 0; i < at.lens_size; ++i) state[i] = 0.1 * static_cast<double>(i % 3);
    state.segment<2>(at.zenith) << 0.03, -0.02;
    state.segment<2>(at.lever_arm) << 0.009, -0.004;
    for (std::size_t i = 0; i < 2; ++i)
      state.segment<3>(at.lamp_state_index(i)) = problem.lamps[i].surveyed_m;
    state.segment<3>(at.pivot_state_index(0)) << -0.1, 0.1, 0.05;
  }

  /// Differentiates `value` numerically with respect to the unknowns [first, first + size).
  template <typename Value>
  /// Differentiates `value` numerically with respect to the unknowns [first, first + size).
  Eigen::MatrixXd differences(Eigen::Index first, Eigen::Index size, const Value& value) {
    Eigen::MatrixXd result(value().size(), size);
    for (Eigen::Index i = 0; i < size; ++i) {
      constexpr double step = 1e-6;
      double& unknown = problem.state_vector()[first + i];
      const double start = unknown;
      unknown = start + step;
      const Eigen::VectorXd more = value();
      unknown = start - step;
      result.col(i) = (more - value()) / (2 * step);
      unknown = start;
    }
    return result;
  }
};

TEST_F(AdjustmentDerivatives, LampObservationJacobiansMatchFiniteDifferences) {
  const AdjustmentLayout& at = problem.state_vector_layout();
  for (const std::size_t capture : {0U, 1U}) {
    for (const std::size_t lamp : {0U, 1U}) {
      const AdjustmentProblem::Sighting sighting{
          capture, lamp, {400, 300}, 0.5, Eigen::Matrix2d::Identity() / 0.5, 0.012};
      const auto residual = [&] {
        return problem.linearize_lamp_observation(sighting, problem.current_lens().value())
            .value()
            .value;
      };
      const auto found =
          problem.linearize_lamp_observation(sighting, problem.current_lens().value());
      ASSERT_TRUE(found);
      const Eigen::Index local = problem.captures[capture].local;
      std::vector<Eigen::Index> blocks{local, at.zenith, at.lamp_state_index(lamp), at.lens};
      if (capture == 0) blocks.insert(blocks.begin() + 1, {at.pivot_state_index(0), at.lever_arm});
      ASSERT_EQ(found->blocks.size(), blocks.size());
      for (std::size_t i = 0; i < blocks.size(); ++i) {
        const auto& [first, jacobian] = found->blocks[i];
        EXPECT_EQ(first, blocks[i]);
        const Eigen::MatrixXd expected = differences(first, jacobian.cols(), residual);
        EXPECT_THAT(jacobian, IsNear(expected, 1e-6 * (1 + expected.cwiseAbs().maxCoeff())));
      }
    }
  }
}

TEST_F(AdjustmentDerivatives, RotateLevelPointToCameraJacobianMatchesFiniteDifferences) {
  const Eigen::Vector3d x(0.3, -0.5, 1.2);
  Eigen::Vector2d zenith(0.2, -0.1);
  const ZenithRotation turn = rotate_level_point_to_camera(zenith, x);
  EXPECT_THAT(turn.x_in_camera,
              IsNear(level_rotation_from_zenith(zenith.homogeneous()).transpose() * x, 1e-15));
  EXPECT_THAT(turn.camera_from_level * x, IsNear(turn.x_in_camera, 1e-15));
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = 1e-6 * Eigen::Vector2d::Unit(i);
    const Eigen::Vector3d difference =
        (rotate_level_point_to_camera(zenith + step, x).x_in_camera -
         rotate_level_point_to_camera(zenith - step, x).x_in_camera) /
        2e-6;
    EXPECT_THAT(turn.jacobian_wrt_zenith.col(i), IsNear(difference, 1e-9));
  }
}

}  // namespace
}  // namespace vlp
