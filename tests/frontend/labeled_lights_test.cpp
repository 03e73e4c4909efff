// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/labeled_lights.h"

#include <gtest/gtest.h>

#include "frontend/image_file.h"
#include "frontend/lamp_intake.h"

namespace vlp {
namespace {

const std::string kSample = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample";

std::vector<Observation> sample_lights() {
  const LightDetector detector({}, {Readout::rows, {}, {}});
  return LampIntake(detector, ImageUse::fixes, {}, {})
      .detect_lamps_in_images(list_images(kSample))
      .images;
}

TEST(AddLabeledLights, AddsOneLightPerLabelOfTable) {
  const auto images = sample_lights();
  ASSERT_EQ(images.size(), 2);
  LabeledLights labeled;
  const auto labels = read_detections(kSample + "/true_detections.csv");
  add_labeled_lights(images, labels, labeled);
  EXPECT_EQ(labeled.num_labels, 12);
  EXPECT_EQ(labeled.num_labels_without_light, 0);
  ASSERT_EQ(labeled.lights.size(), 12);
  for (const LabeledLight& light : labeled.lights) {
    const double frequency_hz =
        std::array{1600, 2000, 2500, 3100, 3800, 4700}.at(static_cast<std::size_t>(light.lamp - 1));
    EXPECT_NEAR(light.stripes.period_lines * frequency_hz * 3e-5, 1, 0.05) << light.lamp;
    EXPECT_LT(light.image, 2);
  }
  // A second folder's images have numbers of their own.
  add_labeled_lights(images, labels, labeled);
  EXPECT_EQ(labeled.lights.back().image, 3);
}

TEST(AddLabeledLights, CountsLabelsWithoutLight) {
  auto labels = read_detections(kSample + "/true_detections.csv");
  labels[0].detections[0].pixel.x() += 30;
  LabeledLights labeled;
  add_labeled_lights(sample_lights(), labels, labeled);
  EXPECT_EQ(labeled.num_labels_without_light, 1);
  EXPECT_EQ(labeled.lights.size(), 11);
}

TEST(AddLabeledLights, CountsLabelOfLightCutByBorderAsWithoutLight) {
  auto images = sample_lights();
  const auto labels = read_detections(kSample + "/true_detections.csv");
  images[0].size_px = {int(labels[0].detections[0].pixel.x()), 600};
  LabeledLights labeled;
  add_labeled_lights(images, labels, labeled);
  EXPECT_GT(labeled.num_labels_without_light, 0);
}

TEST(CollectPeriods, ReturnsPeriodsOfAllLightsOrOnlyLabeledOnes) {
  const auto images = sample_lights();
  const auto all = collect_periods(images, {});
  EXPECT_GE(all.size(), 8);
  EXPECT_FALSE(all[0].lamp);
  auto labels = read_detections(kSample + "/true_detections.csv");
  labels.pop_back();
  const auto some = collect_periods(images, labels);
  EXPECT_LE(some.size(), 6);
  EXPECT_GE(some.size(), 4);
  for (const MeasuredPeriod& period : some) EXPECT_TRUE(period.lamp);
}

TEST(CollectPeriods, ReturnsPeriodsOfLightsCutByBorder) {
  auto images = sample_lights();
  const std::size_t all = collect_periods(images, {}).size();
  for (Observation& image : images) image.size_px = {400, 300};
  EXPECT_EQ(collect_periods(images, {}).size(), all);
}

}  // namespace
}  // namespace vlp
