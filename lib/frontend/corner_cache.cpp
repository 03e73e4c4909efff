// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/corner_cache.h"

#include <fmt/core.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "captures/digest.h"
#include "rig/input_error.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::string describe_settings(const Board& board) {
  std::string settings = fmt::format(
      "11 {} {} {} {} {} {} {} {} {} {}", VLP_VERSION, board.family, board.cols, board.rows,
      shortest(board.tag_size_m), shortest(board.tag_spacing), board.border_bits,
      board.corner_squares, board.first_id, to_string(board.id_order));
  if (board.has_squares()) {
    settings += fmt::format(" {} {} {}", static_cast<int>(board.kind),
                            shortest(board.square_size_m), board.top_left_white);
  }
  return settings;
}

constexpr std::array kColumns{
    "id",    "u0",      "v0",      "u1",      "v1",      "u2",    "v2",      "u3",
    "v3",    "square0", "cube0",   "reach0",  "square1", "cube1", "reach1",  "square2",
    "cube2", "reach2",  "square3", "cube3",   "reach3",  "sd0",   "sd1",     "sd2",
    "sd3",   "blur0",   "dark0",   "bright0", "blur1",   "dark1", "bright1", "blur2",
    "dark2", "bright2", "blur3",   "dark3",   "bright3"};

/// Returns a row that is padded with zeros.
std::vector<std::string> make_row(std::vector<std::string> begin) {
  begin.resize(kColumns.size(), "0");
  return begin;
}

std::vector<std::string> make_row(int id, const TagDetection::Outline& outline) {
  std::vector<std::string> row{std::to_string(id)};
  for (const Eigen::Vector2d& pixel : outline.corners_px) {
    row.push_back(shortest(pixel.x()));
    row.push_back(shortest(pixel.y()));
  }
  for (const auto& [quadratic_px, cubic_px, reach] : outline.curvatures) {
    row.insert(row.end(), {shortest(quadratic_px), shortest(cubic_px), shortest(reach)});
  }
  for (const double sd_px : outline.corner_sds_px) row.push_back(shortest(sd_px));
  for (const auto& [blur_px, dark, bright] : outline.steps) {
    row.insert(row.end(), {shortest(blur_px), shortest(dark), shortest(bright)});
  }
  return row;
}

/// Writes a detection. The first row, with id -1, contains the image size and the counts, by which
/// a file truncated by a power failure is recognized. The other rows are, in this order:
///   one per tag
///   one per foreign tag
///   one per point, with its pixel
///   one per tone curve, with its cost
///   with more than two tone curves, one per tag and curve after the first
void write_view(const fs::path& file, const CachedView& cached) {
  const BoardView& view = cached.view;
  CsvWriter csv(file, {kColumns.begin(), kColumns.end()});
  csv.row(
      make_row({"-1", std::to_string(view.imager_px[0]), std::to_string(view.imager_px[1]),
                std::to_string(view.seen.foreign.size()), std::to_string(view.seen.unusable),
                std::to_string(view.seen.overexposed), std::to_string(view.seen.points.size()),
                std::to_string(view.seen.tags.size()), std::to_string(view.seen.curve_costs.size()),
                shortest(cached.blur_px.value_or(-1)), shortest(cached.bright_fraction),
                shortest(cached.white_fraction)}));
  for (const auto* tags : {&view.seen.tags, &view.seen.foreign}) {
    for (const TagDetection& tag : *tags) {
      csv.row(make_row(tag.id, {tag.corners_px, tag.curvatures, tag.corner_sds_px, tag.steps}));
    }
  }
  for (const PointDetection& point : view.seen.points) {
    csv.row(make_row(
        {std::to_string(point.index), shortest(point.pixel.x()), shortest(point.pixel.y())}));
  }
  for (const double cost : view.seen.curve_costs) {
    csv.row(make_row({"-1", shortest(cost)}));
  }
  for (const TagDetection& tag : view.seen.tags) {
    for (const TagDetection::Outline& outline : tag.tone_curve_fits)
      csv.row(make_row(tag.id, outline));
  }
  csv.save_unsynced();
}

CachedView read_view(const fs::path& file, const std::string& image) {
  const CsvTable csv(file);
  const auto at = [&](std::size_t row, const char* column) {
    return csv.number(row, csv.required(column));
  };
  if (csv.rows() == 0 || at(0, "id") != -1) throw InputError(file, "is not of the cache");
  BoardView view{image, {static_cast<int>(at(0, "u0")), static_cast<int>(at(0, "v0"))}, {}};
  const double blur_px = at(0, "square0");  // -1: none
  view.seen.unusable = static_cast<int>(at(0, "v1"));
  view.seen.overexposed = static_cast<int>(at(0, "u2"));
  const auto rows = static_cast<std::size_t>(csv.rows());
  const auto foreign = static_cast<std::size_t>(at(0, "u1"));
  const auto points = static_cast<std::size_t>(at(0, "v2"));
  const auto tags_seen = static_cast<std::size_t>(at(0, "u3"));
  const auto curves = static_cast<std::size_t>(at(0, "v3"));
  const std::size_t behind = curves > 2 ? curves - 1 : 0;
  if (1 + tags_seen + foreign + points + curves + behind * tags_seen != rows) {
    throw InputError(file, "is not of the cache");
  }
  const auto read_outline = [&](std::size_t row) {
    TagDetection::Outline outline;
    for (std::size_t k = 0; k < 4; ++k) {
      outline.corners_px[k] = {at(row, kColumns[1 + 2 * k]), at(row, kColumns[2 + 2 * k])};
      const std::size_t bow = 9 + 3 * k;
      outline.curvatures[k] = {at(row, kColumns[bow]), at(row, kColumns[bow + 1]),
                               at(row, kColumns[bow + 2])};
      outline.corner_sds_px[k] = at(row, kColumns[21 + k]);
      const std::size_t step = 25 + 3 * k;
      outline.steps[k] = {at(row, kColumns[step]), at(row, kColumns[step + 1]),
                          at(row, kColumns[step + 2])};
    }
    return outline;
  };
  std::size_t row = 1;
  for (const std::size_t end = row + tags_seen + foreign; row < end; ++row) {
    auto& tags = row <= tags_seen ? view.seen.tags : view.seen.foreign;
    const auto [corners_px, curvatures, corner_sds_px, steps] = read_outline(row);
    tags.push_back(
        {static_cast<int>(at(row, "id")), corners_px, curvatures, corner_sds_px, {}, steps});
  }
  for (const std::size_t end = row + points; row < end; ++row) {
    view.seen.points.push_back(
        {static_cast<std::size_t>(at(row, "id")), {at(row, "u0"), at(row, "v0")}});
  }
  for (std::size_t i = 0; i < curves; ++i) view.seen.curve_costs.push_back(at(row++, "u0"));
  for (TagDetection& tag : view.seen.tags) {
    for (std::size_t i = 0; i < behind; ++i) tag.tone_curve_fits.push_back(read_outline(row++));
  }
  return {std::move(view), blur_px < 0 ? std::nullopt : std::optional(blur_px), at(0, "cube0"),
          at(0, "reach0")};
}

std::string compute_digest(const SourceImage& image) {
  if (image.frame.empty()) return sha256_of_file(image.file);
  const cv::Mat levels = image.frame.isContinuous() ? image.frame : image.frame.clone();
  const std::string bytes(levels.ptr<char>(), levels.total() * levels.elemSize());
  return sha256_of_text(fmt::format("{} {} {}", levels.cols, levels.rows, bytes));
}

}  // namespace

BoardCache corner_cache(const fs::path& folder, const Board& board) {
  if (folder.empty()) return {};
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw InputError(folder, "cannot be made: " + error.message());
  const auto make_path = [folder, settings = describe_settings(board)](const SourceImage& image) {
    return folder / (sha256_of_text(compute_digest(image) + " " + settings) + ".csv");
  };
  const auto find = [make_path](const SourceImage& image) -> std::optional<CachedView> {
    try {
      const fs::path file = make_path(image);
      if (!fs::exists(file)) return {};
      return read_view(file, image.file.filename().string());
    } catch (const InputError&) {
      return {};
    }
  };
  const auto keep = [make_path](const SourceImage& image, const CachedView& view) {
    try {
      write_view(make_path(image), view);
    } catch (const InputError&) {  // a full disk; the view itself is there
    }
  };
  return {find, keep};
}

}  // namespace vlp
