// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/signal/lamp_classifier.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lamps/signal/square_wave.h"

namespace vlp {
namespace {

struct LampSpec {
  int lamp;
  double period_lines, duty;
};

/// Returns lights of lamps in typical sizes and phases, one of each lamp in every image.
std::vector<LabeledLight> make_lights(const std::vector<LampSpec>& lamps, std::size_t images,
                                      std::uint64_t seed) {
  Random random(seed);
  std::vector<LabeledLight> lights;
  for (std::size_t image = 0; image < images; ++image) {
    for (const LampSpec& lamp : lamps) {
      const auto lines = static_cast<int>(random.uniform(45, 75));
      lights.push_back({lamp.lamp,
                        measure_stripes(noisy_square_wave(lines, lamp.period_lines, lamp.duty, 1.67,
                                                          0.02, random)),
                        image});
    }
  }
  return lights;
}

/// Returns the confusion matrix of a classifier for lights of lamps that may differ from its own.
ConfusionMatrix compute_confusion_matrix(const LampClassifier& classifier,
                                         std::span<const LabeledLight> lights) {
  return cross_validate(lights, [&](std::span<const LabeledLight>) { return classifier; });
}

const std::vector<LampSpec> kLamps{{4, 16.7, 0.5}, {7, 13.3, 0.5}, {9, 10.8, 0.5}};
/// Two lamps of the same period, which only their duty distinguishes.
const std::vector<LampSpec> kTwins{{1, 12, 0.35}, {2, 12, 0.7}};

TEST(LampClassifier, IdentifiesNearlyAllLightsOfTrainedLamps) {
  const LampClassifier classifier = fit_classifier(make_lights(kLamps, 30, 1));
  ASSERT_EQ(classifier.lamps.size(), 3);
  EXPECT_EQ(classifier.lamps[0].lamp, 4);
  const ConfusionMatrix confusion =
      compute_confusion_matrix(classifier, make_lights(kLamps, 100, 2));
  EXPECT_EQ(confusion.lamps, (std::vector<int>{4, 7, 9}));
  EXPECT_EQ(confusion.count_wrong(), 0);
  EXPECT_GE(confusion.count_correct(), 297);
  EXPECT_EQ(confusion.count_correct() + confusion.count_unidentified(), 300);
  EXPECT_TRUE(list_inseparable_lamps(classifier).empty());
}

TEST(LampClassifier, SeparatesLampsOfEqualPeriodByDuty) {
  const LampClassifier classifier = fit_classifier(make_lights(kTwins, 40, 1));
  const ConfusionMatrix confusion =
      compute_confusion_matrix(classifier, make_lights(kTwins, 100, 2));
  EXPECT_EQ(confusion.count_wrong(), 0);
  EXPECT_GE(confusion.count_correct(), 150) << confusion.counts;
}

TEST(LampClassifier, ReportsUnknownForUntrainedLamps) {
  const LampClassifier classifier = fit_classifier(make_lights(kLamps, 30, 1));
  ASSERT_EQ(classifier.lamps.size(), 3);
  const ConfusionMatrix confusion =
      compute_confusion_matrix(classifier, make_lights({{5, 11.9, 0.5}, {6, 6, 0.5}}, 50, 2));
  EXPECT_EQ(confusion.count_unidentified(), 100);
}

TEST(LampClassifier, ReportsUnknownForInseparableLamps) {
  const std::vector<LampSpec> similar_lamps{{4, 16.7, 0.5}, {7, 13.3, 0.5}, {9, 13.35, 0.5}};
  const LampClassifier classifier = fit_classifier(make_lights(similar_lamps, 30, 1));
  const ConfusionMatrix confusion =
      compute_confusion_matrix(classifier, make_lights(similar_lamps, 100, 2));
  EXPECT_EQ(confusion.counts(0, 0), 100);
  EXPECT_GE(confusion.count_unidentified(), 190);
  const auto pairs = list_inseparable_lamps(classifier);
  ASSERT_EQ(pairs.size(), 1);
  EXPECT_EQ(pairs[0].first, 7);
  EXPECT_EQ(pairs[0].second, 9);
}

TEST(FitClassifier, ExcludesWronglyLabeledLightsFromTraining) {
  auto lights = make_lights(kLamps, 30, 1);
  lights[0].lamp = 9, lights[4].lamp = 4, lights[8].lamp = 7;
  const LampClassifier classifier = fit_classifier(lights);
  int used = 0;
  for (const auto& lamp : classifier.lamps) used += lamp.examples;
  EXPECT_LE(used, 87);
  EXPECT_GE(used, 80);
  const ConfusionMatrix confusion =
      compute_confusion_matrix(classifier, make_lights(kLamps, 100, 2));
  EXPECT_EQ(confusion.count_wrong(), 0);
  EXPECT_GE(confusion.count_correct(), 297);
}

TEST(LampClassifier, AcceptsUnclearStripesOnlyCloseToTrainedLamp) {
  const LampClassifier classifier = fit_classifier(make_lights(kLamps, 30, 1));
  Stripes stripes = make_lights(kLamps, 1, 3)[1].stripes;
  ASSERT_EQ(identify_by_classifier(classifier, stripes), 7);
  stripes.period_lines *= 1.025;
  EXPECT_EQ(identify_by_classifier(classifier, stripes), 7);
  stripes.periodicity_r2 = 0.6;
  EXPECT_EQ(identify_by_classifier(classifier, stripes), std::nullopt);

  ASSERT_EQ(classifier.lamps.size(), 3);
  ASSERT_EQ(classifier.lamps[1].lamp, 7);
  const LampFeatures features =
      classifier.mean + classifier.scale.cwiseProduct(classifier.lamps[1].center);
  stripes.period_lines = std::exp(features[0]);
  stripes.duty = features[1];
  stripes.count_per_line = features[2];
  stripes.lit_area = features[3];
  stripes.is_regular = true;
  ASSERT_FALSE(are_stripes_reliable(stripes));
  EXPECT_EQ(identify_by_classifier(classifier, stripes), 7);
}

TEST(CrossValidate, CountsEachLightOnce) {
  const ConfusionMatrix confusion = cross_validate(make_lights(kLamps, 40, 1), fit_classifier);
  EXPECT_EQ(confusion.counts.sum(), 120);
  EXPECT_EQ(confusion.count_wrong(), 0);
  EXPECT_GE(confusion.count_correct(), 117);
}

TEST(CrossValidate, ExcludesHeldOutImagesFromTraining) {
  // All lights of lamp 9 are in one fifth of the images: the classifier for this fold was not
  // trained on lamp 9.
  auto lights = make_lights(kLamps, 40, 1);
  std::erase_if(lights,
                [](const LabeledLight& light) { return light.lamp == 9 && light.image % 5 != 0; });
  const ConfusionMatrix confusion = cross_validate(lights, fit_classifier);
  EXPECT_EQ(confusion.counts(2, 2), 0);
  EXPECT_EQ(confusion.counts(2, 3), 8);
}

}  // namespace
}  // namespace vlp
