// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(ReadSceneFile, AcceptsSampleScene) { EXPECT_EQ(scene_refusal(kSceneYaml), ""); }

TEST(ReadSceneFile, RejectsUnknownKeyInEachSection) {
  EXPECT_EQ(
      refusal_with("seed: 7", "seed: 7\nlight: 1"),
      "scene.yaml:3: key 'light' is unknown; the keys are: format, seed, room, camera, optics, "
      "sensor, processing, mount, ambient_e_per_s, lamps, clutter, board, archive, captures");
  EXPECT_EQ(refusal_with("z_m: [0, 1.7]", "z_m: [0, 1.7], w_m: 0"),
            "scene.yaml:3: room: key 'w_m' is unknown; the keys are: x_m, y_m, z_m");
  const auto unknown = [](const std::string& before, const std::string& place) {
    EXPECT_THAT(
        refusal_with(before, "nonsense: 1, " + before),
        testing::StartsWith("scene.yaml:" + place + ": key 'nonsense' is unknown; the keys are: "));
  };
  unknown("id: small", "4: camera");
  unknown("blur_px", "5: optics");
  unknown("bits", "6: sensor");
  unknown("fraction: 0.3", "6: sensor.bloom");
  unknown("tilt_deg", "7: mount");
  unknown("id: 5", "11: lamps[1]");
  unknown("fraction: 0.02", "11: lamps[1].halo");
  unknown("depth_m", "13: clutter.steady_lamps[1].recess");
  unknown("reflector_ratio: 0.05", "13: clutter.steady_lamps[1].recess.dark_side");
  unknown("gamma", "29: processing");
  unknown("amount", "29: processing.sharpening");
  unknown("position_m: [0.3", "13: clutter.steady_lamps[0]");
  unknown("corner_m: [-0.9", "14: clutter.windows[0]");
  unknown("of_lamp", "15: clutter.reflections[0]");
  unknown("corner_m: [-0.7", "16: clutter.occluders[0]");
  unknown("family", "18: board.pattern");
  unknown("folder: spots", "25: captures[0]");
  unknown("x_m: [-0.6, 0.6]", "26: captures[1].grid");
  unknown("count: 4", "26: captures[1].turn");
  unknown("from_m", "27: captures[2].drive");
  unknown("count: 5", "28: captures[3].views");
  EXPECT_THAT(refusal_with("  margin_m", "  nonsense: 1\n  margin_m"),
              HasSubstr("scene.yaml:19: board: key 'nonsense' is unknown"));
  EXPECT_THAT(refusal_with("  windows", "  nonsense: []\n  windows"),
              HasSubstr("scene.yaml:14: clutter: key 'nonsense' is unknown"));
}

TEST(ReadSceneFile, NamesMissingKeyOfEachSection) {
  EXPECT_EQ(refusal_with("seed: 7\n", ""),
            "scene.yaml:1: key 'seed' is missing; the keys are: format, room, camera, optics, "
            "sensor, mount, ambient_e_per_s, lamps, clutter, board, captures, processing");
  const auto missing = [](const std::string& text, const std::string& place,
                          const std::string& key) {
    EXPECT_THAT(refusal_with(text, ""),
                HasSubstr("scene.yaml:" + place + "key '" + key + "' is missing; the keys are: "));
  };
  missing("ambient_e_per_s: 1.0e+6\n", "1: ", "ambient_e_per_s");
  missing("x_m: [-1, 1], ", "3: room: ", "x_m");
  missing("vignetting_power: 4", "5: optics: ", "vignetting_power");
  missing("full_well_e: 13000, ", "6: sensor: ", "full_well_e");
  missing("fraction: 0.3, ", "6: sensor.bloom: ", "fraction");
  missing(", lever_arm_m: [0.03, -0.04]", "7: mount: ", "lever_arm_m");
  // Optional in a lamp map, not here.
  missing("diameter_m: 0.18, ", "10: lamps[0]: ", "diameter_m");
  missing("frequency_hz: 1600, ", "10: lamps[0]: ", "frequency_hz");
  missing("duty: 0.4, ", "10: lamps[0]: ", "duty");
  missing(", rim_to_center_ratio: 0.8", "10: lamps[0]: ", "rim_to_center_ratio");
  missing(", length_m: 0.015", "11: lamps[1].halo: ", "length_m");
  missing("depth_m: 0.07, ", "13: clutter.steady_lamps[1].recess: ", "depth_m");
  missing("source_diameter_m: 0.04, ", "13: clutter.steady_lamps[1].recess: ", "source_diameter_m");
  missing(" reflector_ratio: 0.1,", "13: clutter.steady_lamps[1].recess: ", "reflector_ratio");
  missing(", azimuth_deg: 90", "13: clutter.steady_lamps[1].recess.dark_side: ", "azimuth_deg");
  missing("gamma: 2.2, ", "29: processing: ", "gamma");
  missing(", radius_px: 1.5", "29: processing.sharpening: ", "radius_px");
  missing("of_lamp: 5, ", "15: clutter.reflections[0]: ", "of_lamp");
  missing("  margin_m: 0.02\n", "18: board: ", "margin_m");
  missing("exposure_s: 5.0e-5, ", "25: captures[0]: ", "exposure_s");
  missing(", interval_s: 0.5", "25: captures[0]: ", "interval_s");
  missing("heights_m: [0, 0.2], ", "25: captures[0]: ", "heights_m");
  missing(", columns: 3", "26: captures[1].grid: ", "columns");
  missing("count: 4, ", "26: captures[1].turn: ", "count");
  missing(", speed_m_per_s: 0.5", "27: captures[2].drive: ", "speed_m_per_s");
  missing("field_coverage: 0.75, ", "28: captures[3].views: ", "field_coverage");
}

TEST(ReadSceneFile, RejectsCameraWithoutRowTimeReadoutOrSufficientImager) {
  EXPECT_EQ(refusal_with(", row_time_s: 3.0e-5", ""),
            "scene.yaml:4: camera: key 'row_time_s' is missing; the keys are: id, imager_px, "
            "lens_model, intrinsics, pixel_pitch_m, readout");
  EXPECT_EQ(refusal_with(", readout: columns", ""),
            "scene.yaml:4: camera: key 'readout' is missing; the keys are: id, imager_px, "
            "lens_model, intrinsics, pixel_pitch_m, row_time_s");
  EXPECT_EQ(refusal_with("[160, 120]", "[160, 4]"),
            "scene.yaml:4: camera.imager_px[1]: should be a whole number within 8 and 20000, not "
            "'4'");
}

TEST(ReadSceneFile, RejectsOtherFormat) {
  EXPECT_EQ(refusal_with("vlp-scene/1", "vlp-scene/2"),
            "scene.yaml:1: format: should be 'vlp-scene/1', not 'vlp-scene/2': is it the right "
            "file?");
  EXPECT_EQ(scene_refusal("seed: 1\n"),
            "scene.yaml:1: key 'format' is missing: the file should begin with 'format: "
            "vlp-scene/1'");
}

TEST(ReadSceneFile, RejectsValueOfWrongType) {
  EXPECT_EQ(refusal_with("seed: 7", "seed: -1"),
            "scene.yaml:2: seed: should be a whole number within 0 and 2147483647, not '-1'");
  EXPECT_EQ(refusal_with("blur_px: 0.7", "blur_px: .nan"),
            "scene.yaml:5: optics.blur_px: should be a finite number, not '.nan'");
  EXPECT_EQ(refusal_with("shot_noise: true", "shot_noise: yes"),
            "scene.yaml:6: sensor.shot_noise: should be true or false, not 'yes'");
  EXPECT_EQ(refusal_with("z_m: [0, 1.7]", "z_m: [1.7, 0]"),
            "scene.yaml:3: room.z_m: should be [least, most]");
  EXPECT_EQ(refusal_with("warp_m: [0.0003, -0.0002]", "warp_m: 0.0003"),
            "scene.yaml:20: board.warp_m: should be a list, not '0.0003'");
  EXPECT_EQ(refusal_with("seed: 7", "seed: 7\nseed: 8"), "scene.yaml:3: key 'seed' occurs twice");
}

}  // namespace
}  // namespace vlp
