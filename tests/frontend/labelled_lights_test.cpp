// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/labelled_lights.h"

#include <gtest/gtest.h>

#include "frontend/image_folder.h"
#include "frontend/lamp_intake.h"

namespace vlp {
namespace {

const std::string kSample = VLP_SOURCE_DIR "/datasets/paper-rig/rendered/sample";

std::vector<Observation> sample_lights() {
  const LightDetector detector({}, {Readout::rows, {}, {}});
  return LampIntake(detector, ImageUse::fixes, {}, {}).observe_all(list_images(kSample)).images;
}

TEST(AddLabelled, AddsLightsNamedByTable) {
  const auto images = sample_lights();
  ASSERT_EQ(images.size(), 2);
  LabelledLights labelled;
  const auto labels = read_detections(kSample + "/true_detections.csv");
  add_labelled(images, labels, labelled);
  EXPECT_EQ(labelled.labels, 12);
  EXPECT_EQ(labelled.without_light, 0);
  ASSERT_EQ(labelled.lights.size(), 12);
  for (const LabelledLight& light : labelled.lights) {
    const double frequency_hz =
        std::array{1600, 2000, 2500, 3100, 3800, 4700}.at(static_cast<std::size_t>(light.lamp - 1));
    EXPECT_NEAR(light.stripes.period_lines * frequency_hz * 3e-5, 1, 0.05) << light.lamp;
    EXPECT_LT(light.image, 2);
  }
  // A second folder's images have numbers of their own.
  add_labelled(images, labels, labelled);
  EXPECT_EQ(labelled.lights.back().image, 3);
}

TEST(AddLabelled, CountsLabelsWithoutLight) {
  auto labels = read_detections(kSample + "/true_detections.csv");
  labels[0].detections[0].pixel.x() += 30;
  LabelledLights labelled;
  add_labelled(sample_lights(), labels, labelled);
  EXPECT_EQ(labelled.without_light, 1);
  EXPECT_EQ(labelled.lights.size(), 11);
}

TEST(AddLabelled, RejectsTruncatedLights) {
  auto images = sample_lights();
  const auto labels = read_detections(kSample + "/true_detections.csv");
  images[0].size_px = {int(labels[0].detections[0].pixel.x()), 600};
  LabelledLights labelled;
  add_labelled(images, labels, labelled);
  EXPECT_GT(labelled.without_light, 0);
}

TEST(MeasuredPeriods, ReturnsPeriodsOfAllOrLabelledLights) {
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

}  // namespace
}  // namespace vlp
