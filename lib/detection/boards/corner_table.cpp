// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/corner_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "captures/csv_reader.h"
#include "captures/csv_writer.h"
#include "detection/boards/lattice_order.h"
#include "rig/board_layout.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

/// Returns a tag whose corners are still to be read.
TagDetection make_empty_tag(int id) {
  TagDetection tag{id, {}};
  tag.corners_px.fill(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
  return tag;
}

/// Moves tags that the board does not have to `foreign_tags`, removes tags without all corners, and
/// sorts tags and points.
void complete_detection(BoardDetection& seen, const std::set<int>& ids) {
  for (TagDetection& tag : std::exchange(seen.tags, {})) {
    const bool is_of_board = ids.contains(tag.id);
    if (std::ranges::all_of(tag.corners_px,
                            [](const auto& corner) { return corner.allFinite(); })) {
      (is_of_board ? seen.tags : seen.foreign_tags).push_back(tag);
    } else if (is_of_board) {
      ++seen.num_unusable_tags;
    }
  }
  std::ranges::sort(seen.tags, {}, &TagDetection::id);
  std::ranges::sort(seen.points, {}, &PointDetection::index);
}

constexpr std::array kBowColumns{"edge_quadratic_px", "edge_cubic_px", "edge_half_extent"};

/// Reads the curvature of an edge; unknown if the table does not have the columns.
EdgeCurvature read_curvature(const CsvTable& csv, std::size_t row) {
  constexpr double min_reach = 0.01, max_reach = 2;
  if (std::ranges::none_of(kBowColumns,
                           [&](auto name) { return csv.find_column(name).has_value(); }))
    return {};
  const auto reach_at = csv.require_column(kBowColumns[2]);
  const double reach = csv.get_cell_number(row, reach_at);
  if (reach != 0 && !(reach >= min_reach && reach <= max_reach)) {
    throw csv.make_cell_error(
        row, reach_at,
        "should be the half extent of the edge pixels, 0.01 to 2, or 0 if there are none");
  }
  return {csv.get_cell_number(row, csv.require_column(kBowColumns[0])),
          csv.get_cell_number(row, csv.require_column(kBowColumns[1])), reach};
}

constexpr const char* kDeviationColumn = "sd_px";

double read_sd_px(const CsvTable& csv, std::size_t row) {
  const auto column = csv.find_column(kDeviationColumn);
  if (!column) return 0;
  const double sd_px = csv.get_cell_number(row, *column);
  if (sd_px < 0) {
    throw csv.make_cell_error(row, *column, "should be a standard deviation, or 0 if unknown");
  }
  return sd_px;
}

/// Describes a row length that contradicts board.yaml; empty if the points lie in rows as expected.
std::string describe_rows(const Board& board, std::span<const BoardView> views) {
  const auto cols = static_cast<std::size_t>(board.cols - 1),
             rows = static_cast<std::size_t>(board.rows - 1);
  std::vector<LatticePixels> pixels;
  for (const BoardView& view : views) {
    pixels.emplace_back(cols * rows);
    for (const PointDetection& point : view.detection.points)
      pixels.back()[point.index] = point.pixel;
  }
  const std::size_t row_length = estimate_points_per_row(pixels, cols);
  if (row_length == cols) return "";
  return fmt::format(
      "the corners lie in rows of {}, but a board of {} x {} squares has {} x {} corners; {}",
      row_length, board.cols, board.rows, cols, rows,
      row_length == rows ? "swap cols and rows of board.yaml" : "is board.yaml that of the board?");
}

}  // namespace

std::string describe_corner_outside(const Eigen::Vector2d& pixel,
                                    const std::array<int, 2>& imager_px) {
  constexpr double edge = 0.5;  // half a pixel
  const auto [width, height] = imager_px;
  if (pixel.x() >= -edge && pixel.y() >= -edge && pixel.x() <= width - edge &&
      pixel.y() <= height - edge) {
    return "";
  }
  return fmt::format(
      "a corner at ({}, {}) is outside an image of {} x {} px; is it of this camera?",
      format_exact_number(pixel.x()), format_exact_number(pixel.y()), width, height);
}

bool are_too_many_corners_outside(std::size_t outside, std::size_t corners) {
  constexpr std::size_t one_of = 50;
  return one_of * outside > corners;
}

namespace {

/// Reads the rows of a table of corners.
class CornerTableReader {
 public:
  CornerTableReader(const std::filesystem::path& file, const Board& board,
                    const std::array<int, 2>& imager_px)
      : file_(file),
        csv_(file),
        board_(board),
        imager_px_(imager_px),
        image_(csv_.require_column("image")),
        number_(csv_.require_column("corner")),
        u_px_(csv_.require_column("u_px")),
        v_px_(csv_.require_column("v_px")),
        tag_id_(board.has_squares() ? number_ : csv_.require_column("tag")) {}

  /// Returns the corners of all images. Throws InputError if there are none, or if too many of them
  /// are outside the image.
  std::vector<BoardView> read() {
    for (std::size_t row = 0; row < csv_.num_rows(); ++row) read_row(row);
    if (views_.empty()) throw InputError(file_, "contains no corner");
    if (are_too_many_corners_outside(outside_, corners_)) throw InputError(*first_outside_);
    return std::move(views_);
  }

 private:
  void read_row(std::size_t row) {
    const std::string name(csv_.get_cell_text(row, image_));
    if (name.empty()) throw csv_.make_cell_error(row, image_, "is empty");
    const auto [entry, is_new] = index_by_name_.try_emplace(name, views_.size());
    if (is_new) views_.push_back({name, imager_px_, {}});
    const auto cells = {tag_id_, number_, u_px_, v_px_};
    if (std::all_of(cells.begin(), cells.end(),
                    [&](auto cell) { return csv_.get_cell_text(row, cell).empty(); })) {
      return;  // an image without a corner
    }
    const Eigen::Vector2d pixel(csv_.get_cell_number(row, u_px_), csv_.get_cell_number(row, v_px_));
    ++corners_;
    if (const auto words = describe_corner_outside(pixel, imager_px_); !words.empty()) {
      if (outside_++ == 0) first_outside_ = csv_.make_cell_error(row, u_px_, words);
    }
    const int corner = read_number(row);
    if (!add(row, corner, pixel, views_[entry->second].detection)) {
      throw csv_.make_cell_error(row, number_,
                                 fmt::format("{} occurs twice in image '{}'", corner, name));
    }
  }

  /// Reads the number of a corner in its tag, or on its board of squares.
  int read_number(std::size_t row) const {
    const int last = board_.has_squares() ? (board_.cols - 1) * (board_.rows - 1) - 1 : 3;
    const int corner = csv_.get_cell_integer(row, number_);
    if (corner >= 0 && corner <= last) return corner;
    throw csv_.make_cell_error(
        row, number_,
        board_.has_squares() ? fmt::format("should be within 0 and {}, as on a board of {} x {} "
                                           "squares; is board.yaml that of the board?",
                                           last, board_.cols, board_.rows)
                             : "should be within 0 and 3");
  }

  /// Adds a corner to those of its image. Returns false if the image has it already.
  bool add(std::size_t row, int corner, const Eigen::Vector2d& pixel, BoardDetection& seen) {
    if (board_.has_squares()) {
      const auto index = static_cast<std::size_t>(corner);
      const bool is_new =
          std::ranges::find(seen.points, index, &PointDetection::index) == seen.points.end();
      if (is_new) seen.points.push_back({index, pixel, read_sd_px(csv_, row)});
      return is_new;
    }
    const int id = csv_.get_cell_integer(row, tag_id_);
    auto tag = std::ranges::find(seen.tags, id, &TagDetection::id);
    if (tag == seen.tags.end()) tag = seen.tags.insert(tag, make_empty_tag(id));
    const auto k = static_cast<std::size_t>(corner);
    if (tag->corners_px[k].allFinite()) return false;
    tag->corners_px[k] = pixel;
    tag->curvatures[k] = read_curvature(csv_, row);
    tag->corner_sds_px[k] = read_sd_px(csv_, row);
    return true;
  }

  std::filesystem::path file_;
  CsvTable csv_;
  const Board& board_;
  std::array<int, 2> imager_px_;
  CsvTable::Column image_, number_, u_px_, v_px_, tag_id_;
  std::vector<BoardView> views_;
  std::unordered_map<std::string, std::size_t> index_by_name_;
  std::size_t corners_ = 0, outside_ = 0;
  std::optional<InputError> first_outside_;
};

}  // namespace

std::vector<BoardView> read_corner_table(const std::filesystem::path& file, const Board& board,
                                         const std::array<int, 2>& imager_px) {
  std::vector<BoardView> views = CornerTableReader(file, board, imager_px).read();
  if (board.has_squares()) {
    if (const auto words = describe_rows(board, views); !words.empty())
      throw InputError(file, words);
  }
  std::set<int> ids;
  for (const BoardTag& tag : list_board_tags(board)) ids.insert(tag.id);
  for (BoardView& view : views) {
    complete_detection(view.detection, ids);
    if (!board.has_squares()) continue;
    renumber_lattice(view.detection.points, board.cols - 1, board.rows - 1,
                     board.kind == BoardKind::chessboard);
  }
  return views;
}

void write_corner_table(const std::filesystem::path& file, std::span<const BoardView> views,
                        const Board& board) {
  const bool squares = board.has_squares();
  std::vector<std::string> header{"image", "tag", "corner", "u_px", "v_px"};
  if (squares) {
    header.erase(header.begin() + 1);
  } else {
    header.insert(header.end(), kBowColumns.begin(), kBowColumns.end());
  }
  header.emplace_back(kDeviationColumn);
  CsvWriter csv(file, header);
  for (const BoardView& view : views) {
    const BoardDetection& seen = view.detection;
    if (squares ? seen.points.empty() : seen.tags.empty() && seen.foreign_tags.empty()) {
      std::vector<std::string> empty(header.size());
      empty.front() = view.image;
      csv.write_csv_row(empty);
    }
    if (squares) {
      for (const PointDetection& point : seen.points) {
        csv.write_csv_row({view.image, std::to_string(point.index),
                           format_exact_number(point.pixel.x()),
                           format_exact_number(point.pixel.y()), format_exact_number(point.sd_px)});
      }
      continue;
    }
    for (const auto* each : {&seen.tags, &seen.foreign_tags}) {
      for (const TagDetection& tag : *each) {
        for (std::size_t k = 0; k < 4; ++k) {
          csv.write_csv_row({view.image, std::to_string(tag.id), std::to_string(k),
                             format_exact_number(tag.corners_px[k].x()),
                             format_exact_number(tag.corners_px[k].y()),
                             format_exact_number(tag.curvatures[k].quadratic_px),
                             format_exact_number(tag.curvatures[k].cubic_px),
                             format_exact_number(tag.curvatures[k].reach),
                             format_exact_number(tag.corner_sds_px[k])});
        }
      }
    }
  }
  csv.save_file();
}

}  // namespace vlp
