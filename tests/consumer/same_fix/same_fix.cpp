// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
/// Prints the fixes of same_fix.c, computed by the C++ API, in the same format. No bit may depend
/// on the API or on the user's compiler options.
#include <vlp/positioning/positioner.h>

#include <cstdio>
#include <vector>

namespace {

void print(const vlp::Fix& fix) {
  const auto& [pose, motion] = fix.state;
  std::printf("%d %a %a %a %a\n", static_cast<int>(fix.status), pose.position_m.x(),
              pose.position_m.y(), pose.position_m.z(), pose.yaw_rad);
  for (int i = 0; i < vlp::kBodyStates; ++i) {
    for (int k = 0; k < vlp::kBodyStates; ++k) std::printf("%a ", fix.covariance(i, k));
  }
  std::printf("\n%a %a\n", motion.inclination.roll_rad, motion.inclination.pitch_rad);
}

}  // namespace

int main() {
  const vlp::Positioner positioner(vlp::read_lamp_map("lamps.yaml"),
                                   vlp::read_calibration("calibration.yaml"));
  const std::vector<vlp::Detection> seen = {{1, {331.4048, 303.6158}, 0.05},
                                            {2, {691.1398, 302.9379}, 0.05},
                                            {3, {677.3313, 499.7995}, 0.05},
                                            {4, {335.0629, 517.9374}, {}},
                                            {5, {545.7014, 421.0321}, 0.05}};
  print(positioner.compute_position_fix(seen));
  vlp::Sensors sensors;
  sensors.inclination_sigma_rad = 0.05;
  sensors.motion = vlp::KnownMotion{{0, 0}, 0, 1, 0};
  print(positioner.compute_position_fix(seen, sensors));
}
