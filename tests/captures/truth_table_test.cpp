// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/truth_table.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(ReadTruth, AcceptsMissingHeightAndYaw) {
  const TemporaryFolder folder;
  const auto rows = read_truth(folder.file("t.csv", "image,x_m,y_m,yaw_rad\nb,1,2,\na,3,4,0.5\n"));
  ASSERT_EQ(rows.size(), 2);
  EXPECT_EQ(rows[0].image, "b");
  EXPECT_EQ(rows[1].xy_m, Eigen::Vector2d(3, 4));
  EXPECT_FALSE(rows[1].z_m);
  EXPECT_FALSE(rows[0].yaw_rad);
  EXPECT_EQ(rows[1].yaw_rad, 0.5);
  EXPECT_EQ(rows[1].line, 3);
}

TEST(ReadTruth, ReportsLineOfInvalidRow) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& rows) {
    return rejection_message(
        [&] { read_truth(folder.file("t.csv", "image,x_m,y_m,z_m\n" + rows)); });
  };
  EXPECT_THAT(refusal("a,0,0,\na,1,1,\n"), HasSubstr("t.csv:3: image: 'a' stands twice"));
  EXPECT_THAT(refusal("a,0,0,\n,1,1,\n"), HasSubstr("t.csv:3: image: is empty"));
  EXPECT_THAT(refusal("a,inf,0,\n"), HasSubstr("t.csv:2: x_m"));
  EXPECT_THAT(refusal("a,1e308,0,\n"), HasSubstr("t.csv:2: x_m: should be within 1,000 km"));
  EXPECT_THAT(refusal("a,0,-1e7,\n"), HasSubstr("t.csv:2: y_m"));
  EXPECT_THAT(refusal("a,0,0,1e7\n"), HasSubstr("t.csv:2: z_m"));
  EXPECT_THAT(refusal("a,,0,\n"), HasSubstr("t.csv:2: x_m"));
  EXPECT_THAT(refusal(""), HasSubstr("t.csv: holds no place"));
}

}  // namespace
}  // namespace vlp
