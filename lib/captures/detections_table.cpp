// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/detections_table.h"

#include <unordered_map>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "captures/number_text.h"

namespace vlp {

std::vector<Frame> read_detections(const std::filesystem::path& file) {
  const CsvTable csv(file);
  const auto image = csv.require_column("image"), lamp = csv.require_column("lamp");
  const auto u_px = csv.require_column("u_px"), v_px = csv.require_column("v_px");
  const auto sigma_px = csv.find_column("sigma_px");
  std::vector<Frame> frames;
  std::unordered_map<std::string, std::size_t> frame_of_image;
  for (std::size_t row = 0; row < csv.num_rows(); ++row) {
    const std::string name(csv.get_cell_text(row, image));
    if (name.empty()) throw csv.make_cell_error(row, image, "is empty");
    const auto [entry, is_new] = frame_of_image.try_emplace(name, frames.size());
    if (is_new) frames.push_back({name, {}});
    auto& detections = frames[entry->second].detections;
    const Detection detection{csv.get_cell_integer(row, lamp),
                              {csv.get_cell_number(row, u_px), csv.get_cell_number(row, v_px)},
                              csv.get_optional_number(row, sigma_px)};
    const double sigma = detection.sigma_px.value_or(1);
    if (sigma < kMinSigma_px || sigma > kMaxSigma_px) {
      throw csv.make_cell_error(row, *sigma_px, "should be within 0.0001 and 1000 px");
    }
    for (const Detection& other : detections) {
      if (other.lamp == detection.lamp) {
        throw csv.make_cell_error(
            row, lamp, std::to_string(other.lamp) + " occurs twice in image '" + name + "'");
      }
    }
    detections.push_back(detection);
  }
  if (frames.empty()) throw InputError(file, "contains no detection");
  return frames;
}

void write_detections(const std::filesystem::path& file, const std::vector<Frame>& frames) {
  constexpr int digits = 4;        // 1e-4 px
  constexpr int sigma_digits = 4;  // significant
  CsvWriter csv(file, {"image", "lamp", "u_px", "v_px", "sigma_px"});
  for (const Frame& frame : frames) {
    for (const Detection& detection : frame.detections) {
      csv.write_csv_row(
          {frame.image, std::to_string(detection.lamp),
           format_fixed_decimals(detection.pixel.x(), digits),
           format_fixed_decimals(detection.pixel.y(), digits),
           detection.sigma_px ? format_digits(*detection.sigma_px, sigma_digits) : ""});
    }
  }
  csv.save_file();
}

}  // namespace vlp
