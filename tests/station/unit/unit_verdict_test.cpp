// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/unit/unit_verdict.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::StartsWith;

TEST(ListFailureCauses, OrdersStationFaultsBeforeRefusedBeforeMissingImages) {
  const StationConfig config = read_station_config(VLP_SOURCE_DIR "/datasets/station/station.yaml");
  const TemporaryFolder folder;
  Unit unit(config, "camera", {"test", "0"}, 1);
  unit.add_step_images(StationStep::boards, {folder.file("0.png", "no image")});
  unit.end_early("the operator ended the run");
  unit.invalidate_verdict("the golden unit failed");
  EXPECT_THAT(list_failure_causes(unit),
              ElementsAre(Field(&Cause::text, "the golden unit failed"),
                          Field(&Cause::text, HasSubstr("1 of 1 images refused")),
                          Field(&Cause::text, StartsWith("boards: the operator ended the run"))));
}

}  // namespace
}  // namespace vlp
