// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "rendered_session.h"

#include <algorithm>

#include "simulation/simulate.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

// clang-format off
constexpr const char* kScene = R"(format: vlp-scene/1
seed: 1
room: {x_m: [-1, 1.5], y_m: [-0.6, 0.6], z_m: [0, 1.6]}
camera:
  id: unit-7
  imager_px: [400, 300]
  lens_model: LENSMODEL_OPENCV4
  intrinsics: [260, 260.3, 201.2, 148.7, -0.02, 0.004, 0.0002, -0.0001]
  row_time_s: 3.0e-5
  readout: rows
optics: {blur_px: 0.6, vignetting_power: 4}
sensor: {bits: 8, gain_dn_per_e: 0.02, black_level_dn: 2, full_well_e: 13000, read_noise_e: 8, shot_noise: true}
mount: {tilt_deg: 0.9, tilt_azimuth_deg: 60, lever_arm_m: [0.02, -0.01]}
ambient_e_per_s: 1.0e+6
lamps:
  - {id: 1, position_m: [-0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 2400, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 2, position_m: [0, -0.32, 1.6], diameter_m: 0.18, frequency_hz: 2900, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 3, position_m: [0.6, -0.3, 1.6], diameter_m: 0.18, frequency_hz: 3500, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 4, position_m: [-0.6, 0.3, 1.6], diameter_m: 0.18, frequency_hz: 4200, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 5, position_m: [0, 0.28, 1.6], diameter_m: 0.18, frequency_hz: 5100, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
  - {id: 6, position_m: [0.6, 0.3, 1.6], diameter_m: 0.18, frequency_hz: 6200, duty: 0.5, electron_rate_e_per_s: 2.0e+8, rim_to_center_ratio: 0.8}
board:
  pattern: {family: tag36h11, cols: 6, rows: 5, tag_size_m: 0.03, tag_spacing: 0.5, border_bits: 1, corner_squares: false, first_id: 0, id_order: row-major-from-top-left}
  margin_m: 0.02
  warp_m: [0, 0]
  white_e_per_s: 2.4e+6
  black_e_per_s: 1.5e+5
  surround_e_per_s: 6.0e+5
captures:
  - {folder: boards, exposure_s: 0.004, views: {count: 12, distance_m: [0.2, 0.32], tilt_deg: 40, roll_deg: 180, field_coverage: 0.7}}
  - {folder: rotation, exposure_s: 5.0e-5, pivots_m: [[0.05, 0.02]], heights_m: [0, 0.3], turn: {count: 4, jitter_deg: 8}, interval_s: 0.5}
  - {folder: dispersion, exposure_s: 5.0e-5, pivots_m: [[0, 0]], heights_m: [0], turn: {count: 4, jitter_deg: 4}, interval_s: 0.5, known: true}
  - {folder: check, exposure_s: 5.0e-5, grid: {x_m: [-0.3, 0.3], y_m: [-0.15, 0.15], columns: 3, rows: 2}, heights_m: [0], turn: {count: 1, jitter_deg: 60}, interval_s: 0.5}
  - {folder: line-x, exposure_s: 5.0e-5, drive: {from_m: [-0.3, 0], to_m: [0.3, 0], speed_m_per_s: 0.1}, heights_m: [0], yaws_deg: [0], interval_s: 2}
  - {folder: edge, exposure_s: 5.0e-5, pivots_m: [[1.28, 0.01]], heights_m: [0], yaws_deg: [0], interval_s: 0.5}
)";
// clang-format on

/// Renders folders of the scene, once per process for each list of folders.
class Rendering {
 public:
  explicit Rendering(const std::vector<std::string>& folders) {
    const Scene scene = read_scene_file(folder_.file("scene.yaml", kScene));
    SimulationOptions options;
    options.folders = folders;
    render_scene(scene, folder_ / "session", options, {});
  }
  fs::path file(const std::string& name) const { return folder_ / ("session/" + name); }

 private:
  const TemporaryFolder folder_;
};

const Rendering& rendered_lamps() {
  static const Rendering rendering({"rotation", "dispersion", "check", "line-x", "edge"});
  return rendering;
}

const Rendering& rendered_boards() {
  static const Rendering rendering({"boards"});
  return rendering;
}

}  // namespace

RenderedSession::RenderedSession() {
  fs::create_directory(session_folder);
  for (const char* name : {"lamps.yaml", "rotation", "dispersion", "check", "line-x"}) {
    fs::copy(rendered_lamps().file(name), session_file(name), fs::copy_options::recursive);
  }
  write_camera();
  options.program = {"test", "1.2"};
  options.report = false;
}

Calibration RenderedSession::truth() {
  return read_calibration(rendered_lamps().file("true_calibration.yaml"));
}

fs::path RenderedSession::rendered_capture_of_two_lamps() {
  return rendered_lamps().file("edge/0000.png");
}

void RenderedSession::edit_session_file(const std::string& name, const std::string& from,
                                        const std::string& to) const {
  std::string text = TemporaryFolder::read_content(session_file(name));
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << name << ": " << from;
  write_session_file(name, text.replace(at, from.size(), to));
}

void RenderedSession::keep_captures(const std::string& captures_folder, std::size_t count) const {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(session_file(captures_folder))) {
    if (entry.path().extension() == ".png") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  ASSERT_GT(images.size(), count);
  for (std::size_t i = count; i < images.size(); ++i) fs::remove(images[i]);
}

void RenderedSession::write_camera(std::optional<double> row_time_s) const {
  Calibration camera;
  camera.camera = truth().camera;
  camera.camera.row_time_s = row_time_s;
  write_calibration(session_file("camera.yaml"), camera);
}

void RenderedSession::add_boards_in_place_of_camera() const {
  fs::remove(session_file("camera.yaml"));
  for (const char* name : {"board.yaml", "boards"}) {
    fs::copy(rendered_boards().file(name), session_file(name), fs::copy_options::recursive);
  }
}

std::vector<std::string> list_steps(const SessionResult& result) {
  std::vector<std::string> names;
  for (const SessionStep& step : result.steps) names.push_back(step.name);
  return names;
}

std::vector<std::string> list_executed_steps(const SessionResult& result) {
  std::vector<std::string> names;
  for (const SessionStep& step : result.steps) {
    if (!step.is_up_to_date) names.push_back(step.name);
  }
  return names;
}

SessionStep find_step(const SessionResult& result, const std::string& name) {
  const auto found = std::ranges::find(result.steps, name, &SessionStep::name);
  if (found != result.steps.end()) return *found;
  ADD_FAILURE() << "no step " << name;
  return {};
}

}  // namespace vlp
