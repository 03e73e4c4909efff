// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/lamp_intake.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "frontend/image_file.h"
#include "support/datasets.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::StartsWith;

/// Images of lamps seen by the camera of the paper's rig.
struct LampIntakeOfImage : testing::Test {
  LampMap lamps = read_lamp_map(kRig + "/lamps.yaml");
  Calibration calibration = read_calibration(kRig + "/true_calibration.yaml");
  TemporaryFolder folder;

  Observation observe(const cv::Mat& image, ImageUse use = ImageUse::known_positions) const {
    const auto file = folder / "0.png";
    cv::imwrite(file.string(), image);
    return LampIntake(LightDetector(lamps, make_detector_camera(calibration)), use, {},
                      calibration.camera.imager_px)
        .detect_lamps_in_image(SourceImage(file));
  }
  std::string refusal(const cv::Mat& image) const {
    const Observation seen = observe(image);
    return seen.is_image_kept() ? "" : seen.rejection->message;
  }
  /// Creates an image of a ceiling with this level and noise, and a lamp with stripes brighter by
  /// `lamp`.
  cv::Mat1b ceiling(double level, double sd, double lamp) const {
    cv::Mat1f image(600, 800);
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

/// Independent of false detections in the noise.
TEST_F(LampIntakeOfImage, RejectsImageWithoutLightAboveNoiseAsTooDark) {
  EXPECT_THAT(refusal(ceiling(2, 0.5, 2)), StartsWith("too dark: the brightest is "));
  EXPECT_THAT(refusal(ceiling(20, 3, 5)), StartsWith("too dark: the brightest is "));
  EXPECT_THAT(refusal(ceiling(0, 0, 0)), StartsWith("too dark: the brightest is 0 times"));
  EXPECT_THAT(refusal(ceiling(20, 1, 100)), StartsWith("too few lamps: ")) << "one lamp, bright";
}

/// At full scale, and for a sensor that saturates below full scale.
TEST_F(LampIntakeOfImage, RejectsUniformlyBrightImageAsOverexposed) {
  EXPECT_THAT(refusal(ceiling(400, 1, 100)),
              StartsWith("overexposed: all of the image is at 100 % of the full scale"));
  EXPECT_THAT(refusal(ceiling(240, 0.3, 0)), StartsWith("overexposed: all of the image is at 9"));
}

TEST_F(LampIntakeOfImage, RejectsImageOfOtherSize) {
  EXPECT_EQ(refusal(cv::Mat1b(100, 200, static_cast<unsigned char>(0))),
            "is 200 x 100 px, the camera's images are 800 x 600 px");
}

TEST_F(LampIntakeOfImage, KeepsImageWithLamps) {
  const Observation image = observe(read_image(kRig + "/sample/0000.png"));
  EXPECT_TRUE(image.is_image_kept());
  EXPECT_GE(list_identified_lamps(image).size(), 4U);
  EXPECT_EQ(collect_lamp_frames(std::vector{image}).at(0).detections.size(),
            list_identified_lamps(image).size());
  for (const Light& light : image.lights) EXPECT_TRUE(light.outline.empty());
}

/// Dark images have a row in the table of fixes, without a fix.
TEST_F(LampIntakeOfImage, KeepsDarkImageWhenUsedForFixes) {
  const Observation image = observe(ceiling(2, 0.5, 2), ImageUse::fixes);
  EXPECT_TRUE(image.is_image_kept());
  EXPECT_TRUE(list_identified_lamps(image).empty());
}

TEST(DetectLamps, RejectsRepeatedImagesUnlessUsedForFixes) {
  const TemporaryFolder folder;
  for (const char* name : {"a.png", "b.png"}) {
    std::filesystem::copy_file(kRig + "/sample/0000.png", folder / name);
  }
  std::filesystem::copy_file(kRig + "/sample/0001.png", folder / "c.png");
  folder.file("d.png", "no image");
  const LampImages images{folder / "", read_lamp_map(kRig + "/lamps.yaml"), "lamps.yaml",
                          read_calibration(kRig + "/true_calibration.yaml"), "calibration.yaml"};
  const Observations turn = detect_lamps(images, ImageUse::rotation, {});
  ASSERT_EQ(turn.images.size(), 4U);
  EXPECT_TRUE(turn.images[0].is_image_kept());
  ASSERT_FALSE(turn.images[1].is_image_kept());
  EXPECT_EQ(turn.images[1].rejection->reason, RejectionReason::same_image);
  EXPECT_TRUE(turn.images[2].is_image_kept());
  ASSERT_FALSE(turn.images[3].is_image_kept());
  EXPECT_EQ(turn.images[3].rejection->reason, RejectionReason::unreadable);
  EXPECT_EQ(collect_lamp_frames(turn.images).size(), 2U);
  EXPECT_EQ(collect_lamp_frames(detect_lamps(images, ImageUse::fixes, {}).images).size(), 3U);
}

}  // namespace
}  // namespace vlp
