// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Scenes that are rejected with file, line and key. The room of the sample is 2 x 1 x 1.7 m, its
/// lever arm 5 cm.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "simulation/scene_sample.h"

namespace vlp {
namespace {

using testing::StartsWith;

/// A change of the sample, and the beginning of the message after "scene.yaml:"; empty if it is
/// valid.
struct Change {
  std::string from, to, message;
};

void expect_messages(const std::vector<Change>& changes) {
  for (const auto& [from, to, message] : changes) {
    const std::string refusal = refusal_with(from, to);
    EXPECT_THAT(refusal, message.empty() ? StartsWith("") : StartsWith("scene.yaml:" + message))
        << from << " -> " << to;
    EXPECT_EQ(refusal.empty(), message.empty()) << refusal;
  }
}

TEST(ReadSceneFile, RejectsUnknownKeyInEachSection) {
  EXPECT_EQ(scene_refusal(kSceneYaml), "");
  for (const auto& [before, place] : std::vector<std::pair<std::string, std::string>>{
           {"seed: 7", "2"},
           {"x_m: [-1", "3: room"},
           {"id: small", "4: camera"},
           {"blur_px", "5: optics"},
           {"bits", "6: sensor"},
           {"fraction: 0.3", "6: sensor.bloom"},
           {"tilt_deg", "7: mount"},
           {"id: 5", "11: lamps[1]"},
           {"fraction: 0.02", "11: lamps[1].halo"},
           {"depth_m", "13: clutter.steady_lamps[1].recess"},
           {"reflector_ratio: 0.05", "13: clutter.steady_lamps[1].recess.dark_side"},
           {"gamma", "29: processing"},
           {"amount", "29: processing.sharpening"},
           {"position_m: [0.3", "13: clutter.steady_lamps[0]"},
           {"corner_m: [-0.9", "14: clutter.windows[0]"},
           {"of_lamp", "15: clutter.reflections[0]"},
           {"corner_m: [-0.7", "16: clutter.occluders[0]"},
           {"family", "18: board.pattern"},
           {"margin_m", "19: board"},
           {"windows", "14: clutter"},
           {"folder: spots", "25: captures[0]"},
           {"x_m: [-0.6, 0.6]", "26: captures[1].grid"},
           {"count: 4", "26: captures[1].turn"},
           {"from_m", "27: captures[2].drive"},
           {"count: 5", "28: captures[3].views"}}) {
    const bool is_block = place == "2" || place == "19: board" || place == "14: clutter";
    const std::string end = !is_block ? ", " : place == "2" ? "\n" : "\n  ";
    EXPECT_THAT(refusal_with(before, "nonsense: 1" + end + before),
                StartsWith("scene.yaml:" + place + ": key 'nonsense' is unknown; the keys are: "));
  }
}

TEST(ReadSceneFile, NamesMissingKeyOfEachSection) {
  for (const auto& [text, place, key] : std::vector<Change>{
           {"format: vlp-scene/1\n", "1: ", "format"},
           {"seed: 7\n", "1: ", "seed"},
           {"ambient_e_per_s: 1.0e+6\n", "1: ", "ambient_e_per_s"},
           {"x_m: [-1, 1], ", "3: room: ", "x_m"},
           {", row_time_s: 3.0e-5", "4: camera: ", "row_time_s"},
           {", readout: columns", "4: camera: ", "readout"},
           {"vignetting_power: 4", "5: optics: ", "vignetting_power"},
           {"full_well_e: 13000, ", "6: sensor: ", "full_well_e"},
           {"fraction: 0.3, ", "6: sensor.bloom: ", "fraction"},
           {", lever_arm_m: [0.03, -0.04]", "7: mount: ", "lever_arm_m"},
           // Optional in a lamp map, not here.
           {"diameter_m: 0.18, ", "10: lamps[0]: ", "diameter_m"},
           {"frequency_hz: 1600, ", "10: lamps[0]: ", "frequency_hz"},
           {"duty: 0.4, ", "10: lamps[0]: ", "duty"},
           {", rim_to_center_ratio: 0.8", "10: lamps[0]: ", "rim_to_center_ratio"},
           {", length_m: 0.015", "11: lamps[1].halo: ", "length_m"},
           {"depth_m: 0.07, ", "13: clutter.steady_lamps[1].recess: ", "depth_m"},
           {"source_diameter_m: 0.04, ",
            "13: clutter.steady_lamps[1].recess: ", "source_diameter_m"},
           {" reflector_ratio: 0.1,", "13: clutter.steady_lamps[1].recess: ", "reflector_ratio"},
           {", azimuth_deg: 90", "13: clutter.steady_lamps[1].recess.dark_side: ", "azimuth_deg"},
           {"gamma: 2.2, ", "29: processing: ", "gamma"},
           {", radius_px: 1.5", "29: processing.sharpening: ", "radius_px"},
           {"of_lamp: 5, ", "15: clutter.reflections[0]: ", "of_lamp"},
           {"  margin_m: 0.02\n", "18: board: ", "margin_m"},
           {"exposure_s: 5.0e-5, ", "25: captures[0]: ", "exposure_s"},
           {", interval_s: 0.5", "25: captures[0]: ", "interval_s"},
           {"heights_m: [0, 0.2], ", "25: captures[0]: ", "heights_m"},
           {", columns: 3", "26: captures[1].grid: ", "columns"},
           {"count: 4, ", "26: captures[1].turn: ", "count"},
           {", speed_m_per_s: 0.5", "27: captures[2].drive: ", "speed_m_per_s"},
           {"field_coverage: 0.75, ", "28: captures[3].views: ", "field_coverage"}}) {
    EXPECT_THAT(refusal_with(text, ""),
                StartsWith("scene.yaml:" + place + "key '" + key + "' is missing"));
  }
}

TEST(ReadSceneFile, RejectsInvalidCameraSensorAndProcessing) {
  expect_messages({{"vlp-scene/1", "vlp-scene/2", "1: format: "},
                   {"seed: 7", "seed: -1", "2: seed: "},
                   {"seed: 7", "seed: 7\nseed: 8", "3: key 'seed' occurs twice"},
                   {"z_m: [0, 1.7]", "z_m: [1.7, 0]", "3: room.z_m: "},
                   {"[160, 120]", "[160, 4]", "4: camera.imager_px[1]: "},
                   {"[160, 120]", "[20000, 20000]", "4: camera.imager_px: "},
                   {"[100, 101,", "[0, 101,", "4: camera.intrinsics: "},
                   {"blur_px: 0.7", "blur_px: .nan", "5: optics.blur_px: "},
                   {"bits: 8", "bits: 12", "6: sensor.bits: "},
                   {"bits: 8", "bits: 32", "6: sensor.bits: "},
                   {"gain_dn_per_e: 0.02", "gain_dn_per_e: 0", "6: sensor.gain_dn_per_e: "},
                   {"black_level_dn: 2", "black_level_dn: 256", "6: sensor.black_level_dn: "},
                   {"full_well_e: 13000", "full_well_e: 0", "6: sensor.full_well_e: "},
                   {"shot_noise: true", "shot_noise: yes", "6: sensor.shot_noise: "},
                   {"fraction: 0.3", "fraction: 30", "6: sensor.bloom.fraction: "},
                   {"tilt_deg: 2,", "tilt_deg: 100,", "7: mount.tilt_deg: "},
                   {"[0.03, -0.04]", "[30, -40]", "7: mount.lever_arm_m[0]: "},
                   {"gamma: 2.2", "gamma: 0", "29: processing.gamma: "},
                   {"gamma: 2.2", "gamma: -2.2", "29: processing.gamma: "},
                   {"jpeg_quality: 90", "jpeg_quality: 0", "29: processing.jpeg_quality: "},
                   {"jpeg_quality: 90", "jpeg_quality: 101", "29: processing.jpeg_quality: "},
                   {"bits: 8", "bits: 16", "29: processing.jpeg_quality: "},
                   {"radius_px: 1.5", "radius_px: 0", "29: processing.sharpening.radius_px: "},
                   {"black_level_dn: 2", "black_level_dn: 255", "29: processing: "}});
  std::string deep = scene_with("bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2",
                                "bits: 16, gain_dn_per_e: 0.02, black_level_dn: 256");
  const std::string jpeg = ", jpeg_quality: 90";
  EXPECT_EQ(scene_refusal(deep.erase(deep.find(jpeg), jpeg.size())), "");
  const auto with = [](const std::string& filters) {
    return refusal_with("jpeg_quality: 90}", "jpeg_quality: 90, bayer: {" + filters + "}}");
  };
  EXPECT_EQ(with("red_to_green_ratio: 0.6, blue_to_green_ratio: 0.5"), "");
  EXPECT_THAT(with("red_to_green_ratio: 0, blue_to_green_ratio: 0.5"),
              StartsWith("scene.yaml:29: processing.bayer.red_to_green_ratio: "));
  EXPECT_THAT(with("red_to_green_ratio: 0.6"), StartsWith("scene.yaml:29: processing.bayer: "));
}

TEST(ReadSceneFile, RejectsInvalidLampsAndClutter) {
  const std::string rate = "electron_rate_e_per_s: ",
                    recess = "13: clutter.steady_lamps[1].recess.",
                    occluder = "16: clutter.occluders[0]: ", disc = "rim_to_center_ratio: 0.8";
  const std::string random = "random_chips: {count: 7, sigma_fraction: 0.12, ";
  const std::string chips = "chips: {fraction: 0.3, pitch_m: 0.03, width_m: 0.02}";
  expect_messages({
      {"ambient_e_per_s: 1.0e+6", "ambient_e_per_s: -1", "8: ambient_e_per_s: "},
      {rate + "2.0e+8", rate + "-5", "10: lamps[0]." + rate},
      {rate + "3.0e+8", rate + "2.5e+13", "11: lamps[1]." + rate},
      {rate + "1.5e+8", rate + "-2", "13: clutter.steady_lamps[0]." + rate},
      {rate + "8.0e+7", rate + "-2", "14: clutter.windows[0]." + rate},
      {rate + "1.2e+7", rate + "-2", "15: clutter.reflections[0]." + rate},
      {rate + "2.0e+6", rate + "-2", "16: clutter.occluders[0]." + rate},
      {"black_e_per_s: 1.5e+5", "black_e_per_s: -2", "22: board.black_e_per_s: "},
      {"[0.0003, -0.0002]", "[0.3, -0.2]", "20: board.warp_m[0]: "},
      {"warp_m: [0.0003, -0.0002]", "warp_m: 0.0003", "20: board.warp_m: "},
      {"[-0.6, -0.3, 1.6]", "[-0.6, -0.3, 16]", "10: lamps[0].position_m: "},
      {"[0.3, 0, 1.6]", "[3, 0, 1.6]", "13: clutter.steady_lamps[0].position_m: "},
      {"[0.2, 0.1, 1.6]", "[0.2, 1, 1.6]", "15: clutter.reflections[0].position_m: "},
      {"id: 5,", "id: 1,", "11: lamps[1]: id 1 occurs twice"},
      {"[0.6, 0.2, 1.5]", "[-0.6, -0.3, 1.6]", "11: lamps[1]: "},
      {"phase: 0.25", "phase: 90", "11: lamps[1].phase: "},
      {"[0.001, 0.002, 0.003]", "[0.001, 0.002]", "11: lamps[1].map_error_m: "},
      {"depth_m: 0.07", "depth_m: -0.07", recess + "depth_m: "},
      {"depth_m: 0.07", "depth_m: 0", ""},
      {"source_diameter_m: 0.04", "source_diameter_m: 0.15", recess + "source_diameter_m: "},
      {"source_diameter_m: 0.04", "source_diameter_m: 0.14", ""},
      {"source_diameter_m: 0.04", "source_diameter_m: 0", recess + "source_diameter_m: "},
      {"reflector_ratio: 0.1", "reflector_ratio: 10", recess + "reflector_ratio: "},
      {"depth_m: 0.07,", "depth_m: 0.07, source_power: 1.5, rim_power: 6, beam_power: 7,", ""},
      {"depth_m: 0.07,", "depth_m: 0.07, far_side_slope: 0,", recess + "far_side_slope: "},
      {"depth_m: 0.07,", "depth_m: 0.07, beam_power: -1,", recess + "beam_power: "},
      {"recess: {", "rim_to_center_ratio: 1, recess: {", "13: clutter.steady_lamps[1]: key 'rim_"},
      {"fraction: 0.02", "fraction: -0.02", "11: lamps[1].halo.fraction: "},
      {"length_m: 0.015", "length_m: 0", "11: lamps[1].halo.length_m: "},
      {"diameter_m: 0.12", "diameter_m: 120", "13: clutter.steady_lamps[0].diameter_m: "},
      {"rim_to_center_ratio: 0.7", "rim_to_center_ratio: -0.7",
       "13: clutter.steady_lamps[0].rim_to_center_ratio: "},
      {disc, disc + ", " + chips, ""},
      {disc, disc + ", chips: {fraction: 3, pitch_m: 0.03, width_m: 0.02}",
       "10: lamps[0].chips.fraction: "},
      {disc, disc + ", chips: {fraction: 0.3, pitch_m: 0.2, width_m: 0.02}",
       "10: lamps[0].chips.pitch_m: "},
      {disc, disc + ", chips: {fraction: 0.3, pitch_m: 0.03, width_m: 0.07}",
       "10: lamps[0].chips.width_m: "},
      {disc, disc + ", " + random + "within_fraction: 0.75, excess: [0.3, 0.8]}", ""},
      {disc, disc + ", " + random + "within_fraction: 1.75, excess: [0.3, 0.8]}",
       "10: lamps[0].random_chips.within_fraction: "},
      {disc, disc + ", " + random + "within_fraction: 0.75, excess: [0.8, 0.3]}",
       "10: lamps[0].random_chips.excess: "},
      {disc, disc + ", " + chips + ", " + random + "within_fraction: 0.75, excess: [0.3, 0.8]}",
       "10: lamps[0].random_chips: excludes chips"},
      {"[0, 0.3, 0]", "[0.01, 0.3, 0]", "14: clutter.windows[0].edges_m: "},
      {"[0, 0.3, 0]", "[0, 0, 0]", "14: clutter.windows[0].edges_m: "},
      {"[-0.2, 0.2, 0]", "[0.2, 0.2, 0]", "16: clutter.occluders[0].edges_m: "},
      {"[[0.1, 0.1, 0], [-0.2, 0.2, 0]]", "[[0.1, 0.1, 0]]", "16: clutter.occluders[0].edges_m: "},
      // Occluders are below all lights.
      {"[-0.7, -0.2, 1.4]", "[-0.7, -0.2, 1.49]", ""},
      {"[-0.7, -0.2, 1.4]", "[-0.7, -0.2, 1.51]", occluder},
      {"[[0.1, 0.1, 0], [-0.2, 0.2, 0]]", "[[0.1, 0.1, 0], [0, 0, 0.2]]", occluder},
      {"[0.3, 0, 1.6]", "[0.3, 0, 1.3]", occluder},
      {"[0.2, 0.1, 1.6]", "[0.2, 0.1, 1.3]", occluder},
      {"[0, 0.3, 0]", "[0, 0, -0.3]", occluder},
      {"of_lamp: 5", "of_lamp: 2", "15: clutter.reflections[0].of_lamp: "},
      {"of_lamp: 5", "of_lamp: -5", "15: clutter.reflections[0].of_lamp: "},
      {"diameter_m: 0.22", "shape: rectangle, size_m: [0.6, 0.1]", ""},
      {"diameter_m: 0.22", "size_m: [0.6, 0.1]", "15: clutter.reflections[0].size_m: "},
      {"diameter_m: 0.22", "diameter_m: 0.22, shape: rectangle",
       "15: clutter.reflections[0].diameter_m: "},
  });
}

TEST(ReadSceneFile, RejectsDiscKeysForRectangularLamp) {
  const std::string shape = "shape: rectangle, size_m: [0.6, 0.3], yaw_rad: 0.1",
                    wave = ", frequency_hz: 1600, duty: 0.4, electron_rate_e_per_s: 2.0e+8";
  const std::string disc = "diameter_m: 0.18" + wave + ", rim_to_center_ratio: 0.8";
  expect_messages(
      {{disc, shape + wave, ""},
       {disc, shape + wave + ", rim_to_center_ratio: 1", "10: lamps[0]: key 'rim_to_center_ratio'"},
       {disc, shape + wave + ", chips: {fraction: 0.3, pitch_m: 0.03, width_m: 0.02}",
        "10: lamps[0]: key 'chips' is unknown"},
       {disc, shape + wave + ", diameter_m: 0.2", "10: lamps[0].diameter_m: "},
       {disc, "shape: rectangle, yaw_rad: 0" + wave, "10: lamps[0]: key 'size_m' is missing"}});
}

TEST(ReadSceneFile, RejectsInvalidForeignLightMirrorBlindSignOrAmbientFlicker) {
  const auto add = [](const std::string& line) { return "clutter:\n  " + line + "\n"; };
  const std::string disc =
      "foreign_lights: [{position_m: [0, 0.2, 1.6], diameter_m: 0.2, electron_rate_e_per_s: "
      "1.0e+8, rim_to_center_ratio: 1, ";
  const std::string panel = "{corner_m: [0.9, 0, 1.5], edges_m: [[0, 0.3, 0], [0, 0, 0.2]], ";
  const std::string lit = panel + "electron_rate_e_per_s: 1.0e+8, ";
  const std::string light = "13: clutter.foreign_lights[0]";
  std::vector<Change> changes;
  for (const auto& [line, message] : std::vector<std::pair<std::string, std::string>>{
           {disc + "pwm: {frequency_hz: 500, duty: 0.3}}]", ""},
           {disc + "mains: {frequency_hz: 100, depth: 0.3}, phase: 0.5}]", ""},
           {disc + "phase: 0.5}]", light + ": needs one of the keys pwm and mains"},
           {disc + "pwm: {frequency_hz: 500, duty: 0}}]", light + ".pwm.duty: "},
           {disc + "mains: {frequency_hz: 50000, depth: 0.3}}]", light + ".mains.frequency_hz: "},
           {disc + "mains: {frequency_hz: 100, depth: 1.3}}]", light + ".mains.depth: "},
           {"mirrors: [" + panel + "reflectance: 0.1}]", ""},
           {"mirrors: [" + panel + "reflectance: 10}]", "13: clutter.mirrors[0].reflectance: "},
           {"mirrors: [" + lit + "reflectance: 0.1}]", "13: clutter.mirrors[0]: key 'electron_"},
           {"blinds: [" + lit + "slats: 9, open_fraction: 0.5}]", ""},
           {"blinds: [" + lit + "slats: 0, open_fraction: 0.5}]", "13: clutter.blinds[0].slats: "},
           {"signs: [" + lit + "lines: 2, letters: 8}]", ""},
           {"signs: [" + lit + "lines: 2}]", "13: clutter.signs[0]: key 'letters' is missing"},
           {"ambient_flicker: {frequency_hz: 120, depth: 0.3}", ""},
           {"ambient_flicker: {depth: 0.3}", "13: clutter.ambient_flicker: key 'frequency_hz' "}}) {
    changes.push_back({"clutter:\n", add(line), message});
  }
  expect_messages(changes);
}

TEST(ReadSceneFile, RejectsInvalidCaptures) {
  const std::string spots = "25: captures[0]", grid = "26: captures[1]", line = "27: captures[2]",
                    outside = ": moves the camera outside the room",
                    pivots = "[[0.1, -0.05], [-0.2, 0.3]]";
  expect_messages({
      {"[-0.2, 0.3]", "[-0.2, 0.6]", spots + ".pivots_m[1]" + outside},
      {"x_m: [-0.6, 0.6], y", "x_m: [-1.6, 0.6], y", grid + ".grid" + outside},
      {"y_m: [0.3, -0.3]", "y_m: [0.7, -0.3]", grid + ".grid" + outside},
      {"from_m: [-0.3, 0]", "from_m: [-1.1, 0]", line + ".drive.from_m" + outside},
      {"to_m: [0.5, 0.4]", "to_m: [0.5, -0.9]", line + ".drive.to_m" + outside},
      {"heights_m: [0.1]", "heights_m: [-0.1]", grid + ".heights_m[0]" + outside},
      // The lever arm is 5 cm.
      {"[-0.2, 0.3]", "[0.949, -0.449]", ""},
      {"[-0.2, 0.3]", "[0.951, -0.449]", spots + ".pivots_m[1]" + outside},
      {"[-0.2, 0.3]", "[0.949, -0.451]", spots + ".pivots_m[1]" + outside},
      {"y_m: [0.3, -0.3]", "y_m: [0.451, -0.3]", grid + ".grid" + outside},
      {"to_m: [0.5, 0.4]", "to_m: [0.5, 0.451]", line + ".drive.to_m" + outside},
      {"[0, 0.2]", "[0, 1.5]", spots + ".heights_m[1]: lamp 5 is not above the camera"},
      {"[0, 0.2]", "[0, 1.65]", spots + ".heights_m[1]: lamp 1 is not above the camera"},
      {"exposure_s: 5.0e-5", "exposure_s: -0.5", spots + ".exposure_s: "},
      {"interval_s: 0.5", "interval_s: 0", spots + ".interval_s: "},
      {"repeat: 3", "repeat: 0", spots + ".repeat: "},
      {"repeat: 3", "repeat: 1000000", spots + ": makes more than 1000000 captures"},
      {"known: true", "known: 1", spots + ".known: "},
      {"columns: 3", "columns: 1", grid + ".grid.columns: "},
      {"speed_m_per_s: 0.5", "speed_m_per_s: 0", line + ".drive.speed_m_per_s: "},
      {"speed_m_per_s: 0.5", "speed_m_per_s: 1.0e-6", line + ".drive: makes more than 1000000"},
      {"to_m: [0.5, 0.4]", "to_m: [-0.3, 0]", line + ".drive: has no length"},
      {"distance_m: [0.2, 0.4]", "distance_m: [0.4, 0.2]", "28: captures[3].views.distance_m: "},
      {"tilt_deg: 45", "tilt_deg: 90", "28: captures[3].views.tilt_deg: "},
      {"pivots_m: " + pivots + ", ", "", spots + ": needs one of the keys pivots_m, grid,"},
      {"folder: grid,", "folder: grid, pivots_m: [[0, 0]],", grid + ": needs one of the keys"},
      {"folder: line,", "folder: line, pivots_m: [[0, 0]],", line + ": needs one of the keys"},
      {"folder: boards,", "folder: boards, pivots_m: [[0, 0]],", "28: captures[3]: key 'pivots_m'"},
      {"yaws_deg: [20, -90], ", "", spots + ": needs one of the keys yaws_deg and turn"},
      {"folder: grid,", "folder: grid, yaws_deg: [0],", grid + ": needs one of the keys yaws_deg"},
      {pivots, "[]", spots + ".pivots_m: "},
      {"heights_m: [0, 0.2]", "heights_m: []", spots + ".heights_m: "},
      {"yaws_deg: [20, -90]", "yaws_deg: []", spots + ".yaws_deg: "},
      {"folder: line", "folder: spots", line + ": folder 'spots' occurs twice"},
      {"folder: spots", "folder: Spots-2_b", ""},
  });
  for (const std::string name : {"../spots", "..", ".", "a/b", "/tmp", "''", "a.b", "a b", "ä"}) {
    expect_messages({{"folder: spots", "folder: " + name, spots + ".folder: "}});
  }
  EXPECT_THAT(
      scene_refusal(kSceneYaml.substr(0, kSceneYaml.find("captures:\n")) + "captures: []\n"),
      StartsWith("scene.yaml:24: captures: "));
}

TEST(ReadSceneFile, RejectsCapturesOfMissingBoardOrLamps) {
  const auto without = [](const std::string& from, const std::string& to) {
    std::string yaml = kSceneYaml;
    const auto begin = yaml.find(from);
    return yaml.erase(begin, yaml.find(to, begin) - begin);
  };
  EXPECT_THAT(scene_refusal(without("board:\n", "captures:\n")),
              StartsWith("scene.yaml:21: captures[3]: "));
  EXPECT_THAT(scene_refusal(without("lamps:\n", "board:\n")),
              StartsWith("scene.yaml:17: captures[0]: "));
  // A light below the camera, without the occluder that has to be below it.
  for (const char* light : {"[0.3, 0, 1.6]", "[0.2, 0.1, 1.6]"}) {
    std::string yaml = without("  occluders:", "board:\n");
    yaml.replace(yaml.find(light) + std::string(light).size() - 4, 3, "0.1");
    EXPECT_THAT(scene_refusal(yaml), StartsWith("scene.yaml:24: captures[0].heights_m[1]: "));
  }
}

}  // namespace
}  // namespace vlp
