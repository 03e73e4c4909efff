// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "small_simulation.h"

namespace vlp {

namespace fs = std::filesystem;

// clang-format off
const std::string kSmallScene = R"(format: vlp-scene/1
seed: 1
room: {x_m: [-1, 1], y_m: [-0.6, 0.6], z_m: [0, 1.6]}
camera:
  id: small
  imager_px: [160, 120]
  lens_model: LENSMODEL_OPENCV8
  intrinsics: [100, 101, 80.5, 59, -0.25, 0.08, 0.0002, -0.0001, -0.012, 0.01, 0.002, 0.0001]
  row_time_s: 3.0e-5
  readout: rows
optics: {blur_px: 0.5, vignetting_power: 4}
sensor: {bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2, full_well_e: 13000, read_noise_e: 8, shot_noise: true}
mount: {tilt_deg: 3, tilt_azimuth_deg: 50, lever_arm_m: [0.05, -0.03]}
ambient_e_per_s: 1.0e+6
lamps:
  - {id: 1, position_m: [-0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 1600, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8, map_error_m: [0.01, 0, 0]}
  - {id: 2, position_m: [0.5, -0.35, 1.4], diameter_m: 0.18, frequency_hz: 2500, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 3, position_m: [-0.4, 0.3, 1.3], diameter_m: 0.18, frequency_hz: 3100, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 4, position_m: [0.6, 0.4, 1.5], diameter_m: 0.18, frequency_hz: 4700, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
board:
  pattern: {family: tag36h11, cols: 3, rows: 2, tag_size_m: 0.03, tag_spacing: 1, border_bits: 1, corner_squares: false, first_id: 0, id_order: row-major-from-top-left}
  margin_m: 0.02
  warp_m: [0.0003, -0.0002]
  white_e_per_s: 2.4e+6
  black_e_per_s: 1.5e+5
  surround_e_per_s: 6.0e+5
captures:
  - {folder: lamps, exposure_s: 5.0e-5, grid: {x_m: [-0.4, 0.4], y_m: [-0.2, 0.2], columns: 2, rows: 2}, heights_m: [0, 0.3], turn: {count: 2, jitter_deg: 90}, interval_s: 0.5}
  - {folder: boards, exposure_s: 0.004, views: {count: 8, distance_m: [0.2, 0.3], tilt_deg: 40, roll_deg: 180, field_coverage: 0.5}}
)";
// clang-format on

Files files_below(const fs::path& folder) {
  Files files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file() || entry.path().filename().string().starts_with('.')) continue;
    files[fs::relative(entry.path(), folder).string()] =
        TemporaryFolder::read_content(entry.path());
  }
  return files;
}

std::vector<std::string> find_images(const Files& files) {
  std::vector<std::string> images;
  for (const auto& [name, content] : files) {
    if (name.ends_with(".png")) images.push_back(name);
  }
  return images;
}

void SmallSimulation::change_scene(const std::string& from, const std::string& to) {
  std::string yaml = TemporaryFolder::read_content(scene);
  const auto at = yaml.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  folder.file("scene.yaml", yaml.replace(at, from.size(), to));
}

Files SmallSimulation::undisturbed(const std::string& options) const {
  const auto elsewhere = folder / "undisturbed";
  fs::remove_all(elsewhere);
  const auto result =
      run_program("vlp-simulate " + scene.string() + " -o " + elsewhere.string() + " " + options);
  EXPECT_EQ(result.exit_code, 0) << result.errors;
  return files_below(elsewhere);
}

}  // namespace vlp
