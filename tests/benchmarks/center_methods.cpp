// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// center_methods FOLDER: compares the errors of methods for lamp centers in a folder of rendered
/// captures. The folder contains true_detections.csv; lamps.yaml and true_calibration.yaml are
/// next to it. Lamps are those completely in view that our detector finds with and without the
/// lens.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "captures/csv_reader.h"
#include "frontend/image_file.h"
#include "frontend/mat_view.h"
#include "lamps/image/background.h"
#include "lamps/light_detector.h"

namespace vlp {
namespace {

using Eigen::Vector2d;

struct Errors {
  const char* method;
  double squares = 0, worst_px = 0;
  int lamps = 0;

  void add(const Vector2d& error_px) {
    squares += error_px.squaredNorm();
    worst_px = std::max(worst_px, error_px.norm());
    ++lamps;
  }
};

/// Uses the pixels above the background's threshold.
struct LitPixels {
  Vector2d box_center, centroid;
};

template <typename Level>
LitPixels find_lit_pixels(const cv::Mat& image, const Background& background, const cv::Rect& box) {
  Vector2d low(box.br().x, box.br().y), high(box.x, box.y), moment(0, 0);
  double sum = 0;
  for (int row = box.y; row < box.br().y; ++row) {
    for (int column = box.x; column < box.br().x; ++column) {
      const double level = image.at<Level>(row, column);
      if (level <= background.threshold) continue;
      const Vector2d pixel(column, row);
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
      moment += (level - background.level) * pixel;
      sum += level - background.level;
    }
  }
  return {(low + high) / 2, moment / sum};
}

LitPixels find_lit_pixels(const cv::Mat& image, const Light& light) {
  constexpr int around_px = 4;
  const cv::Point low(int(std::floor(light.box.min().x())) - around_px,
                      int(std::floor(light.box.min().y())) - around_px);
  const cv::Point high(int(std::ceil(light.box.max().x())) + around_px + 1,
                       int(std::ceil(light.box.max().y())) + around_px + 1);
  const cv::Rect box = cv::Rect(low, high) & cv::Rect({0, 0}, image.size());
  const Background background = estimate_background_of(to_image_view(image));
  return image.depth() == CV_8U ? find_lit_pixels<std::uint8_t>(image, background, box)
                                : find_lit_pixels<std::uint16_t>(image, background, box);
}

std::map<int, Light> lamps_in(const LightDetector& detector, const cv::Mat& image) {
  std::map<int, Light> lamps;
  for (Light& light : detector.detect_lights(to_image_view(image))) {
    if (light.kind == LightKind::lamp) lamps[*light.lamp] = std::move(light);
  }
  return lamps;
}

/// Lamps completely in view, by image.
std::map<std::string, std::map<int, Vector2d>> truth_in(const std::filesystem::path& folder) {
  const CsvTable table(folder / "true_detections.csv");
  const auto image = table.require_column("image"), lamp = table.require_column("lamp");
  const auto u = table.require_column("u_px"), v = table.require_column("v_px");
  const auto in_view = table.require_column("in_view");
  std::map<std::string, std::map<int, Vector2d>> truth;
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    if (table.get_cell_number(row, in_view) < 1) continue;
    truth[std::string(table.get_cell_text(row, image))][table.get_cell_integer(row, lamp)] = {
        table.get_cell_number(row, u), table.get_cell_number(row, v)};
  }
  return truth;
}

void run(const std::filesystem::path& folder) {
  const std::filesystem::path beside = folder / "..";
  const LampMap map = read_lamp_map(beside / "lamps.yaml");
  DetectorCamera camera = make_detector_camera(read_calibration(beside / "true_calibration.yaml"));
  const LightDetector with_lens(map, camera);
  camera.lens.reset();
  const LightDetector without_lens(map, camera);

  std::array<Errors, 4> methods = {
      Errors{"bounding box of the lit pixels"}, Errors{"centroid of the brightness"},
      Errors{"our ellipse, without lens"}, Errors{"our circle, through the lens"}};
  int missed_with = 0, missed_without = 0;
  for (const auto& [name, truth] : truth_in(folder)) {
    const cv::Mat image = read_image(folder / name);
    const auto lamps = lamps_in(with_lens, image), ellipses = lamps_in(without_lens, image);
    for (const auto& [id, pixel] : truth) {
      missed_with += !lamps.contains(id);
      missed_without += !ellipses.contains(id);
      if (!lamps.contains(id) || !ellipses.contains(id)) continue;
      const LitPixels lit = find_lit_pixels(image, lamps.at(id));
      methods[0].add(lit.box_center - pixel);
      methods[1].add(lit.centroid - pixel);
      methods[2].add(ellipses.at(id).pixel - pixel);
      methods[3].add(lamps.at(id).pixel - pixel);
    }
  }
  fmt::print("{:32}{:>7}{:>10}{:>10}\n", "method", "lamps", "rms px", "worst px");
  for (const auto& [method, squares, worst_px, lamps] : methods) {
    fmt::print("{:32}{:7}{:10.3f}{:10.3f}\n", method, lamps, std::sqrt(squares / lamps), worst_px);
  }
  fmt::print("wholly in view, but not found with the lens {}, without {}\n", missed_with,
             missed_without);
}

}  // namespace
}  // namespace vlp

int main(int argc, char** argv) {
  if (argc != 2) {
    fmt::print(stderr, "center_methods FOLDER\n");
    return 2;
  }
  try {
    vlp::run(argv[1]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "center_methods: {}\n", error.what());
    return 2;
  }
}
