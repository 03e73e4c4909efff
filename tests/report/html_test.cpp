// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(HtmlText, EscapesMarkupQuotesAndControlCharacters) {
  EXPECT_EQ(html_text("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(html_text("a\nb\tc"), "a b c");
  EXPECT_EQ(html_text("\x1b[0m"), "\ufffd[0m");
  EXPECT_EQ(html_text("\u00a0\u00b5"), "\u00a0\u00b5");
}

TEST(HtmlTable, MarksRowsAndDeclaresHeaderScope) {
  const std::string html = html_table({"<c>", {"h"}, {{"a", "b"}, {"d", "e"}}, {1}});
  EXPECT_THAT(html, HasSubstr("<caption>&lt;c&gt;</caption>"));
  EXPECT_THAT(html, HasSubstr("<th scope=\"col\">h</th>"));
  EXPECT_THAT(html, HasSubstr("<tr><th scope=\"row\">a</th><td>b</td></tr>"));
  EXPECT_THAT(html, HasSubstr("<tr class=\"marked\"><th scope=\"row\">d</th>"));
  EXPECT_THAT(html_table({"", {}, {{"a"}}}), Not(HasSubstr("caption")));
}

// As the examples of RFC 4648, section 10, with and without padding.
TEST(HtmlFigure, EncodesImageAsBase64) {
  const auto encoded = [](const char* image) {
    return html_figure({ReportPart::other, image, "c", "a"});
  };
  EXPECT_THAT(encoded("fo"), HasSubstr("base64,Zm8=\""));
  EXPECT_THAT(encoded("foo"), HasSubstr("base64,Zm9v\""));
  EXPECT_THAT(encoded("foob"), HasSubstr("base64,Zm9vYg==\""));
}

}  // namespace
}  // namespace vlp
