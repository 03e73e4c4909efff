// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "detection/boards/tag_finder.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <string>

#include "support/rejection_message.h"

namespace vlp {
namespace {

/// Marker 0 of the published dictionary of 4 x 4 bits.
TEST(MakeArucoMarker, ReturnsBitsRowByRowAndThrowsForMissingMarkers) {
  const ArucoMarker marker = make_aruco_marker("DICT_4X4_50", 0);
  EXPECT_EQ(marker.width, 4);
  EXPECT_THAT(marker.white, testing::ElementsAre(true, false, true, true,   //
                                                 false, true, false, true,  //
                                                 false, false, true, true,  //
                                                 false, false, true, false));
  EXPECT_THAT(make_aruco_marker("DICT_4X4_50", 49).white, testing::SizeIs(16));
  for (const int id : {-1, 50}) {
    EXPECT_THROW(make_aruco_marker("DICT_4X4_50", id), std::invalid_argument) << id;
  }
}

TEST(MakeArucoMarker, ErrorListsValidMarkersOrDictionaries) {
  const auto reject = [](const std::string& dictionary, int id) {
    return rejection_message<std::invalid_argument>([&] { make_aruco_marker(dictionary, id); });
  };
  EXPECT_EQ(reject("DICT_4X4_50", 50), "DICT_4X4_50 has no marker 50, only 0 to 49");
  EXPECT_THAT(reject("DICT_9X9_50", 0),
              testing::StartsWith("OpenCV has no dictionary 'DICT_9X9_50', but DICT_4X4_100, "
                                  "DICT_4X4_1000, DICT_4X4_250, DICT_4X4_50, DICT_5X5_100"));
  EXPECT_THAT(reject("DICT_9X9_50", 0), testing::EndsWith(", DICT_ARUCO_ORIGINAL"));
}

}  // namespace
}  // namespace vlp
