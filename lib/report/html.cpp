// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <openssl/evp.h>

#include <algorithm>
#include <map>

#include "report/report_style.h"

namespace vlp {
namespace {

std::string encode_base64(const std::string& bytes) {
  constexpr std::size_t group = 3, letters = 4;
  std::string text((bytes.size() + group - 1) / group * letters + 1, '\0');  // + 1: final zero
  // The C interface takes unsigned characters.
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                     reinterpret_cast<const unsigned char*>(bytes.data()),
                                     static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(length));
  return text;
}

}  // namespace

std::string escape_html_text(std::string_view text) {
  static const std::map<char, std::string_view> escapes{
      {'&', "&amp;"},  {'<', "&lt;"}, {'>', "&gt;"}, {'"', "&quot;"},
      {'\'', "&#39;"}, {'\n', " "},   {'\t', " "}};
  constexpr unsigned char first_printable = 0x20, del = 0x7f;
  std::string escaped;
  escaped.reserve(text.size());
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (const auto escape = escapes.find(c); escape != escapes.end()) {
      escaped += escape->second;
    } else if (byte < first_printable || byte == del) {
      escaped += "\xef\xbf\xbd";
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string make_html_element(std::string_view name, std::string_view text) {
  const std::string tag(name);
  return "<" + tag + ">" + escape_html_text(text) + "</" + tag + ">\n";
}

std::string make_html_page(const std::string& title, const std::string& content) {
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n" +
         make_html_element("title", title) + "<style>" + std::string(kReportStyle) +
         "</style>\n</head>\n<body>\n<header>\n" + make_html_element("h1", title) +
         "</header>\n<main>\n" + content + "</main>\n</body>\n</html>\n";
}

std::string make_html_section(const std::string& heading, const std::string& body) {
  if (body.empty()) return "";
  return "<section>\n" + make_html_element("h2", heading) + body + "</section>\n";
}

std::string make_html_table(const HtmlTable& table) {
  // Focusable, so that it can be scrolled without a mouse.
  std::string html = "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"" +
                     escape_html_text(table.caption.empty() ? "Table" : table.caption) +
                     "\">\n<table>\n";
  if (!table.caption.empty()) html += make_html_element("caption", table.caption);
  if (!table.header.empty()) {
    html += "<thead><tr>";
    for (const auto& cell : table.header)
      html += "<th scope=\"col\">" + escape_html_text(cell) + "</th>";
    html += "</tr></thead>\n";
  }
  html += "<tbody>\n";
  for (std::size_t number = 0; number < table.rows.size(); ++number) {
    const auto& row = table.rows[number];
    const bool marked = std::find(table.highlighted_rows.begin(), table.highlighted_rows.end(),
                                  number) != table.highlighted_rows.end();
    html += marked ? "<tr class=\"marked\">" : "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      html += i == 0 ? "<th scope=\"row\">" : "<td>";
      html += escape_html_text(row[i]);
      html += i == 0 ? "</th>" : "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</tbody>\n</table>\n</div>\n";
}

std::string make_html_figure(const ReportPlot& plot) {
  const bool png = plot.image.rfind("\x89PNG", 0) == 0;
  HtmlTable table{"", {}, {}};
  if (!plot.table.empty()) {
    table.header = plot.table.front();
    table.rows.assign(plot.table.begin() + 1, plot.table.end());
  }
  const std::string large = plot.part == ReportPart::camera ? " class=\"large\"" : "";
  return "<figure" + large +
         ">\n<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Picture\">"
         "<img alt=\"" +
         escape_html_text(plot.alt) + "\" src=\"data:image/" + (png ? "png" : "svg+xml") +
         ";base64," + encode_base64(plot.image) + "\"></div>\n" +
         make_html_element("figcaption", plot.caption) + "</figure>\n" +
         (table.rows.empty() ? "" : make_html_table(table));
}

}  // namespace vlp
