// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the budget of a camera with the covariance of its fixes, with fixes of drawn errors,
/// and part by part.
#include "evaluation/errors/unit_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <array>
#include <numeric>
#include <span>
#include <vector>

#include "evaluation/errors/floor_limits.h"
#include "geometry/symmetric.h"
#include "positioning/positioner.h"
#include "positioning/stated_rig.h"
#include "rig/calibration_builder.h"
#include "rig/calibration_error.h"
#include "support/matchers.h"
#include "support/station_verdicts.h"

namespace vlp {
namespace {

constexpr double kNoise_px = 0.1;

StatedRig adjusted() {
  StatedRig rig;
  rig.adjust(1);
  return rig;
}

StatedRig in_a_row() {
  StatedRig rig;
  rig.calibrate_in_a_row();
  return rig;
}

std::vector<std::size_t> all_lamps() {
  std::vector<std::size_t> lamps(8);
  std::iota(lamps.begin(), lamps.end(), 0U);
  return lamps;
}

UnitBudget compute_budget(const StatedRig& rig) {
  return *UnitErrors(rig.map, rig.calibration).compute_budget(rig.camera, all_lamps(), kNoise_px);
}

/// seen_from() does not apply the dispersion.
std::vector<Detection> make_detections(const StatedRig& rig) {
  const Lens lens(rig.calibration.camera.lens_model, rig.calibration.camera.intrinsics);
  const Eigen::Matrix3d camera_from_level =
      compute_level_from_camera_matrix(rig.calibration, Correction::all).inverse();
  std::vector<Detection> detections;
  for (const Lamp& lamp : rig.map.lamps) {
    const auto pixel =
        lens.project_point(camera_from_level * level_point_from_world(rig.camera, lamp.position_m));
    detections.push_back({lamp.id, pixel.value(), kNoise_px});
  }
  return detections;
}

class UnitErrorsParts : public testing::TestWithParam<StatedRig> {};

TEST_P(UnitErrorsParts, BudgetTermsSumToFixCovarianceOfLevelCamera) {
  const StatedRig& rig = GetParam();
  const Fix fix = Positioner(rig.map, rig.calibration).compute_position_fix(make_detections(rig));
  ASSERT_TRUE(fix.has_succeeded());
  ASSERT_EQ(fix.lamps, 8);
  const UnitBudget budget = compute_budget(rig);
  const Eigen::Matrix4d common = (fix.covariance - fix.noise_covariance).topLeftCorner<4, 4>();
  const Eigen::Vector4d sd = fix.pose_covariance().diagonal().cwiseSqrt();
  const Eigen::Matrix4d scale = sd * sd.transpose();
  // Convergence tolerance of the fix.
  constexpr double stopped = 1e-8;
  EXPECT_LT((budget.common_covariance() - common).cwiseQuotient(scale).cwiseAbs().maxCoeff(),
            stopped);
  EXPECT_LT((budget.noise - fix.noise_covariance.topLeftCorner<4, 4>())
                .cwiseQuotient(scale)
                .cwiseAbs()
                .maxCoeff(),
            stopped);
  EXPECT_EQ(budget.total_pose_covariance(), Matrix4(budget.noise + budget.common_covariance()));
}

/// The same for a camera that may move and be tilted.
TEST_P(UnitErrorsParts, BudgetTermsSumToFixCovarianceWithUnknownMotion) {
  StatedRig rig = GetParam();
  rig.calibration.camera.row_time_s = 55e-6;
  rig.calibration.camera.readout = Readout::rows;
  Sensors sensors;
  sensors.motion = KnownMotion::make_motion_prior_from_limits(2, 1);
  sensors.inclination_sigma_rad = 0.1;
  const Fix fix =
      Positioner(rig.map, rig.calibration).compute_position_fix(make_detections(rig), sensors);
  ASSERT_TRUE(fix.has_succeeded());
  ASSERT_EQ(fix.lamps, 8);
  BodyPrior prior;
  prior.set_state_sd(kBodyVelocity, 1);
  prior.set_state_sd(kBodyYawRate, 0.5);
  prior.set_state_sd(kBodyRoll, 0.1);
  const auto budget = UnitErrors(rig.map, rig.calibration)
                          .compute_budget(rig.camera, all_lamps(), kNoise_px, prior);
  ASSERT_TRUE(budget);
  const Eigen::Vector4d sd = fix.pose_covariance().diagonal().cwiseSqrt();
  const Eigen::Matrix4d scale = sd * sd.transpose();
  constexpr double stopped = 1e-6;
  const auto differ = [&](const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
    return (a - b).cwiseQuotient(scale).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(differ(budget->noise + budget->motion + budget->roll_pitch,
                   fix.noise_covariance.topLeftCorner<4, 4>()),
            stopped);
  EXPECT_LT(differ(budget->common_covariance(),
                   (fix.covariance - fix.noise_covariance).topLeftCorner<4, 4>()),
            stopped);
  EXPECT_LT(differ(budget->total_pose_covariance(), fix.pose_covariance()), stopped);
  EXPECT_GT(budget->roll_pitch(0, 0), budget->noise(0, 0)) << "unknown roll and pitch cost much";
}

TEST_P(UnitErrorsParts, CovariancesOfErrorSourcesSumToJointCovariance) {
  const StatedRig& rig = GetParam();
  const UnitErrors unit(rig.map, rig.calibration);
  const Eigen::MatrixXd& whole = unit.common_errors().joint_covariance();
  ASSERT_GT(whole.rows(), 0);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(whole.rows(), whole.cols());
  for (const CommonErrorSource part : kCommonErrorSources)
    sum += unit.common_errors().isolate_error_source(part).joint_covariance();
  const Eigen::VectorXd inverse_sd = whole.diagonal().cwiseSqrt().cwiseInverse();
  EXPECT_THAT(inverse_sd.asDiagonal() * (sum - whole) * inverse_sd.asDiagonal(),
              IsNear(Eigen::MatrixXd::Zero(whole.rows(), whole.cols()), 1e-13));
}

TEST_P(UnitErrorsParts, BudgetTermsArePositiveSemidefinite) {
  const UnitBudget budget = compute_budget(GetParam());
  for (const Matrix4& part :
       {budget.noise, budget.lens, budget.zenith, budget.offset, budget.lamp_map}) {
    const Eigen::Vector4d sd = budget.total_pose_covariance().diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = sd.asDiagonal() * part * sd.asDiagonal();
    EXPECT_GT(eigendecompose(scaled).values.minCoeff(), -1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Stated, UnitErrorsParts, testing::Values(adjusted(), in_a_row()),
                         [](const auto& one) { return one.index == 0 ? "Adjusted" : "InARow"; });

TEST(UnitErrors, BudgetTermIsZeroForQuantityWithoutError) {
  StatedRig rig = adjusted();
  MatrixX& covariance = rig.calibration.covariance->matrix;
  const auto without = [&](Eigen::Index first, Eigen::Index size) {
    StatedRig other = rig;
    MatrixX& left = other.calibration.covariance->matrix;
    left.middleRows(first, size).setZero();
    left.middleCols(first, size).setZero();
    return compute_budget(other);
  };
  const UnitBudget lens = without(0, 12), zenith = without(12, 2), map = without(16, 24);
  EXPECT_TRUE(lens.lens.isZero(0) && zenith.zenith.isZero(0) && map.lamp_map.isZero(0));
  for (const UnitBudget& budget : {lens, zenith, map}) {
    EXPECT_GT(budget.common_covariance()(0, 0), 0);
    EXPECT_TRUE(budget.offset.isZero(0));
  }
  covariance.setZero();
  EXPECT_TRUE(compute_budget(rig).common_covariance().isZero(0));
}

TEST(CommonErrors, IsolatedErrorSourceIsUnknownIfItsVarianceIsZero) {
  StatedRig rig = adjusted();
  const auto is_lens_error_known = [&] {
    return UnitErrors(rig.map, rig.calibration)
        .common_errors()
        .isolate_error_source(CommonErrorSource::lens)
        .has_known_errors();
  };
  EXPECT_TRUE(is_lens_error_known());
  MatrixX& covariance = rig.calibration.covariance->matrix;
  covariance.topRows(12).setZero();
  covariance.leftCols(12).setZero();
  EXPECT_FALSE(is_lens_error_known());
}

TEST(UnitErrors, BudgetIsNulloptForLampsBelowCamera) {
  StatedRig rig = adjusted();
  const UnitErrors unit(rig.map, rig.calibration);
  const std::vector<std::size_t> lamps{0, 1};
  const auto has_budget_at = [&](double above_lamp_m) {
    Pose camera = rig.camera;
    camera.position_m.z() = rig.map.lamps[0].position_m.z() + above_lamp_m;
    return unit.compute_budget(camera, lamps, kNoise_px).has_value();
  };
  EXPECT_TRUE(has_budget_at(-0.5));
  EXPECT_FALSE(has_budget_at(0.01));
}

/// Each part of sequential steps results from the covariance of one step alone.
TEST(UnitErrors, BudgetTermEqualsBudgetWithOnlyThatError) {
  const UnitBudget whole = compute_budget(in_a_row());
  const auto compute_with = [](std::array<double, 4> errors) {
    StatedRig rig;
    rig.calibrate_in_a_row(errors);
    return compute_budget(rig).common_covariance();
  };
  const double small = 1e-9 * whole.common_covariance().cwiseAbs().maxCoeff();
  EXPECT_THAT(whole.lens, IsNear(compute_with({1, 0, 0, 0}), small));
  EXPECT_THAT(whole.zenith, IsNear(compute_with({0, 1, 0, 0}), small));
  EXPECT_THAT(whole.offset, IsNear(compute_with({0, 0, 1, 0}), small));
  EXPECT_THAT(whole.lamp_map, IsNear(compute_with({0, 0, 0, 1}), small));
}

/// Fixes with calibrations and maps drawn from the reported covariance, and with pixel noise.
TEST(UnitErrors, BudgetMatchesFixErrorsOfRandomlyDrawnCalibrations) {
  const StatedRig rig = adjusted();
  const UnitBudget budget = compute_budget(rig);
  const auto exact = make_detections(rig);
  const Eigen::MatrixXd root = rig.calibration.covariance->matrix.llt().matrixL();
  Random random(11);
  NeesStatistics nees;
  Eigen::Matrix4d scatter = Eigen::Matrix4d::Zero();
  constexpr int trials = 2000;
  for (int trial = 0; trial < trials; ++trial) {
    Eigen::VectorXd draw(root.cols());
    for (double& one : draw) one = random.normal();
    const Eigen::VectorXd error = root * draw;
    Calibration calibration = add_zenith_error(
        add_intrinsics_error(rig.calibration, error.head<12>()), error.segment<2>(12));
    calibration.adjustment.reset();
    calibration.covariance.reset();
    LampMap map = rig.map;
    for (std::size_t i = 0; i < 8; ++i) {
      map.lamps[i].position_m += error.segment<3>(16 + 3 * static_cast<Eigen::Index>(i));
    }
    const Fix fix = Positioner(map, calibration).compute_position_fix(with_noise(exact, random));
    ASSERT_TRUE(fix.has_succeeded());
    const Eigen::Vector4d off = compute_pose_error(fix, rig.camera);
    scatter += off * off.transpose() / trials;
    nees.add(off, budget.total_pose_covariance());
  }
  // 2000 draws determine a variance to 3.2 %, its root to half of that.
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(std::sqrt(scatter(i, i) / budget.total_pose_covariance()(i, i)), 1, 0.06) << i;
  }
  EXPECT_NEAR(nees.mean(), 1, 0.06);
  EXPECT_NEAR(nees.fraction(), 0.95, 0.02);
}

TEST(ComputeFixSds, ReturnsZeroForTinyNegativeVariances) {
  const FixSds spread = compute_fix_sds(Matrix4(-1e-22 * Matrix4::Identity()));
  EXPECT_EQ(spread.horizontal_m, 0);
  EXPECT_EQ(spread.height_m, 0);
  EXPECT_EQ(spread.yaw_rad, 0);
}

TEST(UnitErrors, IsKnownOrAbsentIsFalseForSourcesWithoutSd) {
  StatedRig rig;
  const auto stated = [&](CommonErrorSource part) {
    return UnitErrors(rig.map, rig.calibration).common_errors().is_known_or_absent(part);
  };
  EXPECT_FALSE(UnitErrors(rig.map, rig.calibration).common_errors().has_known_errors());
  EXPECT_FALSE(stated(CommonErrorSource::lens) || stated(CommonErrorSource::zenith) ||
               stated(CommonErrorSource::lamps));
  EXPECT_TRUE(stated(CommonErrorSource::offset));  // there is none
  rig = in_a_row();
  for (const CommonErrorSource part : kCommonErrorSources) EXPECT_TRUE(stated(part));
  rig.map.lamps[3].sd_m.reset();
  const Dispersion dispersion = *rig.calibration.dispersion;
  rig.calibration = remove_dispersion(rig.calibration);
  rig.calibration.dispersion = dispersion;
  EXPECT_FALSE(stated(CommonErrorSource::lamps) || stated(CommonErrorSource::offset));
}

TEST(UnitErrors, BudgetIsNulloptUnlessThereAre2To256Lamps) {
  StatedRig rig;
  std::vector<Eigen::Vector3d> positions_m;
  for (int i = 0; i < 300; ++i) positions_m.emplace_back(0.01 * (i % 20), 0.01 * (i / 20), 1.6);
  rig.map = make_lamp_map(positions_m);
  rig.calibration.camera.row_time_s = 55e-6;
  rig.calibration.camera.readout = Readout::rows;
  BodyPrior prior;
  prior.set_state_sd(kBodyVelocity, 1);
  const UnitErrors unit(rig.map, rig.calibration);
  std::vector<std::size_t> lamps(300);
  std::iota(lamps.begin(), lamps.end(), 0U);
  for (const std::size_t count : {1u, 2u, 256u, 257u, 300u}) {
    const std::span<const std::size_t> some(lamps.data(), count);
    const bool possible = count == 2 || count == 256;
    EXPECT_EQ(unit.compute_budget(rig.camera, some, kNoise_px).has_value(), possible) << count;
    EXPECT_EQ(unit.compute_budget(rig.camera, some, kNoise_px, prior).has_value(), possible)
        << count;
  }
}

TEST(UnitErrors, ListVisibleLampsAppliesCalibratedTilt) {
  StatedRig rig;
  rig.map = make_lamp_map({{0, 0, 1.6}, {0.1, 0, 1.6}});
  rig.camera = {{0, 0, 0}, 0};
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.9, 0);
  EXPECT_TRUE(UnitErrors(rig.map, rig.calibration).list_visible_lamps(rig.camera).empty());
  rig.calibration.rotation_center = tilted_by(rig.calibration.camera, 0.1, 0);
  EXPECT_EQ(UnitErrors(rig.map, rig.calibration).list_visible_lamps(rig.camera).size(), 2U);
}

TEST(FloorSummary, LargestErrorSourceIsOneWithLargestVariance) {
  StatedRig rig = in_a_row();
  const auto summary_of = [&](double map_sd_m, double noise_px) {
    for (Lamp& lamp : rig.map.lamps) lamp.sd_m = map_sd_m;
    const FloorLimits limits = compute_floor_limits(UnitErrors(rig.map, rig.calibration),
                                                    {-0.2, 0.2, -0.1, 0.1, 0.1}, 0, 0.4, noise_px);
    EXPECT_EQ(limits.sources.size(), 5U);
    EXPECT_EQ(limits.positions.size(), 15U);
    return summarize_limits(limits).value();
  };
  EXPECT_EQ(summary_of(0.01, 0.1).largest_error_source().source.key, "lamp_map");
  EXPECT_EQ(summary_of(1e-5, 5).largest_error_source().source.key, "noise");
  const FloorSummary summary = summary_of(0.001, 0.1);
  double sum_of_fractions = 0;
  for (const auto& source : summary.sources) sum_of_fractions += source.fraction;
  EXPECT_NEAR(sum_of_fractions, 1, 1e-12);
  rig.calibration.dispersion.reset();
  const FloorLimits without =
      compute_floor_limits(UnitErrors(rig.map, rig.calibration), {0, 0, 0, 0, 0.1}, 0, 0.4, 0.1);
  EXPECT_EQ(without.sources.size(), 4U);
}

}  // namespace
}  // namespace vlp
