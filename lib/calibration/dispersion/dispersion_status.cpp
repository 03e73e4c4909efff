// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "calibration/dispersion/dispersion.h"

namespace vlp {

std::string_view explanation_of(DispersionStatus status) {
  switch (status) {
    case DispersionStatus::ok:
      return "ok";
    case DispersionStatus::no_fix:
      return "no capture has a fix";
    case DispersionStatus::too_few_captures:
      return "too few captures have a fix that agrees with the others: three or more are needed "
             "(two for --method paper); add captures";
    case DispersionStatus::station_far:
      return "every fix is farther from the station than a fifth of the lamps' height: is it in "
             "metres, and in the frame of the lamp map? Are these the captures taken there?";
    case DispersionStatus::one_yaw:
      return "all captures, or all but one, are at one yaw, where an error of the camera and one "
             "of the station or the lamp map look alike: turn the camera at the station and add "
             "those captures, or take --method paper, which supposes that station and map are "
             "right";
    case DispersionStatus::many_yaws:
      return "the captures are at different yaws, over which the paper's circle averages the "
             "camera's error away: hold the yaw, or take --method camera";
    case DispersionStatus::diverged:
      return "no offset explains the fixes: is each lamp where the map has it, are all captures "
             "from "
             "the station, and is the calibration this camera's? Add captures at other yaws";
  }
  return "";
}

}  // namespace vlp
