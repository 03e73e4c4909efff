// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/printable.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

TEST(Printable, LeavesTextAsItIs) {
  const std::string text = "0000.png: taken\n\tr\u00f6tlich \u20ac \U0001f4f7 \u00a0";
  EXPECT_EQ(printable(text), text);
  EXPECT_EQ(printable(""), "");
}

TEST(Printable, EscapesWhatATerminalWouldObey) {
  EXPECT_EQ(printable("\x1b[2J.png"), "\\x1b[2J.png");
  EXPECT_EQ(printable("a\rb\x07\x7f"), "a\\x0db\\x07\\x7f");
  EXPECT_EQ(printable(std::string("\0", 1)), "\\x00");
  // CSI as one character, in UTF-8 and alone
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J"),
            "\\xc2\\x9b2J");
  EXPECT_EQ(printable("\x9b"
                      "2J"),
            "\\x9b2J");
}

TEST(Printable, EscapesWhatIsNoUtf8) {
  EXPECT_EQ(printable("\xc3"), "\\xc3");
  EXPECT_EQ(printable("\xc3z"), "\\xc3z");
  EXPECT_EQ(printable("\xe2\x82"), "\\xe2\\x82");
  EXPECT_EQ(printable("\xff\xc0\xaf"), "\\xff\\xc0\\xaf");
}

TEST(FirstCharacters, CutNoneInTwo) {
  EXPECT_EQ(first_characters("abc", 3), "abc");
  EXPECT_EQ(first_characters("abc", 2), "ab");
  EXPECT_EQ(first_characters("a\xc3\xb6", 2), "a");
  EXPECT_EQ(first_characters("a\xe2\x82\xac"
                             "b",
                             4),
            "a\xe2\x82\xac");
  EXPECT_EQ(first_characters("\xc3\xb6", 1), "");
}

}  // namespace
}  // namespace vlp
