// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// locate_from_images() with rendered images.
#include <gmock/gmock.h>

#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/lamp_detector.h"
#include "positioning/image_fix.h"
#include "rendered_session.h"
#include "session/locate_step.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::HasSubstr;

class LocateFromImages : public RenderedSession {
 protected:
  LocateFromImages() {
    calibration.camera = truth().camera;
    calibration.rotation_center = truth().rotation_center;
  }
  LocateResult locate(const std::string& captures, const LocateInput& input) const {
    const LampImages images{session_file(captures), input.lamps, session_file("lamps.yaml"),
                            input.calibration, session_file("camera.yaml")};
    return locate_from_images(images, ImageUse::fixes, input, frontend);
  }
  LocateInput make_input() const { return {{}, lamps, calibration}; }

  const LampMap lamps = read_lamp_map(session_file("lamps.yaml"));
  Calibration calibration;
  FrontendOptions frontend;
};

/// Largest horizontal error of the fixes of check/, m.
double find_largest_error_m(const LocateResult& result, const fs::path& check) {
  const auto places = read_truth_positions(check);
  EXPECT_EQ(result.rows.size(), places.size());
  double largest_m = 0;
  for (std::size_t i = 0; i < std::min(places.size(), result.rows.size()); ++i) {
    if (!result.rows[i].fix) return 1;
    EXPECT_EQ(result.rows[i].image, places[i].image);
    const Eigen::Vector2d fix_m = result.rows[i].fix->pose.position_m.head<2>();
    largest_m = std::max(largest_m, (fix_m - places[i].xy_m).norm());
  }
  return largest_m;
}

TEST_F(LocateFromImages, LocatesCameraOfEachImage) {
  const LocateResult result = locate("check", make_input());
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_LT(find_largest_error_m(result, session_file("check")), 3e-4);
  EXPECT_EQ(result.observations.images.size(), 6U);
}

TEST_F(LocateFromImages, DetectionsAreThoseOfLibraryIfTiltIsEstimated) {
  LocateInput input = make_input();
  input.roll_pitch_sd_rad = 0.1;
  const LocateResult result = locate("check", input);
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  const Positioner positioner(lamps, calibration);
  const LampDetector detector(lamps, calibration);
  Sensors sensors;
  sensors.inclination_sigma_rad = 0.1;
  ASSERT_EQ(result.observations.images.size(), 6U);
  for (const Observation& image : result.observations.images) {
    const cv::Mat pixels = read_image(image.file);
    const auto found = locate_camera_in_image(positioner, detector, to_image_view(pixels), sensors);
    ASSERT_TRUE(found.fix.has_succeeded());
    const auto expected = list_identified_lamps(image);
    ASSERT_EQ(found.detections.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i)
      EXPECT_EQ(found.detections[i].pixel, expected[i].pixel);
  }
}

TEST_F(LocateFromImages, EstimatesReadoutThatCalibrationLacks) {
  LocateInput input = make_input();
  input.calibration.camera.readout.reset();
  input.motion = KnownMotion::make_motion_prior_from_limits(0.5, 0);
  const LocateResult result = locate("check", input);
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_THAT(result.notes, Contains(HasSubstr("the images show stripes along rows")));
}

TEST_F(LocateFromImages, NamesReadoutOfCalibrationThatImagesContradict) {
  LocateInput input = make_input();
  input.calibration.camera.readout = Readout::columns;
  const LocateResult result = locate("check", input);
  EXPECT_FALSE(result.has_succeeded());
  EXPECT_THAT(result.message, HasSubstr("but the images show stripes along rows; correct it"));
}

TEST_F(LocateFromImages, SkipsDamagedImage) {
  write_session_file("check/0003.png", "no image");
  const LocateResult result = locate("check", make_input());
  ASSERT_TRUE(result.has_succeeded()) << result.message;
  EXPECT_EQ(result.rows.size(), 5U);
  ASSERT_EQ(result.skipped.size(), 1U);
  EXPECT_EQ(result.skipped[0].image, "0003.png");
}

TEST_F(LocateFromImages, FailsIfNoLampIsIdentified) {
  LocateInput input = make_input();
  for (Lamp& lamp : input.lamps.lamps) lamp.frequency_hz = *lamp.frequency_hz * 3;
  const LocateResult result = locate("check", input);
  EXPECT_FALSE(result.has_succeeded());
  EXPECT_THAT(result.rows, testing::IsEmpty());
}

TEST_F(LocateFromImages, WritesAnnotatedImagesOnRequest) {
  frontend.annotate = folder / "annotated";
  ASSERT_TRUE(locate("check", make_input()).has_succeeded());
  EXPECT_TRUE(fs::exists(folder / "annotated"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder / "annotated"), fs::directory_iterator()),
            6);
}

}  // namespace
}  // namespace vlp
