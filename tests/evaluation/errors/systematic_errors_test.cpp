// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/errors/systematic_errors.h"

#include <gmock/gmock.h>

#include <functional>
#include <random>

#include "fix_at.h"
#include "geometry/angles.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Fixes of a grid with errors of 0.1 mm and 0.001 rad, against a truth that `change` alters.
std::vector<std::string> describe(const std::function<void(TruthRow&)>& change,
                                  std::ptrdiff_t shift = 0, int count = 12) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise;
  FileRows<FixRow> fixes{"fixes.csv", {}};
  FileRows<TruthRow> truth{"check/truth.csv", {}};
  for (int i = 0; i < count; ++i) {
    const std::string image = std::to_string(i);
    const double x_m = 0.3 * (i % 4), y_m = 0.25 * (i / 4), yaw_rad = 2.1 * i;
    fixes.rows.push_back(fix_at(image, x_m + 1e-4 * noise(random), y_m + 1e-4 * noise(random),
                                0.2 + 1e-4 * noise(random),
                                wrap_angle_rad(yaw_rad + 1e-3 * noise(random))));
    truth.rows.push_back({image, {x_m, y_m}, 0.2, wrap_angle_rad(yaw_rad)});
    change(truth.rows.back());
  }
  std::vector<Eigen::Vector2d> places_m;
  for (const TruthRow& row : truth.rows) places_m.push_back(row.xy_m);
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    truth.rows[static_cast<std::size_t>(i)].xy_m =
        places_m[static_cast<std::size_t>((i + count + shift) % count)];
  }
  return describe_systematic_errors(fixes, truth, compare_with_truth(fixes, truth, 1e-3).errors);
}

TEST(DescribeSystematicErrors, ReturnsNoneForNoiseFewFixesAndRandomErrors) {
  EXPECT_THAT(describe([](TruthRow&) {}), IsEmpty());
  EXPECT_THAT(describe([](TruthRow& row) { row.xy_m.x() += 0.004; }), IsEmpty()) << "small";
  EXPECT_THAT(describe([](TruthRow& row) { row.xy_m.x() += 0.05; }, 0, 5), IsEmpty()) << "few";
  std::mt19937 random(2);
  std::normal_distribution<double> noise;
  EXPECT_THAT(describe([&](TruthRow& row) {
                row.xy_m += Eigen::Vector2d(noise(random), noise(random));
                row.z_m = noise(random);
                row.yaw_rad = noise(random);
              }),
              IsEmpty());
}

TEST(DescribeSystematicErrors, NamesOffsetOfPositions) {
  EXPECT_THAT(describe([](TruthRow& row) { row.xy_m -= Eigen::Vector2d(0.05, -0.02); }),
              ElementsAre(AllOf(HasSubstr("truth.csv: the positions agree with the fixes to 0."),
                                HasSubstr("if they are moved by x +50.0 mm, y -20.0 mm:"))));
}

TEST(DescribeSystematicErrors, NamesShiftedRows) {
  EXPECT_THAT(describe([](TruthRow&) {}, 1), ElementsAre(HasSubstr("those of the previous row")));
  EXPECT_THAT(describe([](TruthRow&) {}, -1), ElementsAre(HasSubstr("those of the next row")));
}

TEST(DescribeSystematicErrors, NamesShiftedRowsOfPairsAtOnePosition) {
  FileRows<FixRow> fixes{"fixes.csv", {}};
  FileRows<TruthRow> truth{"truth.csv", {}};
  for (int i = 0; i < 12; ++i) {
    const auto image = std::to_string(i);
    fixes.rows.push_back(fix_at(image, 0.3 * (i / 2), 0.1 * (i / 4)));
    const int other = (i + 1) % 12;
    truth.rows.push_back({image, {0.3 * (other / 2), 0.1 * (other / 4)}, {}, {}});
  }
  const auto found =
      describe_systematic_errors(fixes, truth, compare_with_truth(fixes, truth, 1e-3).errors);
  EXPECT_THAT(found, ElementsAre(HasSubstr("those of the previous row")));
}

TEST(DescribeSystematicErrors, NamesRotationMirroringAndScale) {
  EXPECT_THAT(describe([](TruthRow& row) { row.xy_m *= -1; }),
              ElementsAre(testing::ContainsRegex("turned by -?180 degrees:")));
  EXPECT_THAT(describe([](TruthRow& row) { std::swap(row.xy_m.x(), row.xy_m.y()); }),
              ElementsAre(HasSubstr("mirrored (y reversed), turned by 90")));
  EXPECT_THAT(describe([](TruthRow& row) { row.xy_m /= 3; }),
              ElementsAre(testing::ContainsRegex("multiplied by 3:")));
}

TEST(DescribeSystematicErrors, ReturnsNoneForFixesAtOnePosition) {
  FileRows<FixRow> fixes{"fixes.csv", {}};
  FileRows<TruthRow> truth{"truth.csv", {}};
  for (int i = 0; i < 12; ++i) {
    fixes.rows.push_back(fix_at(std::to_string(i), 1e-3 * (i % 3), 1e-3 * (i % 2)));
    truth.rows.push_back({std::to_string(i), {0.3 * (i % 4), 0.25 * (i / 4)}, {}, {}});
  }
  const auto errors = compare_with_truth(fixes, truth, 1e-3).errors;
  EXPECT_THAT(describe_systematic_errors(fixes, truth, errors), IsEmpty());
}

TEST(DescribeSystematicErrors, NamesOffsetOfHeights) {
  EXPECT_THAT(describe([](TruthRow& row) { *row.z_m += 0.1; }),
              ElementsAre(HasSubstr("z_m: the heights of the fixes differ by -100.")));
}

TEST(DescribeSystematicErrors, NamesOffsetAndSenseOfYaw) {
  EXPECT_THAT(describe([](TruthRow& row) { *row.yaw_rad -= 0.5; }),
              ElementsAre(testing::ContainsRegex("fixes if .28.[67] degrees are added")));
  EXPECT_THAT(describe([](TruthRow& row) { *row.yaw_rad *= -1; }),
              ElementsAre(HasSubstr("fixes if its sign is changed and ")));
}

}  // namespace
}  // namespace vlp
