// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "report/report_picture.h"

namespace vlp {

/// Text for HTML, in elements and in attributes: nothing in it is taken for markup, and control
/// characters become U+FFFD.
std::string html_text(std::string_view text);

/// `<name>text</name>`, the text being escaped.
std::string html_element(std::string_view name, std::string_view text);

/// A whole page that needs nothing else, with the report's style: `content` is HTML.
std::string html_page(const std::string& title, const std::string& content);

/// With a heading; empty without a body, which is HTML.
std::string html_section(const std::string& heading, const std::string& body);

/// A table that scrolls on its own when it is too wide. Each row begins with its own header. The
/// cells are escaped; an empty caption or header is left out. Marked rows stand out.
struct HtmlTable {
  std::string caption;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::size_t> marked = {};
};
std::string html_table(const HtmlTable& table);

/// A picture inside the page, with its caption, and its table below.
std::string html_figure(const ReportPicture& picture);

}  // namespace vlp
