// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "small_station.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <regex>
#include <sstream>

namespace vlp {

namespace fs = std::filesystem;

constexpr std::array kSteps{"boards", "rotation", "dispersion", "check"};

SmallStation::SmallStation() {
  const fs::path data = fs::path(VLP_SOURCE_DIR) / "datasets/station";
  fs::create_directory(folder / "station");
  for (const char* name : {"station.yaml", "camera_type.yaml", "board.yaml", "lamps.yaml"}) {
    fs::copy_file(data / name, folder / "station" / name);
  }
  fs::copy_file(data / "scene.yaml", folder / "station/scene.yaml");
  change("station.yaml", "board_views: 36", "board_views: 16");
  change("station.yaml", "turn_captures: 12", "turn_captures: 6");
  change("station.yaml", "turn_arc_deg: 300", "turn_arc_deg: 240");
  change("station.yaml", "dispersion_captures: 40, check_captures: 36",
         "dispersion_captures: 12, check_captures: 8");
  // Fewer images determine lens and turn less accurately.
  change("station.yaml", "expected_max_error_px: 0.26", "expected_max_error_px: 2");
  change("station.yaml", "split_half_px: 0.036", "split_half_px: 1");
  change("station.yaml", "rotation_px: 0.029", "rotation_px: 0.2");
  change("station.yaml", "rotation_sd_px: 0.023", "rotation_sd_px: 0.2");
  change("scene.yaml", "count: 36", "count: 16");
  change("scene.yaml", "count: 12", "count: 6");
  change("scene.yaml", "count: 40", "count: 12");
  change("scene.yaml", "columns: 3, rows: 3}\n    heights_m: [0, 0.3]",
         "columns: 2, rows: 2}\n    heights_m: [0]");
}

void SmallStation::change(const std::string& file, const std::string& from,
                          const std::string& to) const {
  const std::string name = "station/" + file;
  std::string text = TemporaryFolder::read_content(folder / name);
  const auto at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  folder.file(name, text.replace(at, from.size(), to));
}

void SmallStation::render(const std::string& only) const {
  const auto result = run_program("vlp-simulate " + (folder / "station/scene.yaml").string() +
                                  " --only " + only + " -o " + (folder / "unit").string());
  ASSERT_EQ(result.exit_code, 0) << result.errors;
}

void SmallStation::take_again() const {
  for (const auto& entry : fs::recursive_directory_iterator(folder / "unit")) {
    // What follows the end of a PNG is nothing of the picture.
    if (entry.path().extension() == ".png") std::ofstream(entry.path(), std::ios::app) << '\n';
  }
}

std::vector<fs::path> SmallStation::images(const std::string& step) const {
  std::vector<fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder / "unit" / step)) {
    if (entry.path().extension() == ".png") images.push_back(entry.path());
  }
  std::sort(images.begin(), images.end());
  return images;
}

std::string SmallStation::with_inclinations(const std::string& step) const {
  std::istringstream lines(TemporaryFolder::read_content(folder / "unit" / step / "captures.csv"));
  std::string table, line;
  while (std::getline(lines, line)) {
    table += line + (table.empty() ? ",roll_rad,pitch_rad\n" : ",0.0002,-0.0001\n");
  }
  return table;
}

void SmallStation::drop(const fs::path& image, const fs::path& step) const {
  const fs::path making = step / ("." + image.filename().string());
  fs::copy_file(image, making, fs::copy_options::overwrite_existing);
  fs::rename(making, step / image.filename());
}

void SmallStation::prepare(const std::string& camera) const {
  for (const char* step : kSteps) {
    fs::create_directories(captures(camera) / step);
    const auto table = folder / "unit" / step / "captures.csv";
    if (fs::exists(table)) fs::copy_file(table, captures(camera) / step / "captures.csv");
  }
}

void SmallStation::drop_all(const std::string& camera) const {
  for (const char* step : kSteps) {
    for (const auto& image : images(step)) drop(image, captures(camera) / step);
  }
}

std::string SmallStation::comparable_calibration(const std::string& camera) const {
  std::istringstream all(result(camera, "calibration.yaml"));
  std::string kept;
  for (std::string line; std::getline(all, line);) {
    const bool of_unit = line.find("  id: ") != std::string::npos ||
                         std::regex_search(line, std::regex("[0-9a-f]{64}"));
    if (!of_unit) kept += line + "\n";
  }
  return kept;
}

std::string SmallStation::result(const std::string& camera, const std::string& name) const {
  std::string content;
  const fs::path results = folder / "station/results" / camera;
  if (!fs::exists(results)) return content;
  for (const auto& run : fs::directory_iterator(results)) {
    if (!fs::exists(run.path() / name)) continue;
    EXPECT_EQ(content, "") << "more than one " << name;
    content = TemporaryFolder::read_content(run.path() / name);
  }
  return content;
}

}  // namespace vlp
