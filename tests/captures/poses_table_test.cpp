// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "captures/poses_table.h"

#include <gtest/gtest.h>

#include "captures/csv_reader.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

TEST(WritePoses, WritesUpperTriangleAndQuaternionWithPositiveRealPart) {
  Eigen::Matrix<double, 6, 6> covariance;
  for (int i = 0; i < 36; ++i) covariance(i / 6, i % 6) = 1 + i / 6 + i % 6;
  const TemporaryFolder folder;
  write_poses(folder / "poses.csv",
              {{"a.png", {1, -2, 0.5}, Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5), covariance},
               {"b.png", {0, 0, 0}, Eigen::Quaterniond::Identity(), std::nullopt}});
  const CsvTable csv(folder / "poses.csv");
  ASSERT_EQ(csv.num_rows(), 2U);
  const auto number = [&](const char* column) {
    return csv.get_cell_number(0, csv.require_column(column));
  };
  EXPECT_EQ(csv.get_cell_text(0, csv.require_column("image")), "a.png");
  EXPECT_EQ(number("y_m"), -2);
  EXPECT_EQ(number("qw"), 0.5);
  EXPECT_EQ(number("qx"), -0.5);
  EXPECT_EQ(number("qy"), 0.5);
  EXPECT_EQ(number("cov_x_x_m2"), 1);
  EXPECT_EQ(number("cov_x_z_m2"), 3);
  EXPECT_EQ(number("cov_y_rz_m_rad"), 7);
  EXPECT_EQ(number("cov_rx_ry_rad2"), 8);
  EXPECT_EQ(number("cov_rz_rz_rad2"), 11);
  EXPECT_EQ(csv.get_cell_text(1, csv.require_column("cov_x_x_m2")), "");
}

}  // namespace
}  // namespace vlp
