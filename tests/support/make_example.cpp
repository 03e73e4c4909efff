// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Generates datasets/example: computed detections with noise of five lamps from 36 positions,
/// during a rotation in place, and during a rotation at a known reference point.
#include <algorithm>
#include <array>
#include <cstdio>

#include "captures/csv_writer.h"
#include "captures/detections_table.h"
#include "captures/number_text.h"
#include "evaluation/errors/floor_limits.h"
#include "geometry/angles.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

LampMap example_lamps() {
  LampMap map = make_lamp_map(
      {{-0.6, -0.35, 1.6}, {0.6, -0.35, 1.6}, {0.6, 0.35, 1.6}, {-0.6, 0.35, 1.6}, {0.05, 0, 1.5}});
  for (Lamp& lamp : map.lamps) {
    lamp.shape = make_disc_lamp_shape(0.1);
    lamp.frequency_hz = 1000 + 500 * lamp.id;
    lamp.duty = 0.5;
  }
  return map;
}

constexpr double kNoise_px = 0.05;

/// Returns the detections of the lamps that are fully in the image, as the frame `image`.
Frame make_frame(const SyntheticRig& rig, const char* name, int number, Random& random) {
  std::array<char, 32> image{};
  std::snprintf(image.data(), image.size(), "%s_%02d.png", name, number);
  const auto visible = list_visible_positions(rig.map, rig.calibration.camera, rig.camera);
  auto detections = seen_from(rig, kNoise_px);
  std::erase_if(detections, [&](const Detection& detection) {
    const auto& lamp = rig.map.lamps[static_cast<std::size_t>(detection.lamp - 1)];
    return std::find(visible.begin(), visible.end(), lamp.position_m) == visible.end();
  });
  return {image.data(), with_noise(detections, random)};
}

/// Returns twelve captures of a rotation in place at each of two heights, with a lever arm.
std::vector<Frame> turn(SyntheticRig rig, Random& random) {
  const Eigen::Vector2d axis_m(0.05, 0.02);
  const Eigen::Vector3d lever_arm_m(0.004, -0.002, 0);
  std::vector<Frame> frames;
  for (int i = 0; i < 24; ++i) {
    const double yaw_rad = rad_from_deg(30 * i + random.uniform(-8, 8));
    const Eigen::Vector3d at_m(axis_m.x(), axis_m.y(), i < 12 ? 0 : 0.3);
    rig.camera = {at_m + rotation_about_z(yaw_rad) * lever_arm_m, wrap_angle_rad(yaw_rad)};
    frames.push_back(make_frame(rig, "turn", i, random));
  }
  return frames;
}

/// Returns twelve captures at one position with different yaws.
std::vector<Frame> at_station(SyntheticRig rig, Random& random) {
  std::vector<Frame> frames;
  for (int i = 0; i < 12; ++i) {
    rig.camera = {{0.1, 0, 0}, wrap_angle_rad(rad_from_deg(30 * i + random.uniform(-8, 8)))};
    frames.push_back(make_frame(rig, "station", i, random));
  }
  return frames;
}

void make_example(const std::filesystem::path& folder) {
  SyntheticRig rig{example_lamps(), {synthetic_camera(), {}, {}, {}, {}}, {}, {}};
  rig.calibration.camera.id = "example";
  rig.calibration.camera.row_time_s = 30e-6;
  rig.calibration.camera.readout = Readout::rows;
  rig.calibration.rotation_center =
      tilted_by(rig.calibration.camera, rad_from_deg(1.3), rad_from_deg(40));
  Random random(1);
  std::filesystem::create_directories(folder);
  std::vector<Frame> frames;
  CsvWriter truth(folder / "truth.csv", {"image", "x_m", "y_m", "z_m", "yaw_rad"});
  for (int i = 0; i < 36; ++i) {
    rig.camera = {{-0.35 + 0.14 * (i % 6), -0.35 + 0.14 * (i / 6), 0.1 * (i % 4)},
                  wrap_angle_rad(rad_from_deg(100 * i))};
    frames.push_back(make_frame(rig, "spot", i, random));
    const Eigen::Vector3d& p = rig.camera.position_m;
    truth.write_csv_row({frames.back().image, format_fixed_decimals(p.x(), 6),
                         format_fixed_decimals(p.y(), 6), format_fixed_decimals(p.z(), 6),
                         format_fixed_decimals(rig.camera.yaw_rad, 9)});
  }
  write_lamp_map(folder / "lamps.yaml", rig.map);
  write_calibration(folder / "calibration.yaml", rig.calibration);
  write_detections(folder / "detections.csv", frames);
  truth.save_file();
  write_detections(folder / "turning.csv", turn(rig, random));
  write_detections(folder / "station.csv", at_station(rig, random));
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: make_example FOLDER\n"), 2;
  vlp::make_example(argv[1]);
}
