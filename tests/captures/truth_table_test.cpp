// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/truth_table.h"

#include <gmock/gmock.h>

#include "support/random.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;

TEST(ReadTruthTable, AcceptsMissingHeightAndYaw) {
  const TemporaryFolder folder;
  const auto rows =
      read_truth_table(folder.file("t.csv", "image,x_m,y_m,yaw_rad\nb,1,2,\na,3,4,0.5\n"));
  ASSERT_EQ(rows.size(), 2);
  EXPECT_EQ(rows[0].image, "b");
  EXPECT_EQ(rows[1].xy_m, Eigen::Vector2d(3, 4));
  EXPECT_FALSE(rows[1].z_m);
  EXPECT_FALSE(rows[0].yaw_rad);
  EXPECT_EQ(rows[1].yaw_rad, 0.5);
  EXPECT_EQ(rows[1].line, 3);
}

TEST(ReadTruthTable, ReportsFileLineAndColumnOfInvalidRow) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& rows) {
    return rejection_message(
        [&] { read_truth_table(folder.file("t.csv", "image,x_m,y_m,z_m\n" + rows)); });
  };
  EXPECT_THAT(refusal("a,0,0,\na,1,1,\n"), HasSubstr("t.csv:3: image: 'a' occurs twice"));
  EXPECT_THAT(refusal("a,0,0,\n,1,1,\n"), HasSubstr("t.csv:3: image: is empty"));
  EXPECT_THAT(refusal("a,inf,0,\n"), HasSubstr("t.csv:2: x_m"));
  EXPECT_THAT(refusal("a,1e308,0,\n"), HasSubstr("t.csv:2: x_m: should be within 1,000 km"));
  EXPECT_THAT(refusal("a,0,-1e7,\n"), HasSubstr("t.csv:2: y_m"));
  EXPECT_THAT(refusal("a,0,0,1e7\n"), HasSubstr("t.csv:2: z_m"));
  EXPECT_THAT(refusal("a,,0,\n"), HasSubstr("t.csv:2: x_m"));
  EXPECT_THAT(refusal(""), HasSubstr("t.csv: contains no position"));
}

TEST(ReadPathTable, ReadsOptionalHeights) {
  const TemporaryFolder folder;
  const Path flat = read_path_table(folder.file("p.csv", "y_m,x_m\n1,2\n3,4\n"));
  ASSERT_EQ(flat.waypoints_m.size(), 2);
  EXPECT_EQ(flat.waypoints_m[1], Eigen::Vector2d(4, 3));
  EXPECT_TRUE(flat.z_m.empty());
  EXPECT_EQ(read_path_table(folder.file("p.csv", "x_m,y_m,z_m\n1,2,3\n4,5,6\n")).z_m,
            (std::vector<double>{3, 6}));
}

TEST(ReadPathTable, RejectsPathOfZeroLength) {
  const TemporaryFolder folder;
  for (const char* text : {"x_m,y_m\n", "x_m,y_m\n1,2\n", "x_m,y_m\n1,2\n1,2\n"}) {
    EXPECT_THAT(rejection_message([&] { read_path_table(folder.file("p.csv", text)); }),
                HasSubstr("two or more waypoints at different positions"));
  }
  EXPECT_THAT(
      rejection_message([&] { read_path_table(folder.file("p.csv", "x_m,y_m\n1,nan\n1,2\n")); }),
      HasSubstr("p.csv:2: y_m"));
}

TEST(ProjectOntoPath, DistanceMatchesBruteForceSearch) {
  Random random(1);
  Path path;
  for (int i = 0; i < 30; ++i) {
    path.waypoints_m.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1));
    if (i % 10 == 0) path.waypoints_m.push_back(path.waypoints_m.back());  // a stop
  }
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector2d place(random.uniform(-2, 2), random.uniform(-2, 2));
    double min_squared_distance = 1e9;  // brute force: a thousand points for each segment
    for (std::size_t leg = 1; leg < path.waypoints_m.size(); ++leg) {
      for (int step = 0; step <= 1000; ++step) {
        const Eigen::Vector2d point =
            path.waypoints_m[leg - 1] +
            step / 1000.0 * (path.waypoints_m[leg] - path.waypoints_m[leg - 1]);
        min_squared_distance = std::min(min_squared_distance, (point - place).norm());
      }
    }
    EXPECT_NEAR((project_onto_path(path, place).xy_m - place).norm(), min_squared_distance, 2e-3);
  }
}

TEST(ReadPathTable, RejectsWaypointBeyond1000Kilometers) {
  const TemporaryFolder folder;
  const auto refusal = [&](const std::string& row) {
    return rejection_message(
        [&] { read_path_table(folder.file("p.csv", "x_m,y_m,z_m\n1,2,3\n" + row)); });
  };
  EXPECT_EQ(refusal("1e6,-1e6,0\n"), "");
  EXPECT_THAT(refusal("1e308,0,0\n"), HasSubstr("p.csv:3: x_m: should be within 1,000 km"));
  EXPECT_THAT(refusal("0,-1e7,0\n"), HasSubstr("p.csv:3: y_m"));
  EXPECT_THAT(refusal("0,0,1e7\n"), HasSubstr("p.csv:3: z_m"));
}

TEST(ProjectOntoPath, InterpolatesHeightBetweenWaypoints) {
  const Path path{{{0, 0}, {2, 0}, {2, 2}}, {0, 1, 5}};
  EXPECT_DOUBLE_EQ(project_onto_path(path, {1, 1e-3}).z_m.value(), 0.5);
  EXPECT_DOUBLE_EQ(project_onto_path(path, {3, 1.5}).z_m.value(), 4);
  EXPECT_DOUBLE_EQ(project_onto_path(path, {9, 9}).z_m.value(), 5);
}

}  // namespace
}  // namespace vlp
