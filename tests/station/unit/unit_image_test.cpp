// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_image.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

/// Images of lamps at the station in datasets/station.
struct LampImage : testing::Test {
  StationConfig config = read_station(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  TemporaryFolder folder;

  std::string refusal(const cv::Mat& image) const {
    const auto file = folder / "0.png";
    cv::imwrite(file.string(), image);
    Calibration calibration;
    calibration.camera = config.type;
    return look_at_lamps(file, config, {config.lamps, detector_camera(calibration)}).refused;
  }
  /// A ceiling at a level, its noise, and a lamp with stripes that are so much brighter.
  cv::Mat1b ceiling(double level, double sd, double lamp) const {
    cv::Mat1f image(config.type.imager_px[1], config.type.imager_px[0]);
    cv::RNG random(3);
    random.fill(image, cv::RNG::NORMAL, level, sd);
    for (int v = 200; v < 260; ++v) {
      if (v / 5 % 2 == 0) image(cv::Rect(300, v, 60, 1)) += lamp;
    }
    cv::Mat1b levels;
    image.convertTo(levels, CV_8U);
    return levels;
  }
};

/// Whatever is detected in its noise.
TEST_F(LampImage, IsTooDarkWhenNothingStandsOutOfTheNoise) {
  EXPECT_THAT(refusal(ceiling(2, 0.5, 2)), StartsWith("too dark: the brightest is "));
  EXPECT_THAT(refusal(ceiling(20, 3, 5)), StartsWith("too dark: the brightest is "));
  EXPECT_THAT(refusal(ceiling(0, 0, 0)), StartsWith("too dark: the brightest is 0 times"));
  EXPECT_THAT(refusal(ceiling(20, 1, 100)), StartsWith("too few lamps: ")) << "one lamp, bright";
}

/// At full scale, and where the sensor is full before that.
TEST_F(LampImage, IsOverexposedWhenAllOfItIsBright) {
  EXPECT_THAT(refusal(ceiling(400, 1, 100)),
              StartsWith("overexposed: all of the image is at 100 % of the full scale"));
  EXPECT_THAT(refusal(ceiling(240, 0.3, 0)), StartsWith("overexposed: all of the image is at 9"));
}

TEST_F(LampImage, OfAnotherSizeIsOfAnotherCamera) {
  EXPECT_EQ(refusal(cv::Mat1b(100, 200, static_cast<unsigned char>(0))),
            "another size: 200 x 100 px, the camera has 800 x 600");
}

}  // namespace
}  // namespace vlp
