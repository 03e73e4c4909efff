// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "session/train_step.h"

#include <gmock/gmock.h>

#include "frontend/image_file.h"
#include "support/datasets.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const std::string kSample = kRig + "/sample";

/// Two labeled images, repeated as several folders.
struct Training {
  LampMap lamps = read_lamp_map(kRig + "/lamps.yaml");
  DetectedLights seen;
  std::vector<std::vector<Frame>> labels;

  explicit Training(std::size_t folders) {
    FrontendOptions options;
    options.readout = Readout::rows;
    const DetectedLights one = detect_in_folders({kSample}, lamps, {}, false, options);
    for (std::size_t i = 0; i < folders; ++i) {
      seen.observations.images.insert(seen.observations.images.end(),
                                      one.observations.images.begin(),
                                      one.observations.images.end());
    }
    seen.folder_sizes.assign(folders, one.folder_sizes[0]);
    labels.assign(folders, read_detections(kSample + "/true_detections.csv"));
  }
  TrainStepResult trained() const { return run_train_step(seen, labels, lamps, "sample"); }
};

TEST(RunTrainStep, ReturnsUndeterminedForTooFewLightsPerLamp) {
  const TrainStepResult result = Training(1).trained();
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_THAT(result.message, HasSubstr("too few labeled lights of lamps 1 (has 2), 2 (has 2)"));
}

TEST(RunTrainStep, CrossValidationIdentifiesAllLamps) {
  const TrainStepResult result = Training(kMinExamples).trained();
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_EQ(result.classifier.lamps.size(), 6U);
  EXPECT_EQ(result.labeled.num_labels, 12 * kMinExamples);
  EXPECT_EQ(result.confusion.counts.sum(), 12 * kMinExamples);
  EXPECT_EQ(result.confusion.count_wrong(), 0);
}

TEST(RunTrainStep, ListsTenInseparablePairsAndCountsOthers) {
  Training training(kMinExamples);
  const auto stripes = training.seen.observations.images.front().lights.front().stripes;
  std::size_t i = 0;
  for (Observation& image : training.seen.observations.images) {
    for (Light& light : image.lights) {
      light.stripes = stripes;
      light.stripes.period_lines *= 1 + 1e-3 * static_cast<double>(i++ % 7);
    }
  }
  const TrainStepResult result = training.trained();
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  // Six lamps have 15 pairs.
  ASSERT_EQ(result.warnings.size(), 11U);
  for (std::size_t k = 0; k < 10; ++k) EXPECT_THAT(result.warnings[k], HasSubstr(" look alike ("));
  EXPECT_EQ(result.warnings.back(), "and 5 more pairs that look alike");
}

TEST(RunTrainStep, StoresRowTimeOfCalibration) {
  Training training(kMinExamples);
  EXPECT_FALSE(training.trained().classifier.row_time_s);
  training.seen.camera.row_time_s = 3e-5;
  EXPECT_EQ(training.trained().classifier.row_time_s, 3e-5);
}

TEST(RunTrainStep, ReturnsUndeterminedForSingleLamp) {
  Training training(kMinExamples);
  training.lamps.lamps.resize(1);
  for (std::vector<Frame>& folder : training.labels) {
    for (Frame& frame : folder) {
      std::erase_if(frame.detections, [](const Detection& label) { return label.lamp != 1; });
    }
  }
  const TrainStepResult result = training.trained();
  EXPECT_EQ(result.failure, StepFailure::undetermined);
  EXPECT_EQ(result.message, "a classifier needs two lamps or more; add lamps");
}

TEST(RunTrainStep, WarnsOfRowTimeThatContradictsStripes) {
  constexpr double true_row_time_s = 3e-5;
  Training training(kMinExamples);
  training.seen.camera.row_time_s = true_row_time_s;
  EXPECT_THAT(training.trained().warnings, Not(Contains(HasSubstr("row time"))));
  training.seen.camera.row_time_s = 1.1 * true_row_time_s;
  EXPECT_THAT(training.trained().warnings,
              Contains(HasSubstr("row time is 33 us in the calibration, but the stripes")));
}

TEST(RunTrainStep, ThrowsForLabelOfUnknownLampOrIfNoLabeledImageExists) {
  Training training(1);
  training.lamps.lamps.pop_back();
  EXPECT_THAT(rejection_message<std::invalid_argument>([&] { training.trained(); }),
              HasSubstr("the labels contain lamp 6, which is not in the lamp map"));
  for (Frame& frame : training.labels[0]) frame.image += ".png";
  EXPECT_THAT(rejection_message([&] { training.trained(); }),
              HasSubstr("sample: the table names none of the images"));
}

}  // namespace
}  // namespace vlp
