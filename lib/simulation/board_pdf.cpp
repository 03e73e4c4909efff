// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "simulation/board_pdf.h"

#include <cairo-pdf.h>
#include <fmt/core.h>

#include <cmath>
#include <memory>
#include <stdexcept>

#include "rig/board_layout.h"
#include "rig/yaml_text.h"
#include "simulation/board_print.h"

namespace vlp {
namespace {

constexpr double kPointsPerMeter = 72 / 0.0254;
/// Margins: most printers leave 5 mm blank. The footer below the board holds ruler and parameters.
constexpr double kMargin_m = 0.008, kFooter_m = 0.022;

using Context = std::unique_ptr<cairo_t, void (*)(cairo_t*)>;
using Surface = std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)>;

/// Returns the width of the border around the tag field that is printed or has to stay white.
double get_page_margin_m(const Board& board) {
  if (board.has_squares() || board.corner_squares) return compute_printed_margin_m(board);
  return std::min(board.tag_size_m * board.tag_spacing, board.tag_size_m) / 2;
}

Eigen::Vector2d printed_size_m(const Board& board) {
  return compute_tag_field_size_m(board) + 2 * Eigen::Vector2d::Constant(get_page_margin_m(board));
}

bool fits_on_sheet(const Board& board, const Eigen::Vector2d& sheet_m) {
  const Eigen::Vector2d room_m =
      sheet_m - 2 * Eigen::Vector2d::Constant(kMargin_m) - Eigen::Vector2d(0, kFooter_m);
  return (printed_size_m(board).array() <= room_m.array() + 1e-9).all();
}

/// Returns the page size, in landscape only if the board fits only so; std::nullopt if it does not
/// fit.
std::optional<Eigen::Vector2d> find_sheet_m(const Board& board, const PageSize& paper) {
  if (fits_on_sheet(board, paper.size_m)) return paper.size_m;
  const Eigen::Vector2d lying = paper.size_m.reverse();
  if (fits_on_sheet(board, lying)) return lying;
  return {};
}

/// Draws all black areas as one path, which avoids seams between neighboring bits.
void draw_board(cairo_t* context, const Board& board) {
  for (const Rectangle& part : make_board_pattern(board, {1, 0})) {
    if (part.value > 0) continue;
    cairo_rectangle(context, part.left_m, part.top_m, part.right_m - part.left_m,
                    part.bottom_m - part.top_m);
  }
  cairo_fill(context);
}

std::string format_mm(double length_m) {
  constexpr double um_per_m = 1e6, um_per_mm = 1e3;
  return format_exact_number(std::round(length_m * um_per_m) / um_per_mm) + " mm";
}

std::string describe_parameters(const Board& board) {
  if (board.kind == BoardKind::apriltags) {
    return fmt::format("{}, {} x {} tags of {}, gap {}, ids from {}, {}{}", board.family,
                       board.cols, board.rows, format_mm(board.tag_size_m),
                       format_mm(board.tag_size_m * board.tag_spacing), board.first_id,
                       id_order_name(board.id_order),
                       board.border_bits == 2 ? ", Kalibr AprilGrid" : "");
  }
  const std::string squares =
      fmt::format("{} x {} squares of {}", board.cols, board.rows, format_mm(board.square_size_m));
  if (board.kind == BoardKind::chessboard) return "chessboard, " + squares;
  return fmt::format("ChArUco, {}, markers of {}, {} from id {}", squares,
                     format_mm(board.tag_size_m), board.family, board.first_id);
}

void draw_footer(cairo_t* context, const Board& board) {
  constexpr double ruler_m = 0.1, thin_m = 0.0002, tick_m = 0.003, text_m = 0.003;
  constexpr int ticks = 10;
  cairo_set_line_width(context, thin_m);
  for (int i = 0; i <= ticks; ++i) {
    cairo_move_to(context, i * ruler_m / ticks, 0);
    cairo_line_to(context, i * ruler_m / ticks, i % 5 == 0 ? 2 * tick_m : tick_m);
  }
  cairo_move_to(context, 0, 0);
  cairo_line_to(context, ruler_m, 0);
  cairo_stroke(context);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, text_m);
  cairo_move_to(context, 0, 2 * tick_m + 1.2 * text_m);
  cairo_show_text(context, "The ruler is 100 mm long; else print again at 100 %.");
  cairo_move_to(context, 0, 2 * tick_m + 2.6 * text_m);
  cairo_show_text(context, describe_parameters(board).c_str());
}

cairo_status_t append(void* text, const unsigned char* bytes, unsigned int count) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

const std::vector<PageSize>& list_page_sizes() {
  static const std::vector<PageSize> all{{"A4", {0.210, 0.297}}, {"A3", {0.297, 0.420}},
                                         {"A2", {0.420, 0.594}}, {"A1", {0.594, 0.841}},
                                         {"A0", {0.841, 1.189}}, {"Letter", {0.2159, 0.2794}}};
  return all;
}

const PageSize& require_page_size(const std::string& name) {
  for (const PageSize& paper : list_page_sizes()) {
    if (paper.name == name) return paper;
  }
  std::string names;
  for (const PageSize& paper : list_page_sizes())
    names.append(names.empty() ? "" : ", ").append(paper.name);
  throw std::invalid_argument("there is no paper '" + name + "', only " + names);
}

std::optional<double> find_tag_size_m(const Board& board, const PageSize& paper) {
  constexpr int min_mm = 5, max_mm = 1000;
  Board candidate = board;
  double& size_m = board.has_squares() ? candidate.square_size_m : candidate.tag_size_m;
  for (int size_mm = max_mm; size_mm >= min_mm; --size_mm) {
    size_m = size_mm / 1000.0;
    if (find_sheet_m(candidate, paper)) return size_m;
  }
  return {};
}

std::string render_board_pdf(const Board& board, const PageSize& paper) {
  const auto sheet_m = find_sheet_m(board, paper);
  if (!sheet_m) {
    const Eigen::Vector2d needed_m = printed_size_m(board);
    throw std::invalid_argument("the board is " + format_mm(needed_m.x()) + " x " +
                                format_mm(needed_m.y()) + " and does not fit on " + paper.name);
  }
  std::string bytes;
  {
    const Surface surface(
        cairo_pdf_surface_create_for_stream(append, &bytes, sheet_m->x() * kPointsPerMeter,
                                            sheet_m->y() * kPointsPerMeter),
        cairo_surface_destroy);
    // Fixed date: the bytes must not depend on the time of day.
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                   "2000-01-01T00:00:00Z");
    const Context context(cairo_create(surface.get()), cairo_destroy);
    cairo_scale(context.get(), kPointsPerMeter, kPointsPerMeter);
    cairo_save(context.get());
    const Eigen::Vector2d room_m = *sheet_m - Eigen::Vector2d(0, kFooter_m);
    const Eigen::Vector2d begin_m = (room_m - compute_tag_field_size_m(board)) / 2;
    cairo_translate(context.get(), begin_m.x(), begin_m.y());
    draw_board(context.get(), board);
    cairo_restore(context.get());
    cairo_translate(context.get(), 2 * kMargin_m, sheet_m->y() - kFooter_m);
    draw_footer(context.get(), board);
    cairo_show_page(context.get());
    cairo_surface_finish(surface.get());
    if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS) {
      throw std::runtime_error("the board cannot be drawn");
    }
  }
  return bytes;
}

}  // namespace vlp
