// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0

#include "simulation/simulate.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <regex>
#include <stdexcept>

#include "captures/parallel_for.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "simulation/exposure.h"
#include "simulation/frame_renderer.h"
#include "simulation/truth.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::vector<CaptureSet> select_sets(const Scene& scene, const std::vector<std::string>& folders) {
  if (folders.empty()) return scene.sets;
  std::vector<CaptureSet> sets;
  for (const std::string& folder : folders) {
    const auto set = std::ranges::find(scene.sets, folder, &CaptureSet::folder);
    if (set == scene.sets.end()) {
      std::string problem = "the scene has no captures called '" + folder + "'; it has";
      for (const CaptureSet& each : scene.sets) problem.append(" ").append(each.folder);
      throw std::invalid_argument(problem);
    }
    if (std::ranges::find(sets, folder, &CaptureSet::folder) == sets.end()) sets.push_back(*set);
  }
  return sets;
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  // [FILE-1]
  if (error) throw InputError(folder, "cannot be made: " + error.message());
}

void write_common_files(const Scene& scene, const fs::path& output) {
  if (!scene.lamps.empty()) {
    write_lamp_map(output / "lamps.yaml", make_lamp_map(scene, true));
    write_lamp_map(output / "true_lamps.yaml", make_lamp_map(scene, false));
  }
  if (scene.board) write_board(output / "board.yaml", scene.board->pattern);
  write_calibration(output / "true_calibration.yaml", make_true_calibration(scene));
}

void write_image(const fs::path& file, const cv::Mat& lines, const Scene& scene) {
  const bool by_rows = scene.camera.readout == Readout::rows;
  const auto bytes = encode_image(by_rows ? lines : cv::Mat(lines.t()), scene.processing);
  write_file(file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

/// Renders a capture. Returns false if the image exists already.
bool render_capture(const Scene& scene, const FrameRenderer& renderer, const CaptureSet& set,
                    std::size_t index, const fs::path& folder) {
  const auto write = [&](const std::string& image, const auto& electrons, std::uint64_t seed) {
    if (fs::exists(folder / image)) return false;
    write_image(folder / image,
                simulate_sensor_image(scene.sensor, electrons(), seed, scene.processing), scene);
    return true;
  };
  if (set.board) {
    const BoardShot shot = make_board_shot(scene, set, index);
    return write(
        shot.image, [&] { return renderer.render_board(shot); }, shot.noise_seed);
  }
  const LampShot shot = make_lamp_shot(scene, set, index);
  return write(
      shot.image, [&] { return renderer.render_lamps(shot); }, shot.noise_seed);
}

/// Returns the gray level of a source that fills a pixel on the axis. Without a picture it may
/// exceed white.
double compute_level(const Scene& scene, const CaptureSet& set, double electron_rate_e_per_s) {
  const Sensor& sensor = scene.sensor;
  const double level =
      sensor.black_level_dn +
      sensor.gain_dn_per_e * std::min(electron_rate_e_per_s * set.exposure_s, sensor.full_well_e);
  return scene.processing ? apply_tone_curve(*scene.processing, sensor, level) : level;
}

std::string whole(double value) { return std::to_string(std::lround(value)); }

void warn_about_brightness(const Scene& scene, const CaptureSet& set, const std::string& bright,
                           double bright_e_per_s, const std::string& dark, double dark_e_per_s,
                           std::vector<std::string>& warnings) {
  constexpr double too_dark = 0.03, too_bright = 0.6;
  const double white = white_level_dn(scene.sensor);
  const std::string fit =
      ": does sensor.gain_dn_per_e suit sensor.bits, and the light the exposure?";
  const double high = compute_level(scene, set, bright_e_per_s);
  const double low = compute_level(scene, set, dark_e_per_s);
  if (high - low < too_dark * white) {
    // [GATE-5] `gray levels` | images too dark, too bright or empty | change light or exposure
    warnings.push_back(set.folder + ": " + bright + " is only " + whole(high - low) + " of " +
                       whole(white) + " gray levels above " + dark + fit);
  }
  if (low > too_bright * white) {
    warnings.push_back(set.folder + ": " + dark + " is at " + whole(low) + " of " + whole(white) +
                       " gray levels" + fit);
  }
}

void warn_about_stripes(const Scene& scene, const CaptureSet& set,
                        std::vector<std::string>& warnings) {
  constexpr double min_period_lines = 2.2;
  for (const SceneLamp& lamp : scene.lamps) {
    const std::string name = set.folder + ": lamp " + std::to_string(lamp.id);
    if (set.exposure_s * lamp.frequency_hz >= 1) {
      // [GATE-5] `than its period`, `stripes of less`
      warnings.push_back(name + " has no clear stripes: the exposure is longer than its period");
    } else if (lamp.frequency_hz * *scene.camera.row_time_s * min_period_lines > 1) {
      warnings.push_back(name + " has stripes of less than " +
                         std::to_string(min_period_lines).substr(0, 3) + " lines");
    }
  }
}

}  // namespace

std::string make_provenance(const fs::path& scene, std::optional<std::uint64_t> seed,
                            const std::string& program, const std::string& version) {
  constexpr std::size_t max_bytes = 1 << 20;
  std::string text = read_text_file(scene, max_bytes);
  const std::string mark = "# " + program + " ";
  if (text.starts_with(mark)) text.erase(0, text.find('\n') + 1);
  if (seed) {
    const std::regex seed_line("(^|\n)seed:[^\n]*");
    if (!std::regex_search(text, seed_line)) {
      throw InputError(scene, "--seed needs the scene's seed on a line of its own");
    }
    text = std::regex_replace(text, seed_line, "$1seed: " + std::to_string(*seed),
                              std::regex_constants::format_first_only);
  }
  return mark + version + '\n' + text;
}

void claim_output_folder(const fs::path& output, const std::string& provenance) {
  const fs::path mark = output / "scene.yaml";
  if (fs::exists(mark)) {
    constexpr std::size_t max_bytes = 2 << 20;
    if (read_text_file(mark, max_bytes) == provenance) return;
    throw InputError(
        output,
        "contains captures of another scene, seed or version: choose another folder or remove it");
  }
  make_folder(output);
  // An execution killed here may have left its temporary scene.yaml.
  const auto foreign = [](const fs::directory_entry& entry) {
    return !entry.path().filename().string().starts_with(".scene.yaml.tmp-");
  };
  if (std::any_of(fs::directory_iterator(output), fs::directory_iterator(), foreign)) {
    throw InputError(output,
                     "is not empty and contains no captures of this scene: choose another folder");
  }
  write_file(mark, provenance);
}

SimulationSummary render_scene(const Scene& scene, const fs::path& output,
                               const SimulationOptions& options,
                               const SimulationProgress& progress) {
  const std::vector<CaptureSet> sets = select_sets(scene, options.folders);
  const FrameRenderer renderer(scene);
  claim_output_folder(output, options.provenance);
  write_common_files(scene, output);

  std::size_t total = 0;
  for (const CaptureSet& set : sets) total += count_shots(set);
  SimulationSummary summary;
  std::mutex counting;
  for (const CaptureSet& set : sets) {
    const fs::path folder = output / set.folder;
    make_folder(folder);
    const auto warnings = list_scene_warnings(scene, set);
    summary.warnings.insert(summary.warnings.end(), warnings.begin(), warnings.end());
    if (const std::size_t empty = write_truth_tables(scene, renderer, set, folder); empty > 0) {
      // [GATE-5] `is in view in`
      summary.warnings.push_back(set.folder + ": nothing is in view in " + std::to_string(empty) +
                                 " of " + std::to_string(count_shots(set)) + " captures");
    }
    parallel_for(count_shots(set), options.threads, [&](std::size_t index) {
      const bool rendered = render_capture(scene, renderer, set, index, folder);
      const std::lock_guard lock(counting);
      ++(rendered ? summary.rendered : summary.existing);
      if (progress) progress(summary, total);
    });
  }
  return summary;
}

std::vector<std::string> list_scene_warnings(const Scene& scene, const CaptureSet& set) {
  std::vector<std::string> warnings;
  if (set.board) {
    warn_about_brightness(scene, set, "the board's white", scene.board->white_e_per_s, "its black",
                          scene.board->black_e_per_s, warnings);
    return warnings;
  }
  double brightest = 0;
  for (const SceneLamp& lamp : scene.lamps) {
    brightest = std::max(brightest, lamp.glow.electron_rate_e_per_s);
  }
  warn_about_brightness(scene, set, "the brightest lamp", brightest + scene.ambient_e_per_s,
                        "the ceiling", scene.ambient_e_per_s, warnings);
  warn_about_stripes(scene, set, warnings);
  return warnings;
}

}  // namespace vlp
