// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "frontend/corner_cache.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>
#include <vector>

#include "captures/digest.h"
#include "rig/file.h"
#include "rig/input_error.h"
#include "rig/yaml_text.h"

namespace vlp {
namespace {

namespace fs = std::filesystem;

std::string describe_settings(const Board& board) {
  std::string settings = fmt::format(
      "14 {} {} {} {} {} {} {} {} {} {}", VLP_VERSION, board.family, board.cols, board.rows,
      format_exact_number(board.tag_size_m), format_exact_number(board.tag_spacing),
      board.border_bits, board.corner_squares, board.first_id, id_order_name(board.id_order));
  if (board.has_squares()) {
    settings += fmt::format(" {} {} {}", static_cast<int>(board.kind),
                            format_exact_number(board.square_size_m), board.top_left_white);
  }
  return settings;
}

/// Numbers of a file, which the same functions write and read in the same order. A number ends with
/// a blank or with the line.
class NumberFile {
 public:
  /// Creates an empty file to write.
  NumberFile() = default;
  /// Reads the numbers of a text.
  explicit NumberFile(std::string text) : text_(std::move(text)), is_read_(true) {}

  const std::string& text() const { return text_; }
  bool is_at_end() const { return position_ == text_.size(); }

  /// Writes a number, or replaces it by the next one of the text. Throws std::runtime_error if the
  /// text is cut short or damaged.
  void transfer(double& value) {
    if (!is_read_) {
      text_ += format_exact_number(value) + " ";
      return;
    }
    const char* const end = text_.data() + text_.size();
    const auto [stop, failure] = std::from_chars(text_.data() + position_, end, value);
    if (failure != std::errc() || stop == end || !std::isfinite(value)) {
      // [FILE-4]
      throw std::runtime_error("is cut short");
    }
    position_ = static_cast<std::size_t>(stop - text_.data()) + 1;
  }
  template <typename Integer>
  void transfer_integer(Integer& value) {
    auto number = static_cast<double>(value);
    transfer(number);
    value = static_cast<Integer>(number);
  }
  /// Transfers the number of items, and each item on a line.
  template <typename Item, typename Transfer>
  void transfer_list(std::vector<Item>& items, const Transfer& transfer_item) {
    std::size_t count = items.size();
    transfer_integer(count);
    if (is_read_ && count > text_.size()) throw std::runtime_error("is damaged");
    items.resize(count);
    end_line();
    for (Item& item : items) {
      transfer_item(item);
      end_line();
    }
  }

 private:
  void end_line() {
    if (!is_read_) text_.back() = '\n';
  }

  std::string text_;
  std::size_t position_ = 0;
  bool is_read_ = false;
};

/// Transfers the members of a TagDetection or of a TagDetection::Outline.
template <typename Outline>
void transfer_outline(NumberFile& file, Outline& outline) {
  for (std::size_t k = 0; k < 4; ++k) {
    EdgeCurvature& curvature = outline.curvatures[k];
    EdgeStep& step = outline.steps[k];
    for (double* value : {&outline.corners_px[k].x(), &outline.corners_px[k].y(),
                          &curvature.quadratic_px, &curvature.cubic_px, &curvature.reach,
                          &outline.corner_sds_px[k], &step.blur_px, &step.dark, &step.bright}) {
      file.transfer(*value);
    }
  }
}

void transfer_tag(NumberFile& file, TagDetection& tag) {
  file.transfer_integer(tag.id);
  transfer_outline(file, tag);
  file.transfer_list(tag.tone_curve_fits,
                     [&](TagDetection::Outline& outline) { transfer_outline(file, outline); });
}

void transfer_view(NumberFile& file, CachedView& cached) {
  BoardView& view = cached.view;
  for (int& size_px : view.imager_px) file.transfer_integer(size_px);
  file.transfer_integer(view.detection.num_unusable_tags);
  file.transfer_integer(view.detection.num_overexposed_tags);
  for (int& squares : view.detection.largest_chessboard_part) file.transfer_integer(squares);
  double blur_px = cached.blur_px.value_or(-1);
  file.transfer(blur_px);
  cached.blur_px = blur_px < 0 ? std::nullopt : std::optional(blur_px);
  file.transfer(cached.bright_fraction);
  file.transfer(cached.white_fraction);
  for (auto* tags : {&view.detection.tags, &view.detection.foreign_tags}) {
    file.transfer_list(*tags, [&](TagDetection& tag) { transfer_tag(file, tag); });
  }
  file.transfer_list(view.detection.points, [&](PointDetection& point) {
    file.transfer_integer(point.index);
    file.transfer(point.pixel.x());
    file.transfer(point.pixel.y());
    file.transfer(point.sd_px);
  });
  file.transfer_list(view.detection.curve_costs, [&](double& cost) { file.transfer(cost); });
}

std::string compute_digest(const SourceImage& image) {
  if (image.frame.empty()) return hash_file(image.file);
  const cv::Mat levels = image.frame.isContinuous() ? image.frame : image.frame.clone();
  const std::string bytes(levels.ptr<char>(), levels.total() * levels.elemSize());
  return hash_text(fmt::format("{} {} {}", levels.cols, levels.rows, bytes));
}

}  // namespace

CornerCache::CornerCache(fs::path folder, const Board& board)
    : folder_(std::move(folder)), settings_(describe_settings(board)) {
  if (folder_.empty()) return;
  std::error_code error;
  fs::create_directories(folder_, error);
  // [FILE-1]
  if (error) throw InputError(folder_, "cannot be made: " + error.message());
}

fs::path CornerCache::make_file_path(const SourceImage& image) const {
  return folder_ / (hash_text(compute_digest(image) + " " + settings_) + ".txt");
}

std::optional<CachedView> CornerCache::find_cached_view(const SourceImage& image) const {
  constexpr std::size_t max_bytes = std::size_t{64} << 20;
  if (folder_.empty()) return std::nullopt;
  try {
    const fs::path path = make_file_path(image);
    if (!fs::exists(path)) return std::nullopt;
    NumberFile file(read_file(path, max_bytes));
    CachedView cached{{image.file.filename().string(), {}, {}}, {}, 0, 0};
    transfer_view(file, cached);
    return file.is_at_end() ? std::optional(std::move(cached)) : std::nullopt;
  } catch (const std::runtime_error&) {  // InputError, or a damaged file
    return std::nullopt;
  }
}

void CornerCache::store_cached_view(const SourceImage& image, CachedView view) const {
  if (folder_.empty()) return;
  try {
    NumberFile numbers;
    transfer_view(numbers, view);
    AtomicFileWriter file(make_file_path(image));
    file.write(numbers.text());
    file.save_without_fsync();
  } catch (const InputError&) {  // a full disk; the view itself is there
  }
}

}  // namespace vlp
