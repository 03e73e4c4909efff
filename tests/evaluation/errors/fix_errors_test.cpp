// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/fix_errors.h"

#include <gmock/gmock.h>

#include "fix_at.h"
#include "support/matchers.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(CompareWithTruth, PairsFixesAndTruthByImageName) {
  const FileRows<FixRow> fixes{
      "fixes.csv",
      {fix_at("b", 1.003, 2.004, 0.5, 3.1), no_fix("c", "degenerate"), fix_at("a", 0, 0, 0.1)}};
  const FileRows<TruthRow> truth{
      "truth.csv",
      {{"a", {0, 0}, 0, 0}, {"b", {1, 2}, 0.4, -3.1}, {"c", {0, 0}, 0, 0}, {"d", {0, 0}, 0, 0}}};
  const FixErrors errors = compare_with_truth(fixes, truth, 1e-3);
  EXPECT_EQ(errors.captures, 4);
  EXPECT_EQ(errors.failures_by_status,
            (std::map<std::string, std::size_t>{{"degenerate", 1}, {"no row", 1}}));
  ASSERT_EQ(errors.errors.size(), 2);
  EXPECT_THAT(errors.errors[0].horizontal_m, IsNear(Eigen::Vector2d(0.003, 0.004), 1e-12));
  EXPECT_NEAR(errors.errors[0].height_m.value(), 0.1, 1e-12);
  EXPECT_NEAR(errors.errors[0].yaw_rad.value(), 6.2 - 2 * 3.14159265358979, 1e-12);
  EXPECT_EQ(errors.errors[0].cluster, 1);
  EXPECT_EQ(errors.errors[1].cluster, 0);
}

TEST(CompareWithTruth, ThrowsForFixesOfImagesMissingInTruth) {
  FileRows<FixRow> fixes{"fixes.csv", {fix_at("a", 0, 0), fix_at("x", 0, 0), fix_at("y", 0, 0)}};
  fixes.rows[1].line = 17;
  const FileRows<TruthRow> truth{"truth.csv", {{"a", {0, 0}, {}, {}}}};
  const std::string refusal = rejection_message([&] { compare_with_truth(fixes, truth, 1e-3); });
  EXPECT_THAT(refusal, HasSubstr("fixes.csv:17: image: 'x' is not in truth.csv"));
  EXPECT_THAT(refusal, HasSubstr("2 of 3"));
}

TEST(CompareWithTruth, NamesColumnAndUnitThatAgreeWithFixes) {
  const FileRows<FixRow> fixes{
      "fixes.csv",
      {fix_at("a", 1, 2, 1.5, 1), fix_at("b", -2, 1, 1.4, -0.5), fix_at("c", 3, -1, 1.6, 0.8)}};
  const auto refusal = [&](double units_per_m, double units_per_z_m, double units_per_rad) {
    FileRows<TruthRow> truth{"truth.csv", {}};
    for (const FixRow& row : fixes.rows) {
      const Pose& pose = row.fix->pose;
      truth.rows.push_back({row.image, units_per_m * (pose.position_m.head<2>().array() + 0.01),
                            units_per_z_m * (pose.position_m.z() + 0.01),
                            units_per_rad * (pose.yaw_rad + 0.01), 2});
    }
    return rejection_message([&] { compare_with_truth(fixes, truth, 1e-3); });
  };
  EXPECT_EQ(refusal(1, 1, 1), "");
  EXPECT_EQ(refusal(7, 1, 1), "") << "wrong, but not by a unit";
  EXPECT_EQ(refusal(1e3, 1, 1),
            "truth.csv:2: x_m: the values agree with the fixes if they are in mm; convert them to "
            "m");
  EXPECT_THAT(refusal(1 / 0.3048, 1, 1), HasSubstr("x_m: the values agree with the fixes if they "
                                                   "are in feet"));
  EXPECT_THAT(refusal(1, 100, 1), HasSubstr("z_m: the values agree with the fixes if they are in "
                                            "cm"));
  EXPECT_THAT(refusal(1, 1, 57.29578), HasSubstr("yaw_rad: the values agree with the fixes if they "
                                                 "are in degrees; convert them to rad"));
}

TEST(CompareWithPath, MeasuresErrorsToNearestPointOfPath) {
  const Path path{{{0, 0}, {1, 0}, {1, 1}}, {0, 1, 1}};
  const FixErrors errors = compare_with_path(
      {fix_at("a", 0.5, 0.1, 0.7), fix_at("b", -3, -4), fix_at("c", 1.2, 0.5), no_fix("d", "x")},
      path);
  EXPECT_EQ(errors.captures, 4);
  ASSERT_EQ(errors.errors.size(), 3);
  EXPECT_THAT(errors.errors[0].horizontal_m, IsNear(Eigen::Vector2d(0, 0.1), 1e-12));
  EXPECT_NEAR(errors.errors[0].height_m.value(), 0.2, 1e-12);
  EXPECT_DOUBLE_EQ(errors.errors[1].horizontal_m.norm(), 5);
  EXPECT_THAT(errors.errors[2].horizontal_m, IsNear(Eigen::Vector2d(0.2, 0), 1e-12));
  EXPECT_FALSE(errors.errors[2].yaw_rad);
}

TEST(CompareWithPath, GroupsConsecutiveFixesIntoThirtyClusters) {
  const std::vector<FixRow> fixes(3000, fix_at("a", 0, 0));
  const FixErrors errors = compare_with_path(fixes, {{{0, 0}, {1, 0}}, {}});
  ASSERT_EQ(errors.errors.size(), 3000);
  EXPECT_EQ(errors.errors.front().cluster, 0);
  EXPECT_EQ(errors.errors[99].cluster, 0);
  EXPECT_EQ(errors.errors[100].cluster, 1);
  EXPECT_EQ(errors.errors.back().cluster, 29);
}

}  // namespace
}  // namespace vlp
