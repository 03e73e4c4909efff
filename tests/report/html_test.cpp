// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(EscapeHtmlText, EscapesMarkupAndQuotesAndReplacesControlCharacters) {
  EXPECT_EQ(escape_html_text("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(escape_html_text("a\nb\tc"), "a b c");
  EXPECT_EQ(escape_html_text("\x1b[0m"), "\ufffd[0m");
  EXPECT_EQ(escape_html_text("\u00a0\u00b5"), "\u00a0\u00b5");
}

TEST(MakeHtmlTable, MarksRowsAndDeclaresScopeOfHeaderCells) {
  const std::string html = make_html_table({"<c>", {"h"}, {{"a", "b"}, {"d", "e"}}, {1}});
  EXPECT_THAT(html, HasSubstr("<caption>&lt;c&gt;</caption>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"col\">h</th>"));
  EXPECT_THAT(html, HasSubstr("<tr><th scope=\"row\">a</th><td>b</td></tr>"));
  EXPECT_THAT(html, HasSubstr("<tr class=\"marked\"><th scope=\"row\">d</th>"));
  EXPECT_THAT(make_html_table({"", {}, {{"a"}}}), Not(HasSubstr("caption")));
}

// As the examples of RFC 4648, section 10, with and without padding.
TEST(MakeHtmlFigure, EncodesImageAsBase64) {
  const auto encoded = [](const char* image) {
    return make_html_figure({ReportPart::other, image, "c", "a"});
  };
  EXPECT_THAT(encoded("fo"), HasSubstr("base64,Zm8=\""));
  EXPECT_THAT(encoded("foo"), HasSubstr("base64,Zm9v\""));
  EXPECT_THAT(encoded("foob"), HasSubstr("base64,Zm9vYg==\""));
}

}  // namespace
}  // namespace vlp
