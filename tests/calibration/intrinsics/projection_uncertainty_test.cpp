// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/intrinsics/projection_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "calibration/intrinsics/calibration_report.h"
#include "calibration/intrinsics/mrcal_files.h"
#include "calibration/intrinsics/projection_difference.h"
#include "calibration/intrinsics/spline_fit.h"
#include "calibration/intrinsics/synthetic_views.h"
#include "calibration/intrinsics/valid_region.h"
#include "calibration/intrinsics/view_jackknife.h"
#include "camera/spline_grid.h"
#include "geometry/polygon.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(ProjectionUncertainty, MaxProjectionSdIsLargerForFrontalThanForTiltedViews) {
  SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  const auto tilted = solve_intrinsics(views.input(12, random, 0.1));
  views.tilt_rad = 0.12;
  const auto frontal = solve_intrinsics(views.input(12, random, 0.1));
  ASSERT_TRUE(tilted.has_succeeded());
  ASSERT_TRUE(frontal.has_succeeded());
  const Eigen::Vector2d place(700, 80);
  EXPECT_GT(ProjectionUncertainty(frontal).worst_direction_sd_px(place),
            5 * ProjectionUncertainty(tilted).worst_direction_sd_px(place));
}

TEST(ProjectionUncertainty, IntrinsicsRegularizationBiasMatchesNegativeFocalLengthError) {
  // 110 degrees: the coefficients are far from zero, and the corner noise is a fiftieth of that for
  // which mrcal scales the regularization.
  const std::array wide{416.7,  416.9,  398.2,     302.1,   0.733348, 0.0897113,
                        0.0001, 0.0002, 0.0009234, 1.06639, 0.246743, 0.00924612};
  const SyntheticViews views{synthetic_board(false), Lens(LensModel::opencv8, wide)};
  Random random(3);
  const auto solution = solve_intrinsics(views.input(30, random, 0.02));
  ASSERT_TRUE(solution.has_succeeded());
  const ProjectionUncertainty uncertainty(solution);
  const Eigen::VectorXd& pull = uncertainty.regularization_bias();
  const double focal_off_px = solution.problem.intrinsics[0] - wide[0];
  const double noise_px = std::sqrt(uncertainty.intrinsics_covariance()(0, 0));
  EXPECT_GT(std::abs(focal_off_px), 5 * noise_px);
  EXPECT_NEAR(focal_off_px, -pull[0], 0.4 * std::abs(focal_off_px));
}

TEST(ProjectionUncertainty, IntrinsicsRegularizationBiasIsZeroForFisheye) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(3);
  IntrinsicsInput input = views.input(12, random, 0.1);
  input.lens_model = LensModel::fisheye;
  const auto solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  EXPECT_EQ(ProjectionUncertainty(solution).regularization_bias(), Eigen::VectorXd::Zero(8));
}

TEST(ProjectionUncertainty, MaxProjectionSdMatchesMrcalForIndependentCorners) {
  if (run_program("/usr/bin/python3 -c 'import mrcal'").exit_code != 0) {
    GTEST_SKIP() << "mrcal for Python is not installed";
  }
  const TemporaryFolder folder;
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    Random random(8);
    const auto solution = solve_intrinsics(views.input(20, random, 0.05));
    ASSERT_TRUE(solution.has_succeeded());
    write_cameramodel(folder / "camera.cameramodel", solution, {});
    const auto mrcals =
        run_program("/usr/bin/python3 -c \"import mrcal, numpy as np; m = mrcal.cameramodel('" +
                    (folder / "camera.cameramodel").string() +
                    "'); print(mrcal.projection_uncertainty(mrcal.unproject(np.array((790, 10), "
                    "float), *m.intrinsics()), m, atinfinity = True, "
                    "what = 'worstdirection-stdev'))\"");
    ASSERT_EQ(mrcals.exit_code, 0) << mrcals.errors;
    const double ours = ProjectionUncertainty(solution).worst_direction_sd_px({790, 10});
    EXPECT_NEAR(std::stod(mrcals.output), ours, 1e-6 * ours);
  }
}

TEST(ProjectionUncertainty, SdByTagsMatchesSdByCornersForIndependentErrors) {
  for (const bool kalibr : {false, true}) {
    const SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    Random random(4);
    const IntrinsicsInput input = views.input(30, random, 0.1);
    const auto solution = solve_intrinsics(input);
    ASSERT_TRUE(solution.has_succeeded());
    const ProjectionUncertainty by_corners(solution), by_tags(solution, input.lattice);
    for (const Eigen::Vector2d& pixel : {Eigen::Vector2d(400, 300), Eigen::Vector2d(40, 80)}) {
      EXPECT_NEAR(by_tags.worst_direction_sd_px(pixel) / by_corners.worst_direction_sd_px(pixel), 1,
                  0.2);
    }
  }
}

TEST(MakeLensReport, DifferenceOfHalvesMatchesTwiceExpectedRms) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(5);
  const IntrinsicsInput input = views.input(24, random, 0.1);
  const IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  const CalibrationReport report = make_lens_report(solution, input);
  ASSERT_TRUE(report.split_half_difference);
  // Twice the difference from the truth, within a factor for the few degrees of freedom.
  EXPECT_LT(report.split_half_difference->rms_px, 2.5 * 2 * report.expected_rms_px);
  EXPECT_GT(report.split_half_difference->rms_px, 0.3 * 2 * report.expected_rms_px);
}

TEST(FitHeldOutViews, RmsOfHeldOutViewsMatchesCornerNoise) {
  SyntheticViews views{synthetic_board(true), synthetic_lens()};
  views.warp_m = {0.0006, 0.0004};
  Random random(6);
  const IntrinsicsSolution solution = solve_intrinsics(views.input(20, random, 0.05));
  ASSERT_TRUE(solution.has_succeeded());
  const HeldOutFit held_out = fit_held_out_views(solution, views.input(6, random, 0.05));
  EXPECT_EQ(held_out.views, 6);
  EXPECT_NEAR(held_out.rms_px, 0.05, 0.006);
}

TEST(MeasureViewCoverage, TiltCountsOnlyForSideNearerToCamera) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(9);
  const IntrinsicsInput input = views.input(12, random, 0);
  IntrinsicsSolution solution = solve_intrinsics(input);
  ASSERT_TRUE(solution.has_succeeded());
  solution.problem.poses.resize(1);
  solution.problem.poses[0].rotation = {0, 0.3, 0};  // its right comes nearer
  const auto [left, right, upper, lower] = measure_view_coverage(solution, input).tilts_rad;
  EXPECT_EQ(left, 0);
  EXPECT_NEAR(right, 0.3, 1e-9);
  EXPECT_NEAR(upper, 0, 1e-9);
  EXPECT_NEAR(lower, 0, 1e-9);
}

/// Returns a solution with known lens and poses, without a solve: its points have noise, some are
/// not in the image, and one is an outlier.
IntrinsicsSolution make_known_solution(const SyntheticViews& views, int count, double noise_px,
                                       std::uint64_t seed) {
  Random random(seed);
  const BoardLattice lattice(views.board);
  const Eigen::Vector2d field_m = compute_tag_field_size_m(views.board);
  IntrinsicsSolution solution{};
  solution.status = IntrinsicsStatus::ok;
  BoardProblem& problem = solution.problem;
  problem.lens_model = views.lens.lens_model();
  problem.imager_px = views.imager_px;
  problem.cols = lattice.lattice_cols();
  problem.rows = lattice.lattice_rows();
  problem.spacing_m = lattice.point_spacing_m();
  for (int view = 0; view < count; ++view) {
    solution.views.push_back(static_cast<std::size_t>(view));
    solution.edge_displacements_px.push_back(0);
    const double azimuth = 2 + 1.3 * view, tilt = 0.5 + 0.1 * (view % 3);
    const Eigen::AngleAxisd rotation(
        Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0)) *
        Eigen::AngleAxisd(0.9 * view, Eigen::Vector3d::UnitZ()));
    const double x = random.uniform(-0.2, 0.2), y = random.uniform(-0.15, 0.15);
    const Eigen::Vector3d middle_m = Eigen::Vector3d(x, y, 1) * (1.2 * field_m.x());
    const Eigen::Vector3d half_m(field_m.x() / 2, field_m.y() / 2, 0);
    const BoardPose board{rotation.angle() * rotation.axis(), middle_m - rotation * half_m};
    for (std::size_t part = 0; part < lattice.num_board_parts(); ++part) {
      const BoardPose& pose = problem.poses.emplace_back(lattice.compute_part_pose(board, part));
      for (int row = 0; row < problem.rows; ++row) {
        for (int col = 0; col < problem.cols; ++col) {
          const Eigen::Vector3d in_board_m(col * problem.spacing_m, row * problem.spacing_m, 0);
          const auto pixel = views.lens.project_point(rotation * in_board_m + pose.translation_m);
          const double v = random.normal(), u = random.normal();
          const bool is_seen = pixel && pixel->minCoeff() > 0 && pixel->x() < views.imager_px[0] &&
                               pixel->y() < views.imager_px[1];
          const Eigen::Vector2d measured =
              is_seen ? Eigen::Vector2d(*pixel + noise_px * Eigen::Vector2d(u + 0.3, v))
                      : Eigen::Vector2d(0, 0);
          const double weight = col % 3 == 1 ? 0.7 : 1;
          problem.points.emplace_back(measured.x(), measured.y(),
                                      is_seen ? weight : BoardProblem::kUnseen);
        }
      }
    }
  }
  problem.points[problem.points.size() / 2 + 5].z() = -1;
  return solution;
}

const std::array kUncertainLens{520.0, 525.0, 402.0, 291.0, -0.15, 0.05, 0.0002, -0.0001};

IntrinsicsSolution make_known_solution_of_board(bool kalibr, int count = 4, double noise_px = 0.2) {
  const Lens lens(LensModel::opencv4, kUncertainLens);
  IntrinsicsSolution solution =
      make_known_solution({synthetic_board(kalibr), lens}, count, noise_px, 12);
  solution.problem.intrinsics.assign(kUncertainLens.begin(), kUncertainLens.end());
  return solution;
}

TEST(ProjectionUncertainty, IsInfiniteWhenViewHasNoCorners) {
  IntrinsicsSolution solution = make_known_solution_of_board(false, 3);
  for (std::size_t i = 0; i < solution.problem.points_per_board(); ++i) {
    solution.problem.points[i].z() = BoardProblem::kUnseen;
  }
  const ProjectionUncertainty uncertainty(solution);
  EXPECT_FALSE(uncertainty.is_determined());
  EXPECT_TRUE(std::isinf(uncertainty.focal_x_sd_px()));
  EXPECT_TRUE(std::isinf(uncertainty.worst_direction_sd_px({400, 300})));
  EXPECT_TRUE(std::isinf(uncertainty.projection_covariance({400, 300})(0, 0)));
  const Eigen::MatrixXd covariance = uncertainty.intrinsics_covariance();
  ASSERT_EQ(covariance.rows(), 8);
  ASSERT_EQ(covariance.cols(), 8);
  EXPECT_TRUE(std::isinf(covariance.minCoeff()));
  EXPECT_EQ(uncertainty.regularization_bias(), Eigen::VectorXd::Zero(8));
}

/// Returns a solution of boards with these rotations, one board per view.
IntrinsicsSolution make_solution_with_rotations(const std::vector<Eigen::Vector3d>& rotations) {
  IntrinsicsSolution solution{};
  for (const Eigen::Vector3d& rotation : rotations) {
    solution.problem.poses.push_back({rotation, {0, 0, 1}});
  }
  return solution;
}

TEST(MeasureViewCoverage, CountsCornersOfSolvedViewsInParts) {
  IntrinsicsInput input{BoardLattice(synthetic_board(false)), {}, {900, 600}, LensModel::pinhole};
  const auto add_view = [&](const std::vector<Eigen::Vector2d>& pixels) {
    auto& view = input.views.emplace_back();
    for (const auto& pixel : pixels) view.emplace_back().pixel = pixel;
  };
  add_view({{10, 10}, {450, 10}, {450, 20}, {890, 10}});
  add_view({{450, 300}, {460, 310}, {440, 290}});  // not in the solution
  add_view({{299, 300}, {301, 590}, {890, 201}, {899, 399}, {890, 401}});
  IntrinsicsSolution solution = make_solution_with_rotations({});
  solution.views = {0, 2};
  const ViewCoverage coverage = measure_view_coverage(solution, input);
  EXPECT_EQ(coverage.corners, (std::array<int, 9>{1, 2, 1, 1, 0, 2, 0, 1, 1}));
  // Eight corners are in parts of 112.5 x 100 px of their own, two in one.
  EXPECT_NEAR(coverage.covered_fraction, 8.0 / 48, 1e-12);
  EXPECT_EQ(coverage.tilt_rad, 0);
}

TEST(MeasureViewCoverage, ReturnsLargestTiltTowardsEachSideAndBetweenBoards) {
  const IntrinsicsInput input{
      BoardLattice(synthetic_board(false)), {}, {900, 600}, LensModel::pinhole};
  // A positive rotation about y brings the right side nearer, about x the upper side.
  const ViewCoverage coverage = measure_view_coverage(make_solution_with_rotations({{0, 0.1, 0},
                                                                                    {0, 0.4, 0},
                                                                                    {0, 0.2, 0},
                                                                                    {0, -0.3, 0},
                                                                                    {0, -0.05, 0},
                                                                                    {0.5, 0, 0},
                                                                                    {0.15, 0, 0},
                                                                                    {-0.25, 0, 0},
                                                                                    {0, 0, 1}}),
                                                      input);
  EXPECT_NEAR(coverage.tilts_rad[0], 0.3, 1e-12);
  EXPECT_NEAR(coverage.tilts_rad[1], 0.4, 1e-12);
  EXPECT_NEAR(coverage.tilts_rad[2], 0.5, 1e-12);
  EXPECT_NEAR(coverage.tilts_rad[3], 0.25, 1e-12);
  EXPECT_NEAR(coverage.tilt_rad, std::max(0.75, 0.7), 1e-12) << "from 0.5 to -0.25 about x";
}

TEST(RecommendNextView, NamesEachPartAndSide) {
  const std::array<std::string, 9> places{"top left",    "top middle",    "top right",
                                          "left middle", "middle",        "right middle",
                                          "bottom left", "bottom middle", "bottom right"};
  const std::array<std::string, 4> sides{"left", "right", "upper", "lower"};
  for (std::size_t i = 0; i < 9; ++i) {
    ViewCoverage coverage;
    coverage.corners.fill(9);
    coverage.corners[i] = 2;
    coverage.tilts_rad.fill(0.4);
    coverage.tilts_rad[i % 4] = 0.3;
    EXPECT_EQ(recommend_next_view(coverage), "the board in the " + places[i] +
                                                 " of the image, its " + sides[i % 4] +
                                                 " side 30 to 40 degrees nearer to the camera");
  }
}

TEST(FitHeldOutViews, WeightsViewsByCornersAndSkipsViewsWithoutPose) {
  const SyntheticViews views{synthetic_board(false), synthetic_lens()};
  Random random(6);
  IntrinsicsSolution solution{};
  solution.problem.lens_model = LensModel::opencv8;
  solution.problem.intrinsics = {520.0,  521.0,   402.0,  297.0, -0.25, 0.08,
                                 0.0002, -0.0001, -0.012, 0.01,  0.002, 0.0001};
  IntrinsicsInput held_out = views.input(1, random, 0.05);
  held_out.views.push_back(views.input(1, random, 0.4).views[0]);
  held_out.views[1].resize(32);
  held_out.views.push_back(held_out.views[0]);
  held_out.views[2].resize(2);
  const auto rms_px = compute_held_out_rms_px(solution, held_out);
  ASSERT_EQ(rms_px.size(), 3U);
  EXPECT_NEAR(rms_px[0], 0.05, 0.015);
  EXPECT_NEAR(rms_px[1], 0.4, 0.12);
  EXPECT_TRUE(std::isinf(rms_px[2]));
  const HeldOutFit fit = fit_held_out_views(solution, held_out);
  const auto first = static_cast<double>(held_out.views[0].size());
  EXPECT_EQ(fit.views, 2);
  EXPECT_EQ(fit.corners, static_cast<int>(first) + 32);
  const double squares = rms_px[0] * rms_px[0] * first + rms_px[1] * rms_px[1] * 32;
  EXPECT_NEAR(fit.rms_px, std::sqrt(squares / (first + 32)), 1e-12);

  held_out.views.erase(held_out.views.begin(), held_out.views.begin() + 2);
  const HeldOutFit none = fit_held_out_views(solution, held_out);
  EXPECT_EQ(none.views, 0);
  EXPECT_EQ(none.corners, 0);
  EXPECT_EQ(none.rms_px, 0);
}

/// The shift of the edges, the warp of the board and the curvature of the edges are modeled, so
/// that exact corners have no residuals.
TEST(ComputeHeldOutRms, VanishesForShiftedEdgesOfWarpedBoard) {
  for (const bool kalibr : {false, true}) {
    SyntheticViews views{synthetic_board(kalibr), synthetic_lens()};
    views.warp_m = {0.002, -0.0015};
    IntrinsicsInput held_out{BoardLattice(views.board), {}, views.imager_px, LensModel::opencv8};
    Random random(8);
    for (int i = 0; i < 2; ++i) {
      BoardDetection seen = views.random_view(random, 0);
      // Edges between touching squares do not move corners.
      if (!kalibr) {
        for (TagDetection& tag : seen.tags) tag = shrunk(tag, 0.6);
      }
      held_out.views.push_back(held_out.lattice.list_corners(seen));
    }
    IntrinsicsSolution solution{};
    solution.problem.lens_model = LensModel::opencv8;
    solution.problem.intrinsics = {520.0,  521.0,   402.0,  297.0, -0.25, 0.08,
                                   0.0002, -0.0001, -0.012, 0.01,  0.002, 0.0001};
    const Eigen::Vector2d ratio = held_out.lattice.board_to_part_warp_ratio();
    solution.problem.warp_m = views.warp_m.cwiseQuotient(ratio);
    for (const double rms_px : compute_held_out_rms_px(solution, held_out)) {
      EXPECT_LT(rms_px, 0.02);
    }
    solution.problem.warp_m.setZero();
    for (const double rms_px : compute_held_out_rms_px(solution, held_out)) {
      EXPECT_GT(rms_px, 0.1);
    }
  }
}

void expect_report_matches_definitions(const IntrinsicsSolution& solution,
                                       const IntrinsicsInput& input) {
  const CalibrationReport report = make_lens_report(solution, input);
  const ProjectionUncertainty by_tags(solution, input.lattice), by_corners(solution);
  const Lens lens = solution.fitted_lens();
  const Eigen::MatrixXd by_views = jackknife_covariance(solution);
  const ImageRegion region =
      make_valid_region(list_inlier_pixels(solution.problem), input.imager_px, lens);
  EXPECT_EQ(report.region, region);
  EXPECT_EQ(report.region_fraction, compute_area_fraction(region, input.imager_px));
  ASSERT_LT(report.region_fraction, 0.95);
  EXPECT_EQ(report.focal_sd_px, by_tags.focal_x_sd_px());
  EXPECT_EQ(report.focal_sd_by_views_px, std::sqrt(by_views(0, 0)));
  const bool is_splined = is_splined_lens_model(lens.lens_model());
  const ImageRegion compared = is_splined ? region : ImageRegion();
  const auto expected_rms_px = [&](const Eigen::MatrixXd& covariance) {
    return predict_difference(lens, input.imager_px, covariance, compared).rms_px;
  };
  EXPECT_EQ(report.expected_rms_px, expected_rms_px(by_tags.intrinsics_covariance()));
  EXPECT_EQ(report.expected_by_views_rms_px, expected_rms_px(by_views));

  double sum = 0, count = 0, worst = 0, beyond = 0;
  for (const auto& pixel : make_pixel_grid(input.imager_px)) {
    if (!lens.unproject_pixel(pixel)) continue;
    const double sd = by_tags.worst_direction_sd_px(pixel);
    if (polygon_contains(region, pixel)) {
      sum += sd;
      count += 1;
      worst = std::max(worst, sd);
    } else {
      beyond = std::max(beyond, sd);
    }
  }
  EXPECT_NEAR(report.uncertainty_mean_px, sum / count, 1e-12);
  EXPECT_TRUE(std::isfinite(beyond));
  EXPECT_NEAR(report.uncertainty_beyond_px, beyond, 1e-9);
  for (const Eigen::MatrixXd& covariance :
       {by_tags.intrinsics_covariance(), by_corners.intrinsics_covariance(), by_views}) {
    if (is_splined || !covariance.allFinite()) continue;
    worst = std::max(worst, predict_max_difference_px(lens, input.imager_px, covariance, region));
  }
  EXPECT_NEAR(report.uncertainty_worst_px, worst, 1e-12);

  const IntrinsicsSolution even_views = solve_half_of_views(solution, 0);
  const IntrinsicsSolution odd_views = solve_half_of_views(solution, 1);
  ASSERT_EQ(report.split_half_difference.has_value(),
            even_views.has_succeeded() && odd_views.has_succeeded());
  if (!report.split_half_difference) return;
  // Pixels of splined lenses are compared if the sd is less than three times as large by halves.
  std::vector<ProjectionUncertainty> of_halves;
  if (is_splined) of_halves = {{even_views, input.lattice}, {odd_views, input.lattice}};
  int num_undetermined = 0;
  const auto halves =
      compare_projections(even_views.fitted_lens(), odd_views.fitted_lens(), input.imager_px,
                          [&](const Eigen::Vector2d& pixel) {
                            const double sd_px = by_tags.worst_direction_sd_px(pixel);
                            bool is_compared = polygon_contains(region, pixel);
                            for (const ProjectionUncertainty& half : of_halves) {
                              if (!is_compared) break;
                              is_compared = half.worst_direction_sd_px(pixel) / sd_px <= 3;
                              if (!is_compared) ++num_undetermined;
                            }
                            return is_compared ? sd_px : std::numeric_limits<double>::infinity();
                          });
  EXPECT_EQ(num_undetermined > 0, is_splined);
  ASSERT_TRUE(halves);
  EXPECT_NEAR(report.split_half_difference->mean_px, halves->mean_px, 1e-9);
  EXPECT_NEAR(report.split_half_difference->worst_px, halves->worst_px, 1e-9);
  EXPECT_NEAR(report.split_half_difference->rms_px, halves->rms_px, 1e-9);
}

TEST(MakeLensReport, FieldsMatchTheirDefinitions) {
  expect_report_matches_definitions(
      make_known_solution_of_board(false, 8),
      {BoardLattice(synthetic_board(false)), {}, {800, 600}, LensModel::opencv4});
}

TEST(MakeLensReport, HasNoSplitHalfDifferenceIfHalfHasTwoViews) {
  const IntrinsicsInput input{
      BoardLattice(synthetic_board(false)), {}, {800, 600}, LensModel::opencv4};
  const IntrinsicsSolution solution = make_known_solution_of_board(false, 5);
  ASSERT_TRUE(solve_half_of_views(solution, 0).has_succeeded());
  EXPECT_FALSE(make_lens_report(solution, input).split_half_difference);
}

TEST(MakeLensReport, ComparesSplinedLensInItsRegionOnly) {
  const LensModel model = splined_lens_model({3, 9, 8, 95});
  std::vector<double> core{500, 500, 400, 300};
  const auto parameters =
      fit_splined_lens(Lens(LensModel::opencv4, kUncertainLens), {800, 600}, model, core);
  ASSERT_TRUE(parameters);
  IntrinsicsSolution solution =
      make_known_solution({synthetic_board(false), Lens(model, *parameters)}, 8, 0.1, 12);
  solution.problem.intrinsics = *parameters;
  solution.problem.noise_px = 0.1;
  solution.solved_parameters.core = false;
  expect_report_matches_definitions(solution,
                                    {BoardLattice(synthetic_board(false)), {}, {800, 600}, model});
}

}  // namespace
}  // namespace vlp
