// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Fields of ROS 2's messages that the sketch of lib/README.md sets, without ROS.
#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace builtin_interfaces::msg {
struct Time {
  std::int32_t sec;
  std::uint32_t nanosec;
};
}  // namespace builtin_interfaces::msg

namespace geometry_msgs::msg {
struct PoseWithCovarianceStamped {
  struct {
    builtin_interfaces::msg::Time stamp;
    std::string frame_id;
  } header;
  struct {
    struct {
      struct {
        double x, y, z;
      } position;
      struct {
        double x, y, z, w;
      } orientation;
    } pose;
    std::array<double, 36> covariance;
  } pose;
};
}  // namespace geometry_msgs::msg
