// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Scenes with valid structure and invalid values.
#include <gmock/gmock.h>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

TEST(ReadSceneFile, RejectsElectronRateOutOfRange) {
  const std::string range =
      " electrons per second is not within 0 and 1.0e+12 electrons per second: is it in the right "
      "unit?";
  EXPECT_EQ(refusal_with("ambient_e_per_s: 1.0e+6", "ambient_e_per_s: -1"),
            "scene.yaml:8: ambient_e_per_s: -1" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 2.0e+8", "electron_rate_e_per_s: -5"),
            "scene.yaml:10: lamps[0].electron_rate_e_per_s: -5" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 3.0e+8", "electron_rate_e_per_s: 2.5e+13"),
            "scene.yaml:11: lamps[1].electron_rate_e_per_s: 2.5e+13" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 1.5e+8", "electron_rate_e_per_s: -2"),
            "scene.yaml:13: clutter.steady_lamps[0].electron_rate_e_per_s: -2" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 8.0e+7", "electron_rate_e_per_s: -2"),
            "scene.yaml:14: clutter.windows[0].electron_rate_e_per_s: -2" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 1.2e+7", "electron_rate_e_per_s: -2"),
            "scene.yaml:15: clutter.reflections[0].electron_rate_e_per_s: -2" + range);
  EXPECT_EQ(refusal_with("electron_rate_e_per_s: 2.0e+6", "electron_rate_e_per_s: -2"),
            "scene.yaml:16: clutter.occluders[0].electron_rate_e_per_s: -2" + range);
  EXPECT_EQ(refusal_with("black_e_per_s: 1.5e+5", "black_e_per_s: -2"),
            "scene.yaml:22: board.black_e_per_s: -2" + range);
}

TEST(ReadSceneFile, RejectsInvalidSensor) {
  EXPECT_EQ(refusal_with("bits: 8", "bits: 12"), "scene.yaml:6: sensor.bits: should be 8 or 16");
  EXPECT_EQ(refusal_with("bits: 8", "bits: 32"),
            "scene.yaml:6: sensor.bits: should be a whole number within 8 and 16, not '32'");
  EXPECT_EQ(refusal_with("gain_dn_per_e: 0.02", "gain_dn_per_e: 0"),
            "scene.yaml:6: sensor.gain_dn_per_e: 0 DN per electron is not within 1.0e-06 and 10000 "
            "DN per electron: is it in the right unit?");
  EXPECT_EQ(refusal_with("black_level_dn: 2", "black_level_dn: 256"),
            "scene.yaml:6: sensor.black_level_dn: 256 DN is not within 0 and 255 DN: is it in the "
            "right unit?");
  std::string deep = scene_with("bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2",
                                "bits: 16, gain_dn_per_e: 0.02, black_level_dn: 256");
  const std::string jpeg = ", jpeg_quality: 90";
  EXPECT_EQ(scene_refusal(deep.erase(deep.find(jpeg), jpeg.size())), "");
  EXPECT_EQ(refusal_with("full_well_e: 13000", "full_well_e: 0"),
            "scene.yaml:6: sensor.full_well_e: 0 electrons is not within 1 and 1.0e+09 electrons: "
            "is it in the right unit?");
  EXPECT_EQ(refusal_with("fraction: 0.3", "fraction: 30"),
            "scene.yaml:6: sensor.bloom.fraction: 30 (of the charge) is not within 0 and 1 (of the "
            "charge): is it in the right unit?");
}

TEST(ReadSceneFile, RejectsInvalidTiltLeverArmOrFocalLength) {
  EXPECT_EQ(refusal_with("tilt_deg: 2,", "tilt_deg: 100,"),
            "scene.yaml:7: mount.tilt_deg: 100 degrees is not within 0 and 45 degrees: is it in "
            "the right unit?");
  EXPECT_EQ(refusal_with("[0.03, -0.04]", "[30, -40]"),
            "scene.yaml:7: mount.lever_arm_m[0]: 30 m is not within -5 and 5 m: is it in the right "
            "unit?");
  EXPECT_EQ(refusal_with("[100, 101,", "[0, 101,"),
            "scene.yaml:4: camera.intrinsics: the focal lengths, the first two, should be "
            "positive");
}

TEST(ReadSceneFile, RejectsImagerAbove64Megapixels) {
  EXPECT_EQ(refusal_with("imager_px: [160, 120]", "imager_px: [20000, 20000]"),
            "scene.yaml:4: camera.imager_px: has more than 64 million pixels");
}

TEST(ReadSceneFile, RejectsLightsOutsideRoomOrNotAboveCamera) {
  EXPECT_EQ(refusal_with("[-0.6, -0.3, 1.6]", "[-0.6, -0.3, 16]"),
            "scene.yaml:10: lamps[0].position_m: is outside the room");
  EXPECT_EQ(refusal_with("position_m: [0.3, 0, 1.6]", "position_m: [3, 0, 1.6]"),
            "scene.yaml:13: clutter.steady_lamps[0].position_m: is outside the room");
  EXPECT_EQ(refusal_with("position_m: [0.2, 0.1, 1.6]", "position_m: [0.2, 1, 1.6]"),
            "scene.yaml:15: clutter.reflections[0].position_m: is outside the room");
  const auto low = [](const std::string& from, const std::string& to) {
    std::string yaml = scene_with(from, to);
    const auto begin = yaml.find("  occluders:");
    yaml.erase(begin, yaml.find('\n', begin) + 1 - begin);
    return scene_refusal(yaml);
  };
  EXPECT_EQ(low("position_m: [0.3, 0, 1.6]", "position_m: [0.3, 0, 0.1]"),
            "scene.yaml:24: captures[0].heights_m[1]: a steady lamp is not above the camera");
  EXPECT_EQ(low("position_m: [0.2, 0.1, 1.6]", "position_m: [0.2, 0.1, 0.1]"),
            "scene.yaml:24: captures[0].heights_m[1]: a reflection is not above the camera");
}

TEST(ReadSceneFile, RejectsDuplicateLampsAndInvalidPhaseOrMapError) {
  EXPECT_EQ(refusal_with("id: 5,", "id: 1,"), "scene.yaml:11: lamps[1]: id 1 occurs twice");
  EXPECT_EQ(refusal_with("[0.6, 0.2, 1.5]", "[-0.6, -0.3, 1.6]"),
            "scene.yaml:11: lamps[1]: lamp 5 is where lamp 1 is");
  EXPECT_EQ(refusal_with("phase: 0.25", "phase: 90"),
            "scene.yaml:11: lamps[1].phase: 90 (of a period) is not within 0 and 1 (of a period): "
            "is it in the right unit?");
  EXPECT_EQ(refusal_with("[0.001, 0.002, 0.003]", "[0.001, 0.002]"),
            "scene.yaml:11: lamps[1].map_error_m: should be 3 numbers, not 2");
}

TEST(ReadSceneFile, RejectsRecessOrHaloValuesOutOfRange) {
  const std::string recess = "scene.yaml:13: clutter.steady_lamps[1].recess.";
  const std::string unit = ": is it in the right unit?";
  EXPECT_EQ(refusal_with("depth_m: 0.07", "depth_m: -0.07"),
            recess + "depth_m: -0.07 m is not within 0 and 2 m" + unit);
  EXPECT_EQ(refusal_with("depth_m: 0.07", "depth_m: 0"), "");
  EXPECT_EQ(refusal_with("source_diameter_m: 0.04", "source_diameter_m: 0.15"),
            recess + "source_diameter_m: is larger than the rim, diameter_m");
  EXPECT_EQ(refusal_with("source_diameter_m: 0.04", "source_diameter_m: 0.14"), "");
  EXPECT_EQ(refusal_with("source_diameter_m: 0.04", "source_diameter_m: 0"),
            recess + "source_diameter_m: 0 m is not within 0.001 and 10 m" + unit);
  EXPECT_EQ(refusal_with("reflector_ratio: 0.1", "reflector_ratio: 10"),
            recess +
                "reflector_ratio: 10 (of the source's radiance) is not within 0 and 1 (of the "
                "source's radiance)" +
                unit);
  EXPECT_EQ(
      refusal_with("fraction: 0.02", "fraction: -0.02"),
      "scene.yaml:11: lamps[1].halo.fraction: -0.02 (of the source's radiance) is not within 0 "
      "and 1 (of the source's radiance)" +
          unit);
  EXPECT_EQ(refusal_with("length_m: 0.015", "length_m: 0"),
            "scene.yaml:11: lamps[1].halo.length_m: 0 m is not within 0.001 and 2 m" + unit);
}

TEST(ReadSceneFile, RejectsInvalidOrMissingColorFilterRatio) {
  const auto with = [](const std::string& filters) {
    return refusal_with("jpeg_quality: 90}", "jpeg_quality: 90, bayer: {" + filters + "}}");
  };
  EXPECT_EQ(with("red_to_green_ratio: 0.6, blue_to_green_ratio: 0.5"), "");
  EXPECT_THAT(with("red_to_green_ratio: 0, blue_to_green_ratio: 0.5"),
              testing::HasSubstr(
                  "processing.bayer.red_to_green_ratio: 0 (of what green filters pass) is not "
                  "within 0.05 and 2"));
  EXPECT_THAT(with("red_to_green_ratio: 0.6"), testing::HasSubstr("blue_to_green_ratio"));
}

TEST(ReadSceneFile, RejectsChipsOutOfRangeOrLargerThanDisc) {
  const auto with = [](const std::string& chips) {
    return refusal_with("rim_to_center_ratio: 0.8}",
                        "rim_to_center_ratio: 0.8, chips: {" + chips + "}}");
  };
  const std::string chips = "scene.yaml:10: lamps[0].chips.";
  EXPECT_EQ(with("fraction: 0.3, pitch_m: 0.03, width_m: 0.02"), "");
  EXPECT_EQ(with("fraction: 3, pitch_m: 0.03, width_m: 0.02"),
            chips +
                "fraction: 3 (of the source's radiance) is not within 0 and 1 (of the source's "
                "radiance): is it in the right unit?");
  EXPECT_EQ(with("fraction: 0.3, pitch_m: 0.2, width_m: 0.02"),
            chips + "pitch_m: is larger than the disc, diameter_m");
  EXPECT_EQ(with("fraction: 0.3, pitch_m: 0.03, width_m: 0.07"),
            chips + "width_m: is more than twice pitch_m: such chips are an even disc");
}

TEST(ReadSceneFile, RejectsRandomChipsOutOfRangeOrTogetherWithChips) {
  const auto with = [](const std::string& keys) {
    return refusal_with("rim_to_center_ratio: 0.8}", "rim_to_center_ratio: 0.8, " + keys + "}");
  };
  const std::string random = "random_chips: {count: 7, sigma_fraction: 0.12, ";
  const std::string chips = "scene.yaml:10: lamps[0].random_chips";
  EXPECT_EQ(with(random + "within_fraction: 0.75, excess: [0.3, 0.8]}"), "");
  EXPECT_EQ(
      with(random + "within_fraction: 1.75, excess: [0.3, 0.8]}"),
      chips +
          ".within_fraction: 1.75 (of the disc's radius) is not within 0 and 1 (of the disc's "
          "radius): is it in the right unit?");
  EXPECT_EQ(with(random + "within_fraction: 0.75, excess: [0.8, 0.3]}"),
            chips + ".excess: should be [least, most]");
  EXPECT_EQ(with("chips: {fraction: 0.3, pitch_m: 0.03, width_m: 0.02}, " + random +
                 "within_fraction: 0.75, excess: [0.3, 0.8]}"),
            chips + ": excludes chips: a disc has one of them; leave one out");
}

TEST(ReadSceneFile, RejectsRecessSlopeOrExponentOutOfRange) {
  const auto with = [](const std::string& keys) {
    return refusal_with("depth_m: 0.07,", "depth_m: 0.07, " + keys + ",");
  };
  EXPECT_EQ(with("source_power: 1.5, rim_power: 6, beam_power: 7, far_side_slope: 0.06"), "");
  EXPECT_THAT(with("far_side_slope: 0"), testing::HasSubstr("recess.far_side_slope: 0 (meters"));
  EXPECT_THAT(with("beam_power: -1"), testing::HasSubstr("recess.beam_power: -1"));
}

TEST(ReadSceneFile, RejectsForeignLightWithoutWaveOrOutOfRange) {
  const auto with = [](const std::string& keys) {
    return refusal_with(
        "clutter:\n", "clutter:\n  foreign_lights: [{position_m: [0, 0.2, 1.6], " + keys + "}]\n");
  };
  const std::string disc =
      "diameter_m: 0.2, electron_rate_e_per_s: 1.0e+8, rim_to_center_ratio: 1, ";
  const std::string place = "scene.yaml:13: clutter.foreign_lights[0]";
  EXPECT_EQ(with(disc + "pwm: {frequency_hz: 500, duty: 0.3}"), "");
  EXPECT_EQ(with(disc + "mains: {frequency_hz: 100, depth: 0.3}, phase: 0.5"), "");
  EXPECT_EQ(with("shape: rectangle, size_m: [0.6, 0.1], electron_rate_e_per_s: 1.0e+8, "
                 "mains: {frequency_hz: 100, depth: 0.3}"),
            "");
  EXPECT_EQ(with(disc + "phase: 0.5"), place + ": needs one of the keys pwm and mains");
  EXPECT_THAT(with(disc + "pwm: {frequency_hz: 500, duty: 0}"),
              testing::StartsWith(place + ".pwm.duty: 0 (of a period)"));
  EXPECT_THAT(with(disc + "mains: {frequency_hz: 50000, depth: 0.3}"),
              testing::StartsWith(place + ".mains.frequency_hz: 50000 Hz"));
  EXPECT_THAT(with(disc + "mains: {frequency_hz: 100, depth: 1.3}"),
              testing::StartsWith(place + ".mains.depth: 1.3"));
}

TEST(ReadSceneFile, RejectsInvalidMirrorBlindSignOrAmbientFlicker) {
  const auto with = [](const std::string& line) {
    return refusal_with("clutter:\n", "clutter:\n  " + line + "\n");
  };
  const std::string panel = "corner_m: [0.9, 0, 1.5], edges_m: [[0, 0.3, 0], [0, 0, 0.2]], ";
  EXPECT_EQ(with("mirrors: [{" + panel + "reflectance: 0.1}]"), "");
  EXPECT_THAT(with("mirrors: [{" + panel + "reflectance: 10}]"),
              testing::StartsWith("scene.yaml:13: clutter.mirrors[0].reflectance: 10"));
  EXPECT_THAT(with("mirrors: [{" + panel + "reflectance: 0.1, electron_rate_e_per_s: 1}]"),
              testing::HasSubstr("key 'electron_rate_e_per_s' is unknown"));
  const std::string lit = panel + "electron_rate_e_per_s: 1.0e+8, ";
  EXPECT_EQ(with("blinds: [{" + lit + "slats: 9, open_fraction: 0.5}]"), "");
  EXPECT_THAT(with("blinds: [{" + lit + "slats: 0, open_fraction: 0.5}]"),
              testing::StartsWith("scene.yaml:13: clutter.blinds[0].slats: should be a whole"));
  EXPECT_EQ(with("signs: [{" + lit + "lines: 2, letters: 8}]"), "");
  EXPECT_THAT(with("signs: [{" + lit + "lines: 2}]"), testing::HasSubstr("letters"));
  EXPECT_EQ(with("ambient_flicker: {frequency_hz: 120, depth: 0.3}"), "");
  EXPECT_THAT(with("ambient_flicker: {depth: 0.3}"), testing::HasSubstr("frequency_hz"));
}

TEST(ReadSceneFile, RejectsDiscKeysForRectangularLamp) {
  const std::string disc =
      "diameter_m: 0.18, frequency_hz: 1600, duty: 0.4, "
      "electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}";
  const auto with = [&](const std::string& keys) {
    return refusal_with(disc,
                        keys + ", frequency_hz: 1600, duty: 0.4, electron_rate_e_per_s: 2.0e+8}");
  };
  const std::string shape = "shape: rectangle, size_m: [0.6, 0.3], yaw_rad: 0.1";
  EXPECT_EQ(with(shape), "");
  EXPECT_THAT(with(shape + ", rim_to_center_ratio: 1"),
              testing::StartsWith("scene.yaml:10: lamps[0]: key 'rim_to_center_ratio' is unknown"));
  EXPECT_THAT(with(shape + ", chips: {fraction: 0.3, pitch_m: 0.03, width_m: 0.02}"),
              testing::StartsWith("scene.yaml:10: lamps[0]: key 'chips' is unknown"));
  EXPECT_EQ(with(shape + ", diameter_m: 0.2"),
            "scene.yaml:10: lamps[0].diameter_m: is of a disc, and this is a rectangle: it has "
            "a size_m");
  EXPECT_THAT(with("shape: rectangle, yaw_rad: 0"), testing::HasSubstr("size_m"));
}

TEST(ReadSceneFile, RejectsRimToCenterRatioWithRecess) {
  EXPECT_EQ(
      refusal_with("recess: {", "rim_to_center_ratio: 1, recess: {"),
      "scene.yaml:13: clutter.steady_lamps[1]: key 'rim_to_center_ratio' is unknown; the keys are: "
      "position_m, shape, diameter_m, size_m, yaw_rad, electron_rate_e_per_s, recess, halo");
}

TEST(ReadSceneFile, RejectsInvalidImageProcessing) {
  const std::string gamma = "scene.yaml:29: processing.gamma: ";
  EXPECT_EQ(refusal_with("gamma: 2.2", "gamma: 0"),
            gamma +
                "0 (of the tone curve) is not within 0.1 and 10 (of the tone curve): is it in "
                "the right unit?");
  EXPECT_EQ(refusal_with("gamma: 2.2", "gamma: -2.2"),
            gamma +
                "-2.2 (of the tone curve) is not within 0.1 and 10 (of the tone curve): is it "
                "in the right unit?");
  EXPECT_EQ(
      refusal_with("jpeg_quality: 90", "jpeg_quality: 0"),
      "scene.yaml:29: processing.jpeg_quality: should be a whole number within 1 and 100, not "
      "'0'");
  EXPECT_EQ(
      refusal_with("jpeg_quality: 90", "jpeg_quality: 101"),
      "scene.yaml:29: processing.jpeg_quality: should be a whole number within 1 and 100, not "
      "'101'");
  EXPECT_EQ(refusal_with("bits: 8", "bits: 16"),
            "scene.yaml:29: processing.jpeg_quality: JPEG has 8 bits: set sensor.bits to 8");
  EXPECT_EQ(
      refusal_with("radius_px: 1.5", "radius_px: 0"),
      "scene.yaml:29: processing.sharpening.radius_px: 0 px is not within 0.3 and 50 px: is it "
      "in the right unit?");
  EXPECT_EQ(refusal_with("black_level_dn: 2", "black_level_dn: 255"),
            "scene.yaml:29: processing: needs levels between sensor.black_level_dn and white");
}

TEST(ReadSceneFile, RejectsPanelEdgesThatFormNoRectangle) {
  const std::string problem = "should be at right angles to each other and not of length zero";
  EXPECT_EQ(refusal_with("[0, 0.3, 0]", "[0.01, 0.3, 0]"),
            "scene.yaml:14: clutter.windows[0].edges_m: " + problem);
  EXPECT_EQ(refusal_with("[0, 0.3, 0]", "[0, 0, 0]"),
            "scene.yaml:14: clutter.windows[0].edges_m: " + problem);
  EXPECT_EQ(refusal_with("[-0.2, 0.2, 0]", "[0.2, 0.2, 0]"),
            "scene.yaml:16: clutter.occluders[0].edges_m: " + problem);
  EXPECT_EQ(refusal_with("[[0.1, 0.1, 0], [-0.2, 0.2, 0]]", "[[0.1, 0.1, 0]]"),
            "scene.yaml:16: clutter.occluders[0].edges_m: should be two vectors, from the corner "
            "along each edge");
}

TEST(ReadSceneFile, RejectsOccluderNotBelowEveryLight) {
  const std::string problem =
      "scene.yaml:16: clutter.occluders[0]: is not below every lamp and other light";
  EXPECT_EQ(refusal_with("[-0.7, -0.2, 1.4]", "[-0.7, -0.2, 1.49]"), "");
  EXPECT_EQ(refusal_with("[-0.7, -0.2, 1.4]", "[-0.7, -0.2, 1.51]"), problem) << "lamp 5";
  EXPECT_EQ(refusal_with("[[0.1, 0.1, 0], [-0.2, 0.2, 0]]", "[[0.1, 0.1, 0], [0, 0, 0.2]]"),
            problem);
  EXPECT_EQ(refusal_with("[0.3, 0, 1.6]", "[0.3, 0, 1.3]"), problem) << "the steady lamp";
  EXPECT_EQ(refusal_with("[0.2, 0.1, 1.6]", "[0.2, 0.1, 1.3]"), problem) << "the reflection";
  EXPECT_EQ(refusal_with("[0, 0.3, 0]", "[0, 0, -0.3]"), problem) << "the window";
}

TEST(ReadSceneFile, RejectsReflectionOfUnknownLamp) {
  EXPECT_EQ(refusal_with("of_lamp: 5", "of_lamp: 2"),
            "scene.yaml:15: clutter.reflections[0].of_lamp: there is no lamp 2");
  EXPECT_EQ(refusal_with("of_lamp: 5", "of_lamp: -5"),
            "scene.yaml:15: clutter.reflections[0].of_lamp: should be a whole number within 0 and "
            "2147483647, not '-5'");
}

TEST(ReadSceneFile, RejectsReflectionSizeOfOtherShape) {
  const std::string place = "scene.yaml:15: clutter.reflections[0]";
  EXPECT_EQ(refusal_with("diameter_m: 0.22", "shape: rectangle, size_m: [0.6, 0.1]"), "");
  EXPECT_EQ(refusal_with("diameter_m: 0.22", "size_m: [0.6, 0.1]"),
            place + ".size_m: is of a rectangle: say 'shape: rectangle', too");
  EXPECT_EQ(refusal_with("diameter_m: 0.22", "diameter_m: 0.22, shape: rectangle"),
            place + ".diameter_m: is of a disc, and this is a rectangle: it has a size_m");
}

TEST(ReadSceneFile, RejectsSteadyLampOrBoardWarpOutOfRange) {
  EXPECT_EQ(refusal_with("diameter_m: 0.12", "diameter_m: 120"),
            "scene.yaml:13: clutter.steady_lamps[0].diameter_m: 120 m is not within 0.001 and 10 "
            "m: is it in the right unit?");
  EXPECT_EQ(
      refusal_with("rim_to_center_ratio: 0.7", "rim_to_center_ratio: -0.7"),
      "scene.yaml:13: clutter.steady_lamps[0].rim_to_center_ratio: -0.7 (of the radiance at the "
      "center) is not within 0 and 2 (of the radiance at the center): is it in the right "
      "unit?");
  EXPECT_EQ(refusal_with("[0.0003, -0.0002]", "[0.3, -0.2]"),
            "scene.yaml:20: board.warp_m[0]: 0.3 m is not within -0.009 and 0.009 m: is it in the "
            "right unit?");
}

}  // namespace
}  // namespace vlp
