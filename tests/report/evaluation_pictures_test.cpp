// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/evaluation_pictures.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::HasSubstr;

FixRow fix(const std::string& image, double x_m, double y_m) {
  return {image, "ok", FixRow::Fix{{{x_m, y_m, 0}, 0}, {}, 0.1}, 3};
}

/// Errors of 1, 2 and 3 mm, and an image without a fix.
EvaluationInput input() {
  EvaluationInput input;
  input.fixes = {"fixes.csv", {fix("a", 0.001, 0), fix("b", 0.5, 0.002), fix("c", 1.003, 0)}};
  return input;
}

TEST(MakeErrorPlots, ContainsFloorPlanAndDistributionForErrorsAgainstTruth) {
  EvaluationInput with_truth = input();
  with_truth.truth = {"truth.csv",
                      {{"a", {0, 0}, {}, {}, 2},
                       {"b", {0.5, 0}, {}, {}, 3},
                       {"c", {1, 0}, {}, {}, 4},
                       {"d", {0, 1}, {}, {}, 5}}};
  const auto pictures = make_error_plots(with_truth, evaluate_fixes(with_truth), {});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].part, ReportPart::floor);
  EXPECT_THAT(pictures[0].drawing.value().commands, HasSubstr("no fix: 1"));
  EXPECT_EQ(pictures[1].part, ReportPart::distribution);
  EXPECT_THAT(pictures[1].alt, HasSubstr("The median error is 2 mm"));
}

/// Room of four lamps surveyed to 2 mm; its camera is tilted and has a zenith covariance.
struct StatedRoom {
  LampMap lamps;
  Calibration calibration{
      {"", {800, 600}, LensModel::pinhole, {500, 500, 399.5, 299.5}, {}, {}, {}},
      {},
      RotationCenter{RotationModel::tilt, {404.5, 299.5}, Eigen::Vector3d(0.01, 0, 1).normalized()},
      {},
      {},
      {},
      JointCovariance{{}, {"zenith_x", "zenith_y"}, 4e-8 * Matrix2::Identity()}};

  StatedRoom() {
    int id = 0;
    for (const double x_m : {-0.5, 0.5}) {
      for (const double y_m : {-0.4, 0.4}) {
        lamps.lamps.push_back({++id, {x_m, y_m, 1.6}, {}, {}, {}});
        lamps.lamps.back().sd_m = 0.002;
      }
    }
  }

  std::vector<FixRow> fixes() const {
    std::vector<FixRow> rows{fix("a", 0, 0), fix("b", 0.1, 0.05), fix("c", 0, 0)};
    for (FixRow& row : rows) {
      row.fix->noise_sd = Eigen::Vector4d(3e-4, 3e-4, 1e-3, 1e-3);
      row.fix->sd = Eigen::Vector4d(1e-3, 1e-3, 2e-3, 2e-3);
    }
    rows[2].fix->noise_sd.reset();  // it does not count
    return rows;
  }
};

TEST(MakeBudgetPlot, StatesFractionOfVarianceForEachSource) {
  const StatedRoom room;
  const auto picture = make_budget_plot(room.fixes(), room.lamps, room.calibration);
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->part, ReportPart::distribution);
  // 0.18 of the 2 mm^2 are noise.
  EXPECT_THAT(picture->drawing.value().commands, HasSubstr("noise, 9 %"));
  EXPECT_THAT(picture->drawing.value().commands, HasSubstr("lamp map, "));
  EXPECT_THAT(picture->drawing.value().commands, testing::Not(HasSubstr("offset, ")));
  EXPECT_THAT(picture->alt, HasSubstr("noise 9 %, lens 0 %, zenith "));
}

/// The uncertainty of a fix with estimated roll and pitch cannot be divided like that of a level
/// camera.
TEST(MakeBudgetPlot, OmitsFixesWithEstimatedRollPitch) {
  const StatedRoom room;
  auto fixes = room.fixes();
  fixes[1].fix->sd = Eigen::Vector4d(1e-2, 1e-2, 2e-2, 2e-3);
  fixes[1].fix->inclination = Inclination{0.1, 0};
  const auto picture = make_budget_plot(fixes, room.lamps, room.calibration);
  ASSERT_TRUE(picture);
  EXPECT_THAT(picture->drawing.value().commands, HasSubstr("noise, 9 %"));
  EXPECT_THAT(picture->caption, HasSubstr("for a level camera"));
  fixes[0].fix->inclination = Inclination{0, 0};
  EXPECT_FALSE(make_budget_plot(fixes, room.lamps, room.calibration));
}

TEST(MakeBudgetPlot, ReturnsNulloptWithoutMapNoiseSdsOrKnownCommonErrors) {
  StatedRoom room;
  EXPECT_FALSE(make_budget_plot(room.fixes(), {}, room.calibration));
  auto fixes = room.fixes();
  for (FixRow& row : fixes) row.fix->noise_sd.reset();
  EXPECT_FALSE(make_budget_plot(fixes, room.lamps, room.calibration));
  for (Lamp& lamp : room.lamps.lamps) lamp.sd_m.reset();
  room.calibration.covariance.reset();
  EXPECT_FALSE(make_budget_plot(room.fixes(), room.lamps, room.calibration));
}

/// A rejected lamp does not contribute to the uncertainty of the fix.
TEST(MakeBudgetPlot, ExcludesErrorsOfLampsRejectedByFix) {
  StatedRoom room;
  room.lamps.lamps[0].sd_m = 0.1;
  auto fixes = room.fixes();
  EXPECT_THAT(make_budget_plot(fixes, room.lamps, room.calibration).value().alt,
              HasSubstr("zenith 0 %"));
  for (FixRow& row : fixes) row.rejected_lamps = {1};
  EXPECT_THAT(make_budget_plot(fixes, room.lamps, room.calibration).value().alt,
              testing::Not(HasSubstr("zenith 0 %")));
}

TEST(MakeErrorPlots, BeginsWithTrackPlotForCommandedLine) {
  EvaluationInput with_line = input();
  with_line.line_m = {Eigen::Vector2d{0, 0}, Eigen::Vector2d{1, 0}};
  const auto pictures = make_error_plots(with_line, evaluate_fixes(with_line), {});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].part, ReportPart::tracks);
  EXPECT_THAT(pictures[0].caption, HasSubstr("Drive. Above"));
}

}  // namespace
}  // namespace vlp
