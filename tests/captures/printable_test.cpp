// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/printable.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

TEST(EscapeForTerminal, KeepsPlainText) {
  const std::string text = "0000.png: taken\n\tr\u00f6tlich \u20ac \U0001f4f7 \u00a0";
  EXPECT_EQ(escape_for_terminal(text), text);
  EXPECT_EQ(escape_for_terminal(""), "");
}

TEST(EscapeForTerminal, EscapesControlCharacters) {
  EXPECT_EQ(escape_for_terminal("\x1b[2J.png"), "\\x1b[2J.png");
  EXPECT_EQ(escape_for_terminal("a\rb\x07\x7f"), "a\\x0db\\x07\\x7f");
  EXPECT_EQ(escape_for_terminal(std::string("\0", 1)), "\\x00");
  // CSI as one character, in UTF-8 and alone
  EXPECT_EQ(escape_for_terminal("\xc2\x9b"
                                "2J"),
            "\\xc2\\x9b2J");
  EXPECT_EQ(escape_for_terminal("\x9b"
                                "2J"),
            "\\x9b2J");
}

TEST(EscapeForTerminal, EscapesInvalidUtf8) {
  EXPECT_EQ(escape_for_terminal("\xc3"), "\\xc3");
  EXPECT_EQ(escape_for_terminal("\xc3z"), "\\xc3z");
  EXPECT_EQ(escape_for_terminal("\xe2\x82"), "\\xe2\\x82");
  EXPECT_EQ(escape_for_terminal("\xff\xc0\xaf"), "\\xff\\xc0\\xaf");
  // Overlong, a surrogate, beyond U+10FFFF.
  EXPECT_EQ(escape_for_terminal("\xe0\x80\xaf"), "\\xe0\\x80\\xaf");
  EXPECT_EQ(escape_for_terminal("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(escape_for_terminal("\xf0\x80\x80\xaf"), "\\xf0\\x80\\x80\\xaf");
  EXPECT_EQ(escape_for_terminal("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
}

TEST(EscapeForTerminal, EscapesDirectionMarks) {
  EXPECT_EQ(escape_for_terminal("\u202egnp.FAIL"), "\\xe2\\x80\\xaegnp.FAIL");
  EXPECT_EQ(escape_for_terminal("a\u2028b"), "a\\xe2\\x80\\xa8b");
  EXPECT_EQ(escape_for_terminal("\u061c"), "\\xd8\\x9c");
  EXPECT_EQ(escape_for_terminal("\u2065\u2070\u2027\u202f"), "\u2065\u2070\u2027\u202f");
}

TEST(EscapeForTerminal, EscapesNoncharacters) {
  EXPECT_EQ(escape_for_terminal("\xef\xbf\xbe"), "\\xef\\xbf\\xbe");
  EXPECT_EQ(escape_for_terminal("\xef\xb7\x90"), "\\xef\\xb7\\x90");
  EXPECT_EQ(escape_for_terminal("\xf1\x8f\xbf\xbe"), "\\xf1\\x8f\\xbf\\xbe");
  EXPECT_EQ(escape_for_terminal("\ufffd\xc2\xbf\xe2\xbf\xbf\xf1\x8e\xbf\xbe"),
            "\ufffd\xc2\xbf\xe2\xbf\xbf\xf1\x8e\xbf\xbe");
}

TEST(EscapeForLine, EscapesLineBreaksAndTabs) {
  EXPECT_EQ(escape_for_line("a\n2026 PASS\tb"), "a\\x0a2026 PASS\\x09b");
  EXPECT_EQ(escape_for_line("r\u00f6tlich"), "r\u00f6tlich");
}

TEST(TruncateUtf8Text, CutsBeforeCharacterThatExceedsByteLimit) {
  EXPECT_EQ(truncate_utf8_text("abc", 3), "abc");
  EXPECT_EQ(truncate_utf8_text("abc", 2), "ab");
  EXPECT_EQ(truncate_utf8_text("a\xc3\xb6", 2), "a");
  EXPECT_EQ(truncate_utf8_text("a\xe2\x82\xac"
                               "b",
                               4),
            "a\xe2\x82\xac");
  EXPECT_EQ(truncate_utf8_text("\xc3\xb6", 1), "");
}

}  // namespace
}  // namespace vlp
