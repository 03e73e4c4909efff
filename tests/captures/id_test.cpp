// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/id.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"

namespace vlp {
namespace {

TEST(Id, AcceptsSinglePathComponent) {
  for (const std::string& text :
       {std::string("0001"), std::string("a.b"), std::string("Kamera 7"), std::string("-x"),
        std::string("\u00fc\u20ac"), std::string(200, 'a'), std::string("20261121T134501Z-01")}) {
    EXPECT_TRUE(Id::is_valid(text)) << text;
    EXPECT_EQ(Id(text, "file", "camera").id_text(), text);
  }
}

TEST(Id, RejectsPathsAndControlCharacters) {
  for (const std::string& text :
       {std::string(), std::string("."), std::string(".."), std::string(".run"),
        std::string("../.."), std::string("a/b"), std::string("/etc"), std::string("a\nPASS"),
        std::string("a\tb"), std::string("\x1b[2J"), std::string("a\0b", 3), std::string("\xff"),
        std::string("\u202egnp"), std::string("a\u2028b"), std::string("\xed\xa0\x80"),
        std::string(201, 'a')}) {
    EXPECT_FALSE(Id::is_valid(text)) << text;
  }
  EXPECT_EQ(rejection_message([] { Id("../x\n", "spool/a.json", "run"); }),
            "spool/a.json: '../x\\x0a' is no id of a run: 1 to 200 bytes of UTF-8 are one, without "
            "'/', without control characters, and without a '.' at the beginning");
}

}  // namespace
}  // namespace vlp
