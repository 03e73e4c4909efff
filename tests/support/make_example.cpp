// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Makes datasets/example: what a camera sees of five lamps from 36 places, computed, with noise.
#include <algorithm>
#include <array>
#include <cstdio>

#include "captures/csv_writer.h"
#include "captures/detections_table.h"
#include "geometry/angles.h"
#include "positioning/floor_limits.h"
#include "support/synthetic_rig.h"

namespace vlp {
namespace {

LampMap example_lamps() {
  LampMap map = lamp_map_of(
      {{-0.6, -0.35, 1.6}, {0.6, -0.35, 1.6}, {0.6, 0.35, 1.6}, {-0.6, 0.35, 1.6}, {0.05, 0, 1.5}});
  for (Lamp& lamp : map.lamps) {
    lamp.diameter_m = 0.1;
    lamp.frequency_hz = 1000 + 500 * lamp.id;
    lamp.duty = 0.5;
  }
  return map;
}

void make_example(const std::filesystem::path& folder) {
  constexpr double sigma_px = 0.05;
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
                  wrapped_rad(rad_from_deg(100 * i))};
    std::array<char, 32> image{};
    std::snprintf(image.data(), image.size(), "spot_%02d.png", i);
    const auto visible = visible_lamps(rig.map, rig.calibration.camera, rig.camera);
    auto detections = seen_from(rig, sigma_px);
    std::erase_if(detections, [&](const Detection& detection) {
      const auto& lamp = rig.map.lamps[static_cast<std::size_t>(detection.lamp - 1)];
      return std::find(visible.begin(), visible.end(), lamp.position_m) == visible.end();
    });
    frames.push_back({image.data(), with_noise(detections, random)});
    const Eigen::Vector3d& p = rig.camera.position_m;
    truth.row({image.data(), fixed(p.x(), 6), fixed(p.y(), 6), fixed(p.z(), 6),
               fixed(rig.camera.yaw_rad, 9)});
  }
  write_lamp_map(folder / "lamps.yaml", rig.map);
  write_calibration(folder / "calibration.yaml", rig.calibration);
  write_detections(folder / "detections.csv", frames);
  truth.save();
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: make_example FOLDER\n"), 2;
  vlp::make_example(argv[1]);
}
