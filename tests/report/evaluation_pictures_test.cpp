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

TEST(EvaluationPictures, ShowsTheFloorWithWhatIsMissingAndTheDistribution) {
  EvaluationInput with_truth = input();
  with_truth.truth = {"truth.csv",
                      {{"a", {0, 0}, {}, {}, 2},
                       {"b", {0.5, 0}, {}, {}, 3},
                       {"c", {1, 0}, {}, {}, 4},
                       {"d", {0, 1}, {}, {}, 5}}};
  const auto pictures = evaluation_pictures(with_truth, evaluate(with_truth), {});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].part, ReportPart::floor);
  EXPECT_THAT(pictures[0].image, HasSubstr("no fix: 1"));
  EXPECT_EQ(pictures[1].part, ReportPart::distribution);
  EXPECT_THAT(pictures[1].alt, HasSubstr("further off than 2 mm"));
}

TEST(EvaluationPictures, ShowsTheDriveAlongACommandedLine) {
  EvaluationInput with_line = input();
  with_line.line_m = {Eigen::Vector2d{0, 0}, Eigen::Vector2d{1, 0}};
  const auto pictures = evaluation_pictures(with_line, evaluate(with_line), {});
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].part, ReportPart::tracks);
  EXPECT_THAT(pictures[0].caption, HasSubstr("Drive. Above"));
}

}  // namespace
}  // namespace vlp
