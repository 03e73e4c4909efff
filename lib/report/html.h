// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "report/report_picture.h"

namespace vlp {

/// Escapes text for HTML elements and attributes. Line breaks and tabs become spaces, other control
/// characters U+FFFD.
std::string escape_html_text(std::string_view text);

/// Returns the HTML element `<name>text</name>` with a newline at the end. `text` is plain text and
/// is escaped.
std::string make_html_element(std::string_view name, std::string_view text);

/// Returns a self-contained page with the report's style. `content` is HTML.
std::string make_html_page(const std::string& title, const std::string& content);

/// Returns a section with a heading. `body` is HTML; the result is empty if the body is.
std::string make_html_section(const std::string& heading, const std::string& body);

/// Table that scrolls on its own if it is too wide. The first cell of each row is its header. Cells
/// are escaped. An empty caption or header is omitted. Marked rows are highlighted.
struct HtmlTable {
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> highlighted_rows = {};
};
std::string make_html_table(const HtmlTable& table);

/// Returns a figure with the embedded image, its caption, and its table below.
std::string make_html_figure(const ReportPlot& plot);

}  // namespace vlp
