// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "lamps/signal/lamp_classifier.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

LampClassifier sample() {
  LampClassifier classifier;
  classifier.mean = {2.5, 0.48, 0.087, 0.49};
  classifier.scale = {0.37, 0.0055, 0.03, 0.024};
  classifier.covariance = Eigen::Vector4d(2e-4, 4, 0.1, 1.2).asDiagonal();
  classifier.covariance(1, 3) = classifier.covariance(3, 1) = -0.45;
  classifier.lamps = {{3, 64, {1.5, 0.2, -1.3, 0.3}}, {8, 60, {-0.3, 0.1, 0.2, 1.0 / 3}}};
  classifier.row_time_s = 3e-5;
  return classifier;
}

TEST(ClassifierPath, ReadReturnsWrittenClassifier) {
  const TemporaryFolder folder;
  write_classifier(folder / "a.yaml", sample());
  const LampClassifier read = read_lamp_classifier(folder / "a.yaml");
  EXPECT_EQ(read.mean, sample().mean);
  EXPECT_EQ(read.scale, sample().scale);
  EXPECT_EQ(read.covariance, sample().covariance);
  ASSERT_EQ(read.lamps.size(), 2);
  EXPECT_EQ(read.lamps[1].lamp, 8);
  EXPECT_EQ(read.lamps[1].examples, 60);
  EXPECT_EQ(read.lamps[1].center, sample().lamps[1].center);
  EXPECT_EQ(read.row_time_s, 3e-5);
  write_classifier(folder / "b.yaml", read);
  EXPECT_EQ(TemporaryFolder::read_content(folder / "a.yaml"),
            TemporaryFolder::read_content(folder / "b.yaml"));
}

TEST(ReadLampClassifier, ThrowsForInvalidFile) {
  const TemporaryFolder folder;
  write_classifier(folder / "good.yaml", sample());
  const std::string valid_yaml = TemporaryFolder::read_content(folder / "good.yaml");
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string yaml = valid_yaml;
    const auto at = yaml.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    const auto file = folder.file("bad.yaml", yaml.replace(at, from.size(), to));
    return rejection_message([&] { read_lamp_classifier(file); });
  };
  EXPECT_THAT(refusal("vlp-classifier/1", "vlp-classifier/2"), HasSubstr("bad.yaml:1: format"));
  EXPECT_THAT(refusal("row_time_s: 0.00003", "row_time_s: 30"),
              HasSubstr("bad.yaml:2: row_time_s"));
  EXPECT_THAT(refusal("duty, ", ""),
              HasSubstr("bad.yaml:3: features: should be [log_period_lines"));
  EXPECT_THAT(refusal("2.5, ", ""), HasSubstr("bad.yaml:4: mean"));
  EXPECT_THAT(refusal("0.0055", "-1"), HasSubstr("bad.yaml:5: scale: should be positive"));
  EXPECT_THAT(refusal("id: 8", "id: 3"), HasSubstr("bad.yaml:8: lamps[1]: id 3 occurs twice"));
  EXPECT_THAT(refusal("examples", "frames"), HasSubstr("bad.yaml:7: lamps[0]"));
  EXPECT_THAT(refusal("[0, 4, 0, -0.45]", "[0, -4, 0, -0.45]"), HasSubstr("covariance: is not a"));
  EXPECT_THAT(refusal("[0, 4, 0, -0.45]", "[0, 4, 0, 0.45]"), HasSubstr("covariance: is not a"));
  EXPECT_THAT(refusal("scale:", "scales:"), HasSubstr("scale"));
}

TEST(ReadLampClassifier, ThrowsForTruncatedFile) {
  const TemporaryFolder folder;
  write_classifier(folder / "good.yaml", sample());
  const std::string valid_yaml = TemporaryFolder::read_content(folder / "good.yaml");
  for (std::size_t length = 0; length + 1 < valid_yaml.size(); ++length) {
    const auto file = folder.file("cut.yaml", valid_yaml.substr(0, length));
    EXPECT_NE(rejection_message([&] { read_lamp_classifier(file); }), "") << length;
  }
}

}  // namespace
}  // namespace vlp
