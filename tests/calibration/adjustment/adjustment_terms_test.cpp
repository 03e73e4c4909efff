// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares residuals, solution and covariance of AdjustmentProblem with an independent
/// implementation of its equations: numeric derivatives and one dense matrix with all unknowns.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "calibration/adjustment/adjustment_problem.h"
#include "geometry/frames.h"
#include "support/matchers.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using Problem = AdjustmentProblem;

constexpr double kIgnored = std::numeric_limits<double>::infinity();
/// Width of the Cauchy loss of the robust solution.
constexpr double kCauchyWidth = 2.385;
/// Information of the local unknowns of a pose without observations.
constexpr double kGuessInformation = 1e-2;

/// Covariance in which only fx, fy and cy have errors.
Eigen::MatrixXd make_covariance_of_three_intrinsics(const Camera& camera) {
  const Eigen::Index size = std::ssize(camera.intrinsics);
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(size, 3);
  root.row(0) << 2, 0, 0;
  root.row(1) << 0.5, 1.5, 0;
  root.row(3) << -0.7, 0.4, 1.1;
  return root * root.transpose();
}

TEST(LensParametrization, DirectionsReproduceCovarianceWithExactIntrinsics) {
  const Camera camera = synthetic_camera();
  const Eigen::MatrixXd covariance = make_covariance_of_three_intrinsics(camera);
  const LensParametrization lens(camera, covariance);
  ASSERT_EQ(lens.directions.rows(), 12);
  ASSERT_EQ(lens.directions.cols(), 3);
  EXPECT_THAT(lens.directions * lens.directions.transpose(), IsNear(covariance, 1e-12));
  ASSERT_EQ(lens.nominal_intrinsics.size(), 12);
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(lens.nominal_intrinsics[static_cast<Eigen::Index>(i)], camera.intrinsics[i]);
  }
}

/// Intrinsics of different units: their variances differ by ten orders of magnitude.
TEST(LensParametrization, KeepsDirectionsOfSmallCoefficientsBesideLargePixels) {
  Camera camera = synthetic_camera();
  Eigen::VectorXd sd = Eigen::VectorXd::Constant(12, 1e-5);
  sd.head<4>().setConstant(10);
  const LensParametrization lens(camera, MatrixX(sd.cwiseAbs2().asDiagonal()));
  ASSERT_EQ(lens.directions.cols(), 12);
  const Eigen::VectorXd scale = sd.cwiseInverse();
  EXPECT_THAT(
      scale.asDiagonal() * lens.directions * lens.directions.transpose() * scale.asDiagonal(),
      IsNear(Eigen::MatrixXd::Identity(12, 12), 1e-12));
}

TEST(LensParametrization, HasNoDirectionsWithoutCovariance) {
  const LensParametrization lens(synthetic_camera(), std::nullopt);
  EXPECT_EQ(lens.directions.rows(), 12);
  EXPECT_EQ(lens.directions.cols(), 0);
  const LensParametrization splined(splined_camera(), std::nullopt);
  EXPECT_EQ(splined.directions.rows(), 4);
  EXPECT_EQ(splined.nominal_intrinsics.size(), 4 + 2 * 12 * 10);
}

TEST(AdjustmentProblem, LayoutListsLensZenithLeverArmLampsAndPivots) {
  const Camera camera = synthetic_camera();
  const Problem problem(camera.lens_model,
                        LensParametrization(camera, make_covariance_of_three_intrinsics(camera)), 4,
                        2);
  const AdjustmentLayout& at = problem.state_vector_layout();
  EXPECT_EQ(at.lens, 0);
  EXPECT_EQ(at.lens_size, 3);
  EXPECT_EQ(at.zenith, 3);
  EXPECT_EQ(at.lever_arm, 5);
  EXPECT_EQ(at.lamps, 7);
  EXPECT_EQ(at.lamp_state_index(1), 10);
  EXPECT_EQ(at.pivots, 19);
  EXPECT_EQ(at.pivot_state_index(1), 22);
  EXPECT_EQ(at.global, 25);
  EXPECT_EQ(problem.state_vector(), Eigen::VectorXd::Zero(25));
}

TEST(AdjustmentProblem, AddedCapturesAppendPoseAndUnknownMotionToState) {
  const Camera camera = synthetic_camera();
  Problem problem(camera.lens_model, LensParametrization(camera, std::nullopt), 0, 1);
  const Pose pose{{1, 2, 3}, 0.5};
  const KnownMotion known{{4, 5}, 6, 0, 0}, unknown{{4, 5}, 6, 0.1, 0.2};
  const KnownMotion unknown_velocity{{7, 8}, 9, 0.1, 0}, unknown_rate{{7, 8}, 9, 0, 0.2};
  const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
  problem.add_capture_with_initial_pose({{}, level, known}, pose);
  problem.add_capture_with_initial_pose({{}, level, unknown}, pose);
  problem.add_capture_with_initial_pose({0, level, unknown}, pose);
  problem.add_capture_with_initial_pose({{}, level, unknown_velocity}, pose);
  problem.add_capture_with_initial_pose({{}, level, unknown_rate}, pose);
  Eigen::VectorXd expected(7 + 4 + 7 + 2 + 6 + 5);
  expected << 0, 0, 0, 0, 0, 0, 0,  // zenith, lever arm, pivot
      1, 2, 3, 0.5,                 //
      1, 2, 3, 0.5, 4, 5, 6,        //
      0.5, 6,                       // at a pivot
      1, 2, 3, 0.5, 7, 8,           //
      1, 2, 3, 0.5, 9;
  ASSERT_EQ(problem.state_vector().size(), expected.size());
  EXPECT_EQ(problem.state_vector(), expected);
  ASSERT_EQ(problem.captures.size(), 5U);
  EXPECT_EQ(problem.captures[0].local, 7);
  EXPECT_EQ(problem.captures[1].local, 11);
  EXPECT_EQ(problem.captures[2].local, 18);
  EXPECT_EQ(problem.captures[3].local, 20);
  EXPECT_EQ(problem.captures[4].local, 26);
}

TEST(AdjustmentProblem, CurrentLensIsMissingForInvalidIntrinsics) {
  const Camera camera = synthetic_camera();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(12, 12);
  covariance(0, 0) = 100;
  Problem fx_only(camera.lens_model, LensParametrization(camera, covariance), 0, 0);
  ASSERT_EQ(fx_only.state_vector_layout().lens_size, 1);
  const double sign = fx_only.lens_parametrization().directions(0, 0) > 0 ? 1 : -1;
  fx_only.state_vector()[0] = 2 * sign;
  EXPECT_NEAR(fx_only.current_intrinsics()[0], 540, 1e-9);
  EXPECT_NEAR(fx_only.current_intrinsics()[1], 522, 1e-9);
  ASSERT_TRUE(fx_only.current_lens());
  EXPECT_NEAR(fx_only.current_lens()->focal_px().x(), 540, 1e-9);
  fx_only.state_vector()[0] = -53 * sign;
  EXPECT_FALSE(fx_only.current_lens());
  fx_only.state_vector()[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(fx_only.current_lens());
  covariance.setZero();
  covariance(1, 1) = 100;
  Problem fy_only(camera.lens_model, LensParametrization(camera, covariance), 0, 0);
  fy_only.state_vector()[0] = fy_only.lens_parametrization().directions(1, 0) > 0 ? -53.0 : 53.0;
  EXPECT_FALSE(fy_only.current_lens());
}

/// Without observations, only the weak priors determine the unknowns.
TEST(AdjustmentProblem, CovarianceWithoutObservationsIsThatOfPriors) {
  const Camera camera = synthetic_camera();
  Problem problem(camera.lens_model,
                  LensParametrization(camera, make_covariance_of_three_intrinsics(camera)), 3, 2);
  const Problem::LampPrior exact{{0, 0, 1}, 0}, surveyed{{1, 0, 1}, 0.02},
      free{{0, 1, 1}, kIgnored};
  const Eigen::Vector3d of_exact(0, 0, 0), of_surveyed(4e-4, 4e-4, 4e-4), of_free(100, 100, 100);
  Eigen::VectorXd variances(3 + 4 + 9 + 6);
  variances << 1, 1, 1,                                              // lens, in standard deviations
      1, 1, 100, 100,                                                // zenith and lever arm
      of_exact, of_surveyed, of_free, 100, 100, 100, 100, 100, 100;  // lamps and pivots
  problem.lamps = {exact, surveyed, free};
  const auto found = problem.compute_global_unknowns_covariance();
  ASSERT_EQ(found.matrix.rows(), variances.size());
  EXPECT_THAT(found.matrix, IsNear(Eigen::MatrixXd(variances.asDiagonal()), 1e-10));
  EXPECT_EQ(found.degrees_of_freedom, 0);
  problem.lamps = {free, exact, surveyed};
  variances.segment<9>(7) << of_free, of_exact, of_surveyed;
  EXPECT_THAT(problem.compute_global_unknowns_covariance().matrix,
              IsNear(Eigen::MatrixXd(variances.asDiagonal()), 1e-10));
}

/// Problem with every kind of capture, lamp, known position and prior.
class AdjustmentProblemTerms : public testing::Test {
 protected:
  /// Residuals of one term, and their role in the solution.
  struct ReferenceTerm {
    Eigen::VectorXd value;
    bool has_loss, is_detection;
  };

  AdjustmentProblemTerms() {
    problem.noise_scale = 1.7;
    problem.has_lever_arm = true;
    problem.lamps = {{{-0.8, -0.4, 1.6}, 0.002},
                     {{0.8, -0.4, 1.7}, 0},
                     {{0.7, 0.5, 1.5}, kIgnored},
                     {{-0.7, 0.4, 1.6}, 0.003},
                     {{0.1, 0.1, 1.8}, kIgnored}};
    Eigen::VectorXd& state = problem.state_vector();
    state.head<3>() << 0.3, -0.4, 0.2;
    state.segment<2>(kZenith) << 0.04, -0.03;
    state.segment<2>(kArm) << 0.03, -0.02;
    for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
      state.segment<3>(kLamps + 3 * static_cast<Eigen::Index>(i)) = problem.lamps[i].surveyed_m;
    }
    state.segment<3>(kLamps + 6) += Eigen::Vector3d(0.01, -0.02, 0.015);
    state.segment<3>(kPivots) << 0.1, -0.1, 0.05;
    state.segment<3>(kPivots + 3) << -0.2, 0.15, 0.1;
    add({0, level(0, 0), {{0.5, -0.7}, -0.6, 0.3, 0.2}}, {{}, 2.1});
    add({0, level(0, 0), {{0.5, -0.7}, 0.9, 0, 0}}, {{}, 0.4});
    add({{}, level(0.05, -0.04), {{0.4, 0.3}, 0.5, 0.2, 0.3}}, {{0.2, 0.1, 0.1}, -1.9});
    add({{}, level(0, 0), {{0.3, 0.2}, -0.4, 0, 0}}, {{-0.1, 0.2, 0}, 0.9});
    add({{}, level(0, 0), {{0.3, 0.2}, 0.7, 0.1, 0.1}}, {{-0.3, -0.2, 0}, 1.4});  // unused
    add({1, level(-0.03, 0.06), {}}, {{}, -2.8});
    add({{}, level(0, 0), {{-0.2, 0.6}, 0.3, 0.15, 0}}, {{0.3, -0.2, 0.2}, 3});
    problem.position_observations = {{0, 0, true, {0.102, -0.099, 0.051}, 3, 0.002},
                                     {1, 0, true, {0.102, -0.099, 0.051}, 3, 0.002},
                                     {1, 1, false, {0.1, -0.1, 9}, 2, 0.03},
                                     {2, 2, false, {0.201, 0.1, 0.099}, 3, 0.004},
                                     {3, 3, true, {-0.1, 0.24, 0}, 3, 0.02},
                                     {4, 4, false, {0, 0, 0}, 3, 0.001},
                                     {6, 5, true, {1, 1, 1}, 3, 0.001}};
    problem.is_known_position_used = {true, true, true, true, true, false};
    problem.gauge = Eigen::MatrixXd::Zero(15, 2);
    problem.gauge.topRows<3>() << 300, 20, -10, 200, 0, 10;
    problem.gauge.bottomRows<3>() << 50, 250, 30, 30, 5, -40;
    std::size_t count = 0;
    for (std::size_t k = 0; k < problem.captures.size(); ++k) {
      for (std::size_t lamp = 0; lamp < problem.lamps.size(); ++lamp, ++count) {
        const double n = static_cast<double>(count);
        Problem::Sighting sighting{k, lamp, {0, 0}, 0.5, {}, 0.01 * std::sin(n)};
        sighting.whitening << 2, 0.3, -0.2, 1.5;
        if (count % 3 == 1) sighting.whitening *= 0.5;
        sighting.pixel = predict_pixel(state, sighting) +
                         Eigen::Vector2d(0.8 * std::sin(7 * n), 0.9 * std::cos(5 * n));
        sighting.used = k != 4 && count % 11 != 3;
        problem.sightings.push_back(sighting);
      }
    }
  }

  static Eigen::Matrix3d level(double roll_rad, double pitch_rad) {
    return (Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
            Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX()))
        .toRotationMatrix()
        .transpose();
  }
  void add(const Problem::Capture& capture, const Pose& pose) {
    problem.add_capture_with_initial_pose(capture, pose);
  }

  /// Pose and motion of a capture in a state.
  struct Motion {
    Eigen::Vector3d position_m;
    Eigen::AngleAxisd world_from_level;
    Eigen::Vector3d velocity_m_per_s;
    double yaw_rate_rad_per_s;
  };
  Motion read_capture(const Eigen::VectorXd& state, std::size_t k) const {
    const Problem::Capture& capture = problem.captures[k];
    Eigen::Index next = kFirstLocal[k];
    Motion motion{{}, {}, {0, 0, 0}, capture.motion.yaw_rate_rad_per_s};
    if (capture.pivot) {
      motion.position_m = state.segment<3>(kPivots + 3 * static_cast<Eigen::Index>(*capture.pivot));
    } else {
      motion.position_m = state.segment<3>(next);
      motion.velocity_m_per_s.head<2>() = capture.motion.velocity_m_per_s;
      next += 3;
    }
    motion.world_from_level = Eigen::AngleAxisd(state[next++], Eigen::Vector3d::UnitZ());
    if (!capture.pivot && capture.motion.velocity_sd_m_per_s > 0) {
      motion.velocity_m_per_s.head<2>() = state.segment<2>(next);
      next += 2;
    }
    if (capture.motion.yaw_rate_sd_rad_per_s > 0) motion.yaw_rate_rad_per_s = state[next];
    return motion;
  }

  Eigen::Vector2d predict_pixel(const Eigen::VectorXd& state,
                                const Problem::Sighting& sighting) const {
    const Problem::Capture& capture = problem.captures[sighting.capture];
    const Motion motion = read_capture(state, sighting.capture);
    const double t_s = sighting.time_s;
    const Eigen::Vector3d lamp_m =
        state.segment<3>(kLamps + 3 * static_cast<Eigen::Index>(sighting.lamp));
    Eigen::Vector3d x = motion.world_from_level.inverse() * (lamp_m - motion.position_m);
    x -= motion.velocity_m_per_s * t_s;
    x = Eigen::AngleAxisd(-motion.yaw_rate_rad_per_s * t_s, Eigen::Vector3d::UnitZ()) * x;
    if (capture.pivot) x.head<2>() -= state.segment<2>(kArm);
    const Eigen::Vector3d zenith =
        Eigen::Vector3d(state[kZenith], state[kZenith + 1], 1).normalized();
    const Eigen::Quaterniond camera_from_base =
        Eigen::Quaterniond(1 + zenith.z(), -zenith.y(), zenith.x(), 0).normalized();
    x = camera_from_base * (capture.base_from_level * x);
    std::vector<double> intrinsics = camera.intrinsics;
    const Eigen::VectorXd error = problem.lens_parametrization().directions * state.head<3>();
    for (std::size_t i = 0; i < intrinsics.size(); ++i) {
      intrinsics[i] += error[static_cast<Eigen::Index>(i)];
    }
    return Lens(camera.lens_model, intrinsics).project_point(x).value();
  }

  Eigen::Vector3d predict_position(const Eigen::VectorXd& state,
                                   const Problem::PositionObservation& place) const {
    const Motion motion = read_capture(state, place.capture);
    const Eigen::Vector3d arm_m =
        motion.world_from_level * Eigen::Vector3d(state[kArm], state[kArm + 1], 0);
    if (problem.captures[place.capture].pivot) {
      return place.is_axis_position ? motion.position_m
                                    : Eigen::Vector3d(motion.position_m + arm_m);
    }
    return place.is_axis_position ? Eigen::Vector3d(motion.position_m - arm_m) : motion.position_m;
  }

  /// Returns all residuals of a state.
  std::vector<ReferenceTerm> make_terms(const Eigen::VectorXd& state) const {
    std::vector<ReferenceTerm> terms;
    for (const Problem::Sighting& sighting : problem.sightings) {
      if (!sighting.used) continue;
      terms.push_back({sighting.whitening * (sighting.pixel - predict_pixel(state, sighting)) /
                           problem.noise_scale,
                       true, true});
    }
    terms.push_back({state.head<3>(), false, false});
    for (std::size_t i = 0; i < problem.lamps.size(); ++i) {
      const auto& lamp = problem.lamps[i];
      if (lamp.sd_m == 0 || lamp.sd_m == kIgnored) continue;
      const Eigen::Vector3d lamp_m = state.segment<3>(kLamps + 3 * static_cast<Eigen::Index>(i));
      terms.push_back({(lamp_m - lamp.surveyed_m) / lamp.sd_m, true, false});
    }
    Eigen::VectorXd offsets_m = state.segment<15>(kLamps);
    for (Eigen::Index i = 0; i < 5; ++i) {
      offsets_m.segment<3>(3 * i) -= problem.lamps[static_cast<std::size_t>(i)].surveyed_m;
    }
    terms.push_back({problem.gauge.transpose() * offsets_m, false, false});
    for (const auto& place : problem.position_observations) {
      if (place.capture == 4 || place.known_position == 5) continue;
      const Eigen::Vector3d difference_m = predict_position(state, place) - place.measured_m;
      terms.push_back({difference_m.head(place.size) / place.sd_m, true, false});
    }
    for (const std::size_t k : {0U, 2U, 6U}) {
      const KnownMotion& known = problem.captures[k].motion;
      const Motion motion = read_capture(state, k);
      if (k != 0) {
        terms.push_back({(motion.velocity_m_per_s.head<2>() - known.velocity_m_per_s) /
                             known.velocity_sd_m_per_s,
                         false, false});
      }
      if (k == 6) continue;
      const double rate = motion.yaw_rate_rad_per_s - known.yaw_rate_rad_per_s;
      terms.push_back(
          {Eigen::VectorXd::Constant(1, rate / known.yaw_rate_sd_rad_per_s), false, false});
    }
    return terms;
  }

  /// Residuals of all terms with their weights and derivatives.
  struct ReferenceSystem {
    Eigen::VectorXd values;
    Eigen::MatrixXd jacobian;
    Eigen::Index detection_rows = 0;
  };
  /// Weights the terms as the Cauchy loss does if `robust`.
  ReferenceSystem linearize(bool robust) const {
    const Eigen::VectorXd& state = problem.state_vector();
    const auto stack = [](const std::vector<ReferenceTerm>& terms) {
      std::vector<double> rows;
      for (const auto& term : terms) rows.insert(rows.end(), term.value.begin(), term.value.end());
      return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(rows.data(), std::ssize(rows)));
    };
    const std::vector<ReferenceTerm> terms = make_terms(state);
    ReferenceSystem system{stack(terms), {}, 0};
    system.jacobian.resize(system.values.size(), state.size());
    for (Eigen::Index i = 0; i < state.size(); ++i) {
      constexpr double step = 1e-6;
      Eigen::VectorXd less = state, more = state;
      less[i] -= step;
      more[i] += step;
      system.jacobian.col(i) = (stack(make_terms(more)) - stack(make_terms(less))) / (2 * step);
    }
    Eigen::Index row = 0;
    for (const auto& term : terms) {
      const Eigen::Index size = term.value.size();
      if (term.is_detection) system.detection_rows = row + size;
      if (robust && term.has_loss) {
        const double weight =
            1 / std::sqrt(1 + term.value.squaredNorm() / (kCauchyWidth * kCauchyWidth));
        system.values.segment(row, size) *= weight;
        system.jacobian.middleRows(row, size) *= weight;
      }
      row += size;
    }
    return system;
  }

  /// Indices of the unknowns that the solution estimates: all but the exact lamp and the capture
  /// without used detections.
  std::vector<Eigen::Index> list_estimated() const {
    std::vector<Eigen::Index> indices;
    for (Eigen::Index i = 0; i < problem.state_vector().size(); ++i) {
      const bool is_exact = i >= kLamps + 3 && i < kLamps + 6;
      if (!is_exact && !(i >= kFirstLocal[4] && i < kFirstLocal[5])) indices.push_back(i);
    }
    return indices;
  }

  /// Returns the step of Gauss and Newton of all estimated unknowns, in their standard deviations.
  Eigen::VectorXd compute_step_in_sds(bool robust) const {
    const ReferenceSystem system = linearize(robust);
    const Eigen::MatrixXd jacobian = system.jacobian(Eigen::all, list_estimated());
    const Eigen::MatrixXd covariance =
        (jacobian.transpose() * jacobian)
            .ldlt()
            .solve(Eigen::MatrixXd::Identity(jacobian.cols(), jacobian.cols()));
    const Eigen::VectorXd step = covariance * (jacobian.transpose() * system.values);
    return step.cwiseQuotient(covariance.diagonal().cwiseSqrt());
  }

  /// Compares the covariance of the global unknowns and the degrees of freedom with one dense
  /// matrix of all unknowns, with the weak priors that the captures' poses have in the
  /// marginalization.
  void expect_covariance_of_dense_matrix(Eigen::Index num_used) const {
    const auto found = problem.compute_global_unknowns_covariance();
    const ReferenceSystem system = linearize(false);
    const std::vector<Eigen::Index> estimated = list_estimated();
    const Eigen::MatrixXd jacobian = system.jacobian(Eigen::all, estimated);
    Eigen::VectorXd weak = Eigen::VectorXd::Zero(problem.state_vector().size());
    weak.segment<2>(kZenith).setOnes();
    weak.segment<2>(kArm).setConstant(0.01);
    weak.segment<3>(kLamps + 6).setConstant(0.01);
    weak.segment<3>(kLamps + 12).setConstant(0.01);
    weak.segment<6>(kPivots).setConstant(0.01);
    for (const std::size_t k : {0U, 1U, 5U}) weak[kFirstLocal[k]] = kGuessInformation;
    for (const std::size_t k : {2U, 3U, 6U}) {
      weak.segment<4>(kFirstLocal[k]).setConstant(kGuessInformation);
    }
    Eigen::MatrixXd information = jacobian.transpose() * jacobian;
    information += Eigen::VectorXd(weak(estimated)).asDiagonal();
    const Eigen::MatrixXd covariance =
        information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
    const auto detections = jacobian.topRows(system.detection_rows);
    const double freedom = static_cast<double>(system.detection_rows) -
                           (detections * covariance * detections.transpose()).trace();

    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(kGlobal, kGlobal);
    for (std::size_t i = 0; i < estimated.size(); ++i) {
      for (std::size_t j = 0; j < estimated.size(); ++j) {
        if (estimated[i] >= kGlobal || estimated[j] >= kGlobal) continue;
        expected(estimated[i], estimated[j]) =
            covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
    ASSERT_EQ(found.matrix.rows(), kGlobal);
    for (Eigen::Index i = 0; i < kGlobal; ++i) {
      for (Eigen::Index j = 0; j < kGlobal; ++j) {
        EXPECT_NEAR(found.matrix(i, j), expected(i, j),
                    1e-5 * std::sqrt(expected(i, i) * expected(j, j)))
            << i << ", " << j;
      }
    }
    EXPECT_EQ(system.detection_rows, 2 * num_used);
    EXPECT_NEAR(found.degrees_of_freedom, freedom, 1e-4);
  }

  static constexpr Eigen::Index kZenith = 3, kArm = 5, kLamps = 7, kPivots = 22, kGlobal = 28;
  static constexpr std::array<Eigen::Index, 7> kFirstLocal{28, 30, 31, 38, 42, 49, 50};
  Camera camera = synthetic_camera();
  Problem problem{camera.lens_model,
                  LensParametrization(camera, make_covariance_of_three_intrinsics(camera)), 5, 2};
};

TEST_F(AdjustmentProblemTerms, LampObservationIsWhitenedMeasuredMinusPredictedPixel) {
  const auto lens = problem.current_lens();
  ASSERT_TRUE(lens);
  for (const Problem::Sighting& sighting : problem.sightings) {
    const auto found = problem.linearize_lamp_observation(sighting, *lens);
    ASSERT_TRUE(found);
    const Eigen::Vector2d expected =
        sighting.whitening * (sighting.pixel - predict_pixel(problem.state_vector(), sighting)) /
        1.7;
    EXPECT_THAT(found->value, IsNear(expected, 1e-9)) << sighting.capture << ", " << sighting.lamp;
  }
}

TEST_F(AdjustmentProblemTerms, LampObservationIsMissingForLampBehindCamera) {
  const auto lens = problem.current_lens();
  ASSERT_TRUE(lens);
  const Problem::Sighting& sighting = problem.sightings[0];
  ASSERT_TRUE(problem.linearize_lamp_observation(sighting, *lens));
  problem.state_vector()[kLamps + 2] = -1;
  EXPECT_FALSE(problem.linearize_lamp_observation(sighting, *lens));
  EXPECT_FALSE(problem.solve_adjustment(false));
}

TEST_F(AdjustmentProblemTerms, PredictedPositionIsThatOfCameraOrAxis) {
  const Eigen::VectorXd& state = problem.state_vector();
  for (const std::size_t capture : {0U, 2U}) {
    for (const bool is_axis_position : {false, true}) {
      const Problem::PositionObservation place{capture, 0, is_axis_position, {9, 9, 9}, 3, 1};
      EXPECT_THAT(problem.predict_camera_or_axis_position(place),
                  IsNear(predict_position(state, place), 1e-12))
          << capture << ", " << is_axis_position;
    }
  }
}

TEST_F(AdjustmentProblemTerms, SolutionMinimizesSumOfSquares) {
  const Eigen::VectorXd start = problem.state_vector();
  ASSERT_GT(compute_step_in_sds(false).cwiseAbs().maxCoeff(), 0.5);
  ASSERT_TRUE(problem.solve_adjustment(false));
  EXPECT_LT(compute_step_in_sds(false).cwiseAbs().maxCoeff(), 1e-5);
  const Eigen::VectorXd& state = problem.state_vector();
  EXPECT_EQ(state.segment<3>(kLamps + 3), start.segment<3>(kLamps + 3)) << "exact lamp";
  EXPECT_EQ(state.segment<7>(kFirstLocal[4]), start.segment<7>(kFirstLocal[4])) << "not used";
}

/// Outliers among detections, surveyed lamps, known positions, and priors without a loss.
TEST_F(AdjustmentProblemTerms, RobustSolutionMinimizesCauchyLossOfObservations) {
  problem.sightings[1].pixel += Eigen::Vector2d(30, -20);
  problem.lamps[0].surveyed_m.x() += 0.03;
  problem.position_observations[3].measured_m.y() -= 0.05;
  problem.captures[6].motion.velocity_m_per_s.x() += 1;
  ASSERT_GT(compute_step_in_sds(true).cwiseAbs().maxCoeff(), 0.5);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(problem.solve_adjustment(true));
  EXPECT_LT(compute_step_in_sds(true).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_GT(compute_step_in_sds(false).cwiseAbs().maxCoeff(), 5) << "outliers bias plain squares";
}

TEST_F(AdjustmentProblemTerms, SolutionFailsForInvalidLens) {
  problem.state_vector()[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(problem.solve_adjustment(false));
}

TEST_F(AdjustmentProblemTerms, CovarianceAndDegreesOfFreedomMatchDenseMatrix) {
  expect_covariance_of_dense_matrix(27);
}

/// One detection and no known position: only a guess determines the pose. Large noise makes the
/// guess as accurate as the detections.
TEST_F(AdjustmentProblemTerms, CovarianceOfCaptureWithOneDetectionMatchesDenseMatrix) {
  problem.position_observations.erase(problem.position_observations.begin() + 4);
  Eigen::Index num_used = 0;
  bool has_detection = false;
  for (Problem::Sighting& sighting : problem.sightings) {
    if (sighting.capture == 3) {
      sighting.used &= !has_detection;
      has_detection |= sighting.used;
    }
    if (sighting.used) ++num_used;
  }
  ASSERT_LT(num_used, 25);
  expect_covariance_of_dense_matrix(num_used);
  problem.noise_scale = 5e3;
  expect_covariance_of_dense_matrix(num_used);
}

TEST(AdjustmentProblem, LensWithOneErrorHasPriorAndDerivative) {
  const Camera camera = synthetic_camera();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(12, 12);
  covariance(0, 0) = 4;
  Problem problem(camera.lens_model, LensParametrization(camera, covariance), 1, 0);
  ASSERT_EQ(problem.state_vector_layout().lens_size, 1);
  const double fx_sd_px = problem.lens_parametrization().directions(0, 0);
  EXPECT_NEAR(std::abs(fx_sd_px), 2, 1e-12);
  problem.lamps = {{{0.4, 0.3, 1.6}, 0}};
  problem.state_vector().segment<3>(problem.state_vector_layout().lamps) << 0.4, 0.3, 1.6;
  EXPECT_NEAR(problem.compute_global_unknowns_covariance().matrix(0, 0), 1, 1e-12);

  problem.add_capture_with_initial_pose({{}, Eigen::Matrix3d::Identity()}, {{0, 0, 0}, 0});
  const Problem::Sighting sighting{0, 0, {0, 0}, 1, Eigen::Matrix2d::Identity(), 0};
  const auto found = problem.linearize_lamp_observation(sighting, problem.current_lens().value());
  ASSERT_TRUE(found);
  ASSERT_EQ(found->blocks.size(), 4U);
  EXPECT_EQ(found->blocks[3].first, 0);
  // The pixel is fx times the distorted x, plus cx.
  const double distorted_x = (-found->value.x() - camera.intrinsics[2]) / camera.intrinsics[0];
  EXPECT_THAT(found->blocks[3].jacobian,
              IsNear(Eigen::MatrixXd(Eigen::Vector2d(-fx_sd_px * distorted_x, 0)), 1e-12));
}

}  // namespace
}  // namespace vlp
