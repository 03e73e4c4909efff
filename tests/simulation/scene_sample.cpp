// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/scene_sample.h"

#include <stdexcept>

namespace vlp {

// clang-format off
const std::string kSceneYaml = R"(format: vlp-scene/1
seed: 7
room: {x_m: [-1, 1], y_m: [-0.5, 0.5], z_m: [0, 1.7]}
camera: {id: small, imager_px: [160, 120], lens_model: LENSMODEL_PINHOLE, intrinsics: [100, 101, 80, 60], pixel_pitch_m: 5.0e-6, row_time_s: 3.0e-5, readout: columns}
optics: {blur_px: 0.7, vignetting_power: 4}
sensor: {bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2, full_well_e: 13000, read_noise_e: 8, shot_noise: true, bloom: {fraction: 0.3, sigma_px: 2.5}}
mount: {tilt_deg: 2, tilt_azimuth_deg: 90, lever_arm_m: [0.03, -0.04]}
ambient_e_per_s: 1.0e+6
lamps:
  - {id: 1, position_m: [-0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 1600, duty: 0.4, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 5, position_m: [0.6, 0.2, 1.5], diameter_m: 0.1, frequency_hz: 2500, duty: 0.5, electron_rate_e_per_s: 3.0e+8, rim_to_center_ratio: 0.9, phase: 0.25, map_error_m: [0.001, 0.002, 0.003], halo: {fraction: 0.02, length_m: 0.015}}
clutter:
  steady_lamps: [{position_m: [0.3, 0, 1.6], diameter_m: 0.12, electron_rate_e_per_s: 1.5e+8, rim_to_center_ratio: 0.7}, {position_m: [-0.3, 0.1, 1.6], diameter_m: 0.14, electron_rate_e_per_s: 1.6e+8, recess: {depth_m: 0.07, source_diameter_m: 0.04, reflector_ratio: 0.1, dark_side: {reflector_ratio: 0.05, azimuth_deg: 90}}}]
  windows: [{corner_m: [-0.9, -0.1, 1.6], edges_m: [[0.25, 0, 0], [0, 0.3, 0]], electron_rate_e_per_s: 8.0e+7}]
  reflections: [{of_lamp: 5, position_m: [0.2, 0.1, 1.6], diameter_m: 0.22, electron_rate_e_per_s: 1.2e+7}]
  occluders: [{corner_m: [-0.7, -0.2, 1.4], edges_m: [[0.1, 0.1, 0], [-0.2, 0.2, 0]], electron_rate_e_per_s: 2.0e+6}]
board:
  pattern: {family: tag36h11, cols: 4, rows: 3, tag_size_m: 0.02, tag_spacing: 0.5, border_bits: 1, corner_squares: false, first_id: 9, id_order: row-major-from-top-left}
  margin_m: 0.02
  warp_m: [0.0003, -0.0002]
  white_e_per_s: 2.4e+6
  black_e_per_s: 1.5e+5
  surround_e_per_s: 6.0e+5
captures:
  - {folder: spots, exposure_s: 5.0e-5, pivots_m: [[0.1, -0.05], [-0.2, 0.3]], heights_m: [0, 0.2], yaws_deg: [20, -90], interval_s: 0.5, repeat: 3, known: true}
  - {folder: grid, exposure_s: 2.0e-5, grid: {x_m: [-0.6, 0.6], y_m: [0.3, -0.3], columns: 3, rows: 2}, heights_m: [0.1], turn: {count: 4, jitter_deg: 9}, turn_rate_deg_per_s: 90, interval_s: 2}
  - {folder: line, exposure_s: 5.0e-5, drive: {from_m: [-0.3, 0], to_m: [0.5, 0.4], speed_m_per_s: 0.5}, heights_m: [0], yaws_deg: [0], interval_s: 0.25}
  - {folder: boards, exposure_s: 0.004, views: {count: 5, distance_m: [0.2, 0.4], tilt_deg: 45, roll_deg: 180, field_coverage: 0.75, velocity_m_per_s: [0.1, 0, 0.2]}}
processing: {gamma: 2.2, sharpening: {amount: 0.6, radius_px: 1.5}, jpeg_quality: 90}
)";
// clang-format on

std::string scene_with(const std::string& from, const std::string& to) {
  std::string yaml = kSceneYaml;
  const auto at = yaml.find(from);
  if (at == std::string::npos) throw std::invalid_argument("the sample has no " + from);
  return yaml.replace(at, from.size(), to);
}

Scene read_scene_text(const std::string& yaml) {
  const TemporaryFolder folder;
  return read_scene_file(folder.file("scene.yaml", yaml));
}

std::string scene_refusal(const std::string& yaml) {
  const TemporaryFolder folder;
  const auto file = folder.file("scene.yaml", yaml);
  const std::string message = rejection_message([&] { read_scene_file(file); });
  const std::string parent = (folder / "").string();
  return message.starts_with(parent) ? message.substr(parent.size()) : message;
}

std::string refusal_with(const std::string& from, const std::string& to) {
  return scene_refusal(scene_with(from, to));
}

}  // namespace vlp
