/* SPDX-FileCopyrightText: The VLP calibration toolbox authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * Fixes of two frames through the C API, to the last bit; see same_fix.cpp. C99, and C++ as well.
 */
#include <stdio.h>
#include <string.h>
#include <vlp/vlp.h>

static const vlp_detection kSeen[] = {{1, 331.4048, 303.6158, 0.05},
                                      {2, 691.1398, 302.9379, 0.05},
                                      {3, 677.3313, 499.7995, 0.05},
                                      {4, 335.0629, 517.9374, 0},
                                      {5, 545.7014, 421.0321, 0.05}};

static void print(const vlp_fix* fix) {
  int i, k;
  printf("%d %a %a %a %a\n", (int)fix->status, fix->state.position_m[0],
         fix->state.position_m[1], fix->state.position_m[2], fix->state.yaw_rad);
  for (i = 0; i < VLP_STATES; ++i) {
    for (k = 0; k < VLP_STATES; ++k) printf("%a ", fix->covariance[VLP_STATES * i + k]);
  }
  printf("\n%a %a\n", fix->state.roll_rad, fix->state.pitch_rad);
}

int main(void) {
  vlp_positioner* positioner = NULL;
  vlp_sensors sensors;
  vlp_fix fix;
  if (vlp_open("lamps.yaml", "calibration.yaml", NULL, &positioner) != VLP_OK) {
    fprintf(stderr, "%s\n", vlp_last_error());
    return 1;
  }
  vlp_locate(positioner, kSeen, 5, NULL, &fix);
  print(&fix);
  memset(&sensors, 0, sizeof sensors);
  sensors.inclination_sigma_rad = 0.05;
  sensors.has_motion = 1;
  sensors.velocity_sd_m_per_s = 1;
  vlp_locate(positioner, kSeen, 5, &sensors, &fix);
  print(&fix);
  vlp_close(positioner);
  return 0;
}
