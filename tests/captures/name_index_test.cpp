// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/csv_reader.h"

#include <gtest/gtest.h>

#include <string>

namespace vlp {
namespace {

TEST(NameIndex, FindReturnsIndexOfEachInsertedName) {
  std::vector<std::string> names;
  for (int i = 0; i < 10000; ++i) names.push_back(std::to_string(i) + ".png");
  NameIndex index(names.size());
  for (const std::string& name : names) EXPECT_TRUE(index.insert_unique_name(name));
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(index.find_name_index(names[i]), i);
  EXPECT_FALSE(index.insert_unique_name("77.png"));
  EXPECT_EQ(index.find_name_index("77.png"), 77);
  EXPECT_EQ(index.find_name_index("10000.png"), std::nullopt);
  EXPECT_EQ(index.find_name_index(""), std::nullopt);
}

TEST(NameIndex, FindReturnsNulloptWhenEmpty) {
  EXPECT_EQ(NameIndex(0).find_name_index("a"), std::nullopt);
}

}  // namespace
}  // namespace vlp
