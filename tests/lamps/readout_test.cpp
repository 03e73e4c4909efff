// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "lamps/readout.h"

#include <gtest/gtest.h>

#include <array>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"

namespace vlp {
namespace {

cv::Mat sample(const std::string& scene) {
  return read_image(VLP_SOURCE_DIR "/datasets/" + scene + "/rendered/sample/0000.png");
}

std::optional<Readout> found_in(const cv::Mat& image) {
  return estimate_readout(1, [&](std::size_t) { return to_image_view(image); });
}

TEST(EstimateReadout, ReturnsTrueReadoutOfRenderedImages) {
  for (const char* scene : {"paper-rig", "paper-rig-faulty", "clutter"}) {
    EXPECT_EQ(found_in(sample(scene)), Readout::rows) << scene;
    EXPECT_EQ(found_in(sample(scene).t()), Readout::columns) << scene;
  }
  EXPECT_EQ(found_in(sample("wide")), Readout::columns);
  EXPECT_EQ(found_in(sample("wide").t()), Readout::rows);
}

TEST(EstimateReadout, ReturnsNulloptWithoutLamps) {
  EXPECT_FALSE(found_in(cv::Mat(120, 160, CV_8U, cv::Scalar(30))));
  EXPECT_FALSE(found_in({}));
  EXPECT_FALSE(estimate_readout(0, [](std::size_t) { return ImageView(); }));
}

TEST(EstimateReadout, StopsReadingAfterFirstConclusiveImages) {
  const cv::Mat lamps = sample("paper-rig"), dark(600, 800, CV_8U, cv::Scalar(2));
  const std::array images{cv::Mat(), dark, lamps, lamps, cv::Mat()};
  std::size_t asked = 0;
  EXPECT_EQ(estimate_readout(images.size(),
                             [&](std::size_t i) { return ++asked, to_image_view(images[i]); }),
            Readout::rows);
  EXPECT_LE(asked, 4);
}

TEST(ReadoutDirectionEvidence, ReadoutDirectionIsNulloptForWeakOrContradictoryEvidence) {
  EXPECT_FALSE((ReadoutDirectionEvidence{0.9, 0}).readout_direction());
  EXPECT_FALSE((ReadoutDirectionEvidence{3, 2}).readout_direction());
  EXPECT_EQ((ReadoutDirectionEvidence{3, 0.5}).readout_direction(), Readout::rows);
  EXPECT_EQ((ReadoutDirectionEvidence{0.5, 3}).readout_direction(), Readout::columns);
}

}  // namespace
}  // namespace vlp
