// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Compares the displacements of lamps with one dense least-squares problem, and tests the limits
/// of outliers and of connected detections.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "calibration/map/lamp_displacements.h"
#include "geometry/plane.h"
#include "geometry/robust_scatter.h"
#include "support/matchers.h"
#include "support/random.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

using testing::ElementsAre;

/// Seven lamps of several heights, projected from six positions and yaws. Every other view lacks a
/// lamp.
class EstimateLampDisplacementsEquations : public testing::Test {
 protected:
  EstimateLampDisplacementsEquations() {
    map = make_lamp_map({{-0.8, -0.4, 1.7},
                         {0.9, -0.5, 1.6},
                         {0.7, 0.4, 1.5},
                         {-0.7, 0.5, 1.6},
                         {0.1, 0.6, 1.8},
                         {-0.3, -0.6, 1.6},
                         {0.4, 0.1, 1.65}});
    for (int c = 0; c < 6; ++c) {
      CeilingView view{{0.2 * (c % 3) - 0.1, 0.15 * (c % 2) + 0.05}, {}, 0.9 * c - 2};
      const double height_m = 0.1 * (c % 4);
      for (const Lamp& lamp : map.lamps) {
        if (c % 2 == 0 && lamp.id == 1 + c) continue;
        view.lamps.push_back({lamp.id, lamp.position_m.head<2>(), lamp.position_m.z() - height_m});
      }
      views.push_back(view);
    }
  }

  /// Adds normal noise to all projections.
  void add_noise(double sd_m, std::uint64_t seed) {
    Random random(seed);
    for (CeilingView& view : views) {
      for (auto& projection : view.lamps) {
        projection.projected_m += sd_m * Eigen::Vector2d{random.normal(), random.normal()};
      }
    }
  }

  Eigen::Vector2d map_m(int lamp) const {
    return map.lamps[static_cast<std::size_t>(lamp - 1)].position_m.head<2>();
  }

  /// Columns of the dense problem: displacements of all lamps, tilt, and four per view.
  struct DenseProblem {
    Eigen::MatrixXd columns;
    Eigen::VectorXd observed_m;
  };
  DenseProblem make_dense_problem() const {
    const Eigen::Index lamps = 2 * std::ssize(map.lamps), views_at = lamps + 2;
    Eigen::Index rows = 0;
    for (const CeilingView& view : views) rows += 2 * std::ssize(view.lamps);
    DenseProblem problem{Eigen::MatrixXd::Zero(rows, views_at + 4 * std::ssize(views)),
                         Eigen::VectorXd(rows)};
    Eigen::Index row = 0;
    for (std::size_t c = 0; c < views.size(); ++c) {
      const Eigen::Index at = views_at + 4 * static_cast<Eigen::Index>(c);
      const Eigen::Matrix2d world_from_level =
          Eigen::Rotation2Dd(views[c].yaw_rad).toRotationMatrix();
      for (const auto& [lamp, projected_m, above_m] : views[c].lamps) {
        const Eigen::Vector2d arm_m = projected_m - views[c].camera_m, z = arm_m / above_m;
        auto two_rows = problem.columns.middleRows(row, 2);
        two_rows.middleCols(2 * (lamp - 1), 2).setIdentity();
        two_rows.middleCols(lamps, 2) =
            -above_m * (Eigen::Matrix2d::Identity() + z * z.transpose()) * world_from_level;
        two_rows.middleCols(at, 2).setIdentity();
        two_rows.col(at + 2) << -arm_m.y(), arm_m.x();
        two_rows.col(at + 3) = z;
        problem.observed_m.segment<2>(row) = projected_m - map_m(lamp);
        row += 2;
      }
    }
    return problem;
  }

  /// Orthonormal basis of the displacements without shift, rotation and scale of the map.
  Eigen::MatrixXd make_basis_of_shapes() const {
    Eigen::MatrixXd similarity(2 * std::ssize(map.lamps), 4);
    for (int lamp = 1; lamp <= std::ssize(map.lamps); ++lamp) {
      similarity.middleRows(2 * lamp - 2, 2) << 1, 0, -map_m(lamp).y(), map_m(lamp).x(),  //
          0, 1, map_m(lamp).x(), map_m(lamp).y();
    }
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(similarity);
    const Eigen::MatrixXd q = qr.householderQ();
    return q.rightCols(q.cols() - 4);
  }

  LampMap map;
  std::vector<CeilingView> views;
};

TEST_F(EstimateLampDisplacementsEquations, DisplacementsAndCovarianceMatchDenseLeastSquares) {
  add_noise(3e-3, 5);
  const Eigen::MatrixXd basis = make_basis_of_shapes();
  const DenseProblem dense = make_dense_problem();
  const Eigen::Index shapes = basis.cols(), view_columns = 4 * std::ssize(views);
  for (const bool tilt_is_free : {false, true}) {
    const Eigen::Index tilt = tilt_is_free ? 2 : 0;
    Eigen::MatrixXd columns(dense.columns.rows(), shapes + tilt + view_columns);
    columns << dense.columns.leftCols(14) * basis, dense.columns.middleCols(14, tilt),
        dense.columns.rightCols(view_columns);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
    ASSERT_EQ(qr.rank(), columns.cols());
    const Eigen::VectorXd solution = qr.solve(dense.observed_m);
    const Eigen::VectorXd residuals_m = dense.observed_m - columns * solution;
    const double freedom = static_cast<double>(columns.rows() - columns.cols());
    const Eigen::MatrixXd inverse =
        (columns.transpose() * columns)
            .colPivHouseholderQr()
            .solve(Eigen::MatrixXd::Identity(columns.cols(), columns.cols()));

    const auto found = estimate_lamp_displacements(map, views, tilt_is_free);
    ASSERT_TRUE(found);
    EXPECT_THAT(found->outliers_m, testing::IsEmpty());
    EXPECT_THAT(found->lamps, ElementsAre(1, 2, 3, 4, 5, 6, 7));
    EXPECT_THAT(found->captures, ElementsAre(5, 6, 5, 6, 5, 6, 6));
    for (int lamp = 1; lamp <= 7; ++lamp) {
      EXPECT_EQ(found->map_m[static_cast<std::size_t>(lamp - 1)], map_m(lamp));
      EXPECT_THAT(found->displaced_lamp_position_m(static_cast<std::size_t>(lamp - 1)),
                  IsNear(map_m(lamp) + found->displacement_m.segment<2>(2 * lamp - 2), 1e-15));
    }
    EXPECT_EQ(found->degrees_of_freedom, freedom);
    EXPECT_EQ(found->inlier_fraction, 1);
    EXPECT_EQ(found->height_m, 1.6) << "lamp 2, the first one in the first view";
    EXPECT_THAT(found->displacement_m, IsNear(basis * solution.head(shapes), 1e-10));
    EXPECT_THAT(found->projector, IsNear(basis * basis.transpose(), 1e-12));
    EXPECT_THAT(found->covariance_m2,
                IsNear(residuals_m.squaredNorm() / freedom * basis *
                           inverse.topLeftCorner(shapes, shapes) * basis.transpose(),
                       1e-12));
    if (tilt_is_free) {
      EXPECT_THAT(found->tilt, IsNear(solution.segment<2>(shapes), 1e-10));
    } else {
      EXPECT_EQ(found->tilt, Eigen::Vector2d(0, 0));
    }
    Eigen::Index row = 0;
    ASSERT_EQ(found->residuals_m.size(), views.size());
    for (const Eigen::VectorXd& residuals_of_view_m : found->residuals_m) {
      const Eigen::VectorXd expected = residuals_m.segment(row, residuals_of_view_m.size());
      EXPECT_THAT(residuals_of_view_m, IsNear(expected, 1e-10));
      row += residuals_of_view_m.size();
    }

    // Squared residuals of lamps at any positions.
    Eigen::VectorXd positions(14);
    for (Eigen::Index i = 0; i < 14; ++i) positions[i] = std::sin(static_cast<double>(i * i));
    const Eigen::MatrixXd without_lamps = columns.rightCols(tilt + view_columns);
    const Eigen::VectorXd expected = dense.columns.leftCols(14) * positions;
    const Eigen::VectorXd projected =
        without_lamps * without_lamps.colPivHouseholderQr().solve(expected);
    EXPECT_NEAR(positions.dot(found->information * positions), (expected - projected).squaredNorm(),
                1e-10);
  }
}

/// Errors of position, yaw, height and tilt of every view, as small as the equations are linear.
TEST_F(EstimateLampDisplacementsEquations, PoseAndTiltErrorsDisplaceNoLamp) {
  const Eigen::Vector2d tilt(3e-6, -2e-6);
  for (std::size_t c = 0; c < views.size(); ++c) {
    const double sign = c % 2 == 0 ? 1e-5 : -2e-5;
    const Eigen::Matrix2d world_from_level =
        Eigen::Rotation2Dd(views[c].yaw_rad).toRotationMatrix();
    for (auto& [lamp, projected_m, above_m] : views[c].lamps) {
      const Eigen::Vector2d arm_m = projected_m - views[c].camera_m, z = arm_m / above_m;
      projected_m +=
          sign * (Eigen::Vector2d(0.3, 0.2) + Eigen::Vector2d(-arm_m.y(), arm_m.x()) + z);
      projected_m -=
          above_m * (Eigen::Matrix2d::Identity() + z * z.transpose()) * world_from_level * tilt;
    }
  }
  const auto found = estimate_lamp_displacements(map, views, true);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->tilt, IsNear(tilt, 1e-9));
  EXPECT_LT(found->displacement_m.cwiseAbs().maxCoeff(), 1e-9);
}

/// A lamp of one view, and views that have fewer than three lamps without it.
TEST_F(EstimateLampDisplacementsEquations, IgnoresUnconnectedDetectionsAndViews) {
  const auto keep = [](CeilingView view, const std::vector<int>& lamps) {
    std::erase_if(view.lamps, [&](const CeilingView::ProjectedLamp& one) {
      return std::find(lamps.begin(), lamps.end(), one.lamp) == lamps.end();
    });
    return view;
  };
  const CeilingView& all = views[1];
  ASSERT_EQ(all.lamps.size(), 7U);
  const auto found = estimate_lamp_displacements(
      map, {keep(all, {1, 2, 5}), keep(all, {1, 2, 3}), keep(all, {1, 2, 3}), keep(all, {1, 6}),
            keep(all, {2, 6}), keep(all, {2, 3, 4, 7}), keep(all, {2, 3, 4})});
  ASSERT_TRUE(found);
  EXPECT_THAT(found->lamps, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(found->captures, ElementsAre(2, 4, 4, 2));
  EXPECT_EQ(found->degrees_of_freedom, 4 * 2 - (8 - 4));
  EXPECT_EQ(found->inlier_fraction, 1);
}

TEST_F(EstimateLampDisplacementsEquations, RequiresDegreesOfFreedomAndTwoViews) {
  for (CeilingView& view : views) {
    std::erase_if(view.lamps, [](const CeilingView::ProjectedLamp& one) {
      return one.lamp != 2 && one.lamp != 4 && one.lamp != 6;
    });
    ASSERT_EQ(view.lamps.size(), 3U);
  }
  const auto first = [&](std::ptrdiff_t count) {
    return std::vector<CeilingView>(views.begin(), views.begin() + count);
  };
  EXPECT_FALSE(estimate_lamp_displacements(map, first(1)));
  const auto of_two = estimate_lamp_displacements(map, first(2));
  ASSERT_TRUE(of_two);
  EXPECT_EQ(of_two->degrees_of_freedom, 2);
  EXPECT_FALSE(estimate_lamp_displacements(map, first(2), true)) << "0 with a free tilt";
  const auto of_three = estimate_lamp_displacements(map, first(3), true);
  ASSERT_TRUE(of_three);
  EXPECT_EQ(of_three->degrees_of_freedom, 2);
}

/// Outliers at the first, a middle and the last detection of a view.
TEST_F(EstimateLampDisplacementsEquations, RejectsOutliersOfSeveralViews) {
  const std::vector<CeilingView> once = views;
  for (int i = 0; i < 3; ++i) views.insert(views.end(), once.begin(), once.end());
  views[1].lamps[0].projected_m.x() += 0.05;
  views[3].lamps[1].projected_m.y() -= 0.04;
  views[5].lamps[6].projected_m.y() += 0.03;
  views[4].lamps.back().projected_m.x() += 0.02;
  const auto found = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(found);
  ASSERT_EQ(found->outliers_m.size(), 3U);
  ASSERT_EQ(found->outliers_m.at(1).size(), 1U);
  ASSERT_EQ(found->outliers_m.at(2).size(), 1U);
  ASSERT_EQ(found->outliers_m.at(7).size(), 2U);
  EXPECT_GT(found->outliers_m.at(1)[0], 0.02);
  EXPECT_LT(found->outliers_m.at(1)[0], 0.05);
  EXPECT_EQ(found->inlier_fraction, 152.0 / 156);
  EXPECT_LT(found->displacement_m.cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_THAT(found->captures, ElementsAre(19, 23, 20, 24, 20, 24, 22));
}

/// Residuals below half the largest one are compared with the limit again when it is removed.
TEST_F(EstimateLampDisplacementsEquations, RejectsOutliersAboveHalfOfLargestResidualFirst) {
  const std::vector<CeilingView> once = views;
  for (int i = 0; i < 3; ++i) views.insert(views.end(), once.begin(), once.end());
  const std::vector<CeilingView> exact = views;
  // Lamp 1 has the largest residual. Both residuals are linear in both errors.
  const auto set_errors = [&](double first_m, double second_m) {
    views = exact;
    views[1].lamps[0].projected_m.x() += first_m;
    views[4].lamps[2].projected_m.y() += second_m;
    ASSERT_EQ(views[1].lamps[0].lamp, 1);
    ASSERT_EQ(views[4].lamps[2].lamp, 3);
  };
  constexpr double first_m = 1e-4, without_rejection = 2e-4;
  for (const double ratio : {0.45, 0.55}) {
    // Ratio of the residuals from errors below the limit of rounding errors.
    const auto compute_residuals_m = [&](double second_m) {
      set_errors(without_rejection * first_m, without_rejection * second_m);
      const auto found = estimate_lamp_displacements(map, views);
      if (!found || !found->outliers_m.empty()) return Eigen::Vector2d(0, 0);
      return Eigen::Vector2d(found->residuals_m[1].head<2>().norm() / without_rejection,
                             found->residuals_m[4].segment<2>(4).norm() / without_rejection);
    };
    double low_m = 0, high_m = first_m;
    for (int iteration = 0; iteration < 30; ++iteration) {
      const double middle_m = (low_m + high_m) / 2;
      const Eigen::Vector2d residuals_m = compute_residuals_m(middle_m);
      ASSERT_GT(residuals_m.x(), 0);
      (residuals_m.y() < ratio * residuals_m.x() ? low_m : high_m) = middle_m;
    }
    const double together_m = compute_residuals_m(low_m).y();
    set_errors(first_m, low_m);
    const auto found = estimate_lamp_displacements(map, views);
    views[1].lamps.erase(views[1].lamps.begin());
    const auto without_first = estimate_lamp_displacements(map, views);
    ASSERT_TRUE(found && without_first);
    ASSERT_THAT(found->outliers_m, ElementsAre(testing::Key(1), testing::Key(3)));
    ASSERT_THAT(without_first->outliers_m, ElementsAre(testing::Key(3)));
    const double alone_m = without_first->outliers_m.at(3)[0];
    ASSERT_GT(std::abs(alone_m / together_m - 1), 1e-3) << "the order matters";
    EXPECT_NEAR(found->outliers_m.at(3)[0] / (ratio < 0.5 ? alone_m : together_m), 1, 1e-4);
  }
}

TEST_F(EstimateLampDisplacementsEquations, KeepsResidualsOfRoundingErrors) {
  views[2].lamps[3].projected_m.x() += 1e-7;
  auto found = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->outliers_m, testing::IsEmpty());
  views[2].lamps[3].projected_m.x() += 9e-7;
  found = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->outliers_m, testing::ElementsAre(testing::Key(5)));
}

/// Residuals are linear in an error of a projection: those of any error follow from two solutions.
TEST_F(EstimateLampDisplacementsEquations, OutlierLimitIsSixSigmasOfRobustScatter) {
  add_noise(1e-4, 6);
  auto& outlier_m = views[3].lamps[4].projected_m;
  const Eigen::Vector2d start_m = outlier_m, direction(0.6, -0.8);
  const auto before = estimate_lamp_displacements(map, views);
  outlier_m = start_m + 1e-4 * direction;
  const auto after = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(before && after);
  ASSERT_TRUE(before->outliers_m.empty() && after->outliers_m.empty());
  // Returns the largest residual over its limit, for an error of the projection.
  const auto predict_ratio = [&](double error_m) {
    std::vector<double> squares_m2;
    for (std::size_t c = 0; c < views.size(); ++c) {
      const Eigen::VectorXd residuals_m =
          before->residuals_m[c] +
          error_m / 1e-4 * (after->residuals_m[c] - before->residuals_m[c]);
      for (Eigen::Index row = 0; row < residuals_m.size(); row += 2) {
        squares_m2.push_back(residuals_m.segment<2>(row).squaredNorm());
      }
    }
    const double largest_m2 = *std::max_element(squares_m2.begin(), squares_m2.end());
    return std::sqrt(largest_m2 /
                     (estimate_robust_variance_2d(squares_m2, before->degrees_of_freedom) *
                      compute_squared_outlier_bound_2d(6, before->degrees_of_freedom)));
  };
  for (const double fraction : {0.97, 1.03}) {
    double low_m = 1e-4, high_m = 1e-2;
    ASSERT_LT(predict_ratio(low_m), fraction);
    ASSERT_GT(predict_ratio(high_m), fraction);
    for (int iteration = 0; iteration < 50; ++iteration) {
      const double middle_m = (low_m + high_m) / 2;
      (predict_ratio(middle_m) < fraction ? low_m : high_m) = middle_m;
    }
    outlier_m = start_m + low_m * direction;
    const auto found = estimate_lamp_displacements(map, views);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->outliers_m.size(), fraction > 1 ? 1U : 0U) << fraction;
  }
}

TEST_F(EstimateLampDisplacementsEquations, OffsetSdsAreThoseOfDisplacementsOverTheirFraction) {
  add_noise(1e-4, 7);
  const auto found = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(found);
  const auto offsets = compute_lamp_offsets_relative_to_others(*found);
  ASSERT_EQ(offsets.size(), 7U);
  Eigen::Vector2d mean_m(0, 0);
  double squares_m2 = 0;
  for (int lamp = 1; lamp <= 7; ++lamp) mean_m += map_m(lamp) / 7;
  for (int lamp = 1; lamp <= 7; ++lamp) squares_m2 += (map_m(lamp) - mean_m).squaredNorm();
  for (std::size_t i = 0; i < 7; ++i) {
    const LampOffset& offset = offsets[i];
    EXPECT_EQ(offset.lamp, found->lamps[i]);
    EXPECT_EQ(offset.captures, found->captures[i]);
    EXPECT_EQ(offset.map_m, found->map_m[i]);
    const double own = 1 - 1.0 / 7 - (offset.map_m - mean_m).squaredNorm() / squares_m2;
    const Eigen::Vector2d variances =
        found->covariance_m2.diagonal().segment<2>(2 * static_cast<Eigen::Index>(i));
    EXPECT_THAT(offset.sd_m, IsNear(variances.cwiseSqrt() / own, 1e-12));
    EXPECT_GT(offset.sd_m.minCoeff(), 1e-6);
  }
}

/// Two lamps at a distance of 2 mm do not determine the position of a third one 1 m away.
TEST_F(EstimateLampDisplacementsEquations, OffsetOfLampFarFromCloseLampsIsOmitted) {
  map = make_lamp_map({{0, 0, 1.6}, {0.002, 0, 1.6}, {1, 0.2, 1.6}});
  views.clear();
  for (int c = 0; c < 4; ++c) {
    CeilingView view{{0.3 * c, 0.1 * c}, {}, 0};
    for (const Lamp& lamp : map.lamps) {
      view.lamps.push_back({lamp.id, lamp.position_m.head<2>(), 1.6});
    }
    views.push_back(view);
  }
  const auto found = estimate_lamp_displacements(map, views);
  ASSERT_TRUE(found);
  std::vector<int> lamps;
  for (const auto& offset : compute_lamp_offsets_relative_to_others(*found)) {
    lamps.push_back(offset.lamp);
  }
  EXPECT_THAT(lamps, ElementsAre(1, 2));
}

/// The other lamps are mapped to the map by a similarity.
TEST(ComputeLampOffsetRelativeToOthers, SubtractsSimilarityOfLampsThatAreNotExcluded) {
  LampDisplacements found;
  found.lamps = {1, 2, 3, 4, 5};
  found.map_m = {{0, 0}, {1, 0.1}, {1.2, 1}, {-0.1, 0.8}, {0.5, 0.4}};
  found.captures = {2, 2, 2, 2, 2};
  found.displacement_m.resize(10);
  const Eigen::Vector2d factor(0.9, 0.1), offset_m(0.02, -0.03);
  // Displaced lamps are the similarity of the true ones: all but lamps 2 and 5 are at the map.
  std::vector<Eigen::Vector2d> moved_m(5, Eigen::Vector2d(0, 0));
  moved_m[1] = {0.03, -0.01};
  moved_m[4] = {-0.02, 0.05};
  for (std::size_t i = 0; i < 5; ++i) {
    found.displacement_m.segment<2>(2 * static_cast<Eigen::Index>(i)) =
        offset_m + complex_product(factor, found.map_m[i] + moved_m[i]) - found.map_m[i];
  }
  const auto second = compute_lamp_offset_relative_to_others(found, 1, {1, 4});
  ASSERT_TRUE(second);
  EXPECT_THAT(*second, IsNear(moved_m[1], 1e-14));
  const auto fifth = compute_lamp_offset_relative_to_others(found, 4, {4, 1});
  ASSERT_TRUE(fifth);
  EXPECT_THAT(*fifth, IsNear(moved_m[4], 1e-14));
  const auto first = compute_lamp_offset_relative_to_others(found, 0, {1, 4});
  ASSERT_TRUE(first);
  EXPECT_THAT(*first, IsNear(Eigen::Vector2d(0, 0), 1e-14));
  EXPECT_TRUE(compute_lamp_offset_relative_to_others(found, 0, {0, 1, 2}));
  EXPECT_FALSE(compute_lamp_offset_relative_to_others(found, 0, {0, 1, 2, 3}));
}

}  // namespace
}  // namespace vlp
