// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/calibration_plots.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(RotationPlot, LabelsLampsRotationCenterAndPrincipalPoint) {
  const TemporaryFolder folder;
  const RotationPlot plot{"unit 'seven'",
                          {{42, {{100, 200}, {300, 200}, {200, 300}}, {200, 200}, {100, 101}},
                           {43, {{150, 200}, {250, 200}, {200, 250}}, {201, 199}, {50, 50.5}}},
                          {203, 198},
                          {210, 190}};
  write_plot(folder / "a.svg", draw_rotation(plot));
  const std::string svg = TemporaryFolder::read_content(folder / "a.svg");
  for (const char* part : {"unit 'seven'", ">42<", ">43<", "principal point", "rotation center"}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
  EXPECT_THAT(svg, Not(HasSubstr(">44<")));
  write_plot(folder / "b.svg", draw_rotation(plot));
  EXPECT_EQ(TemporaryFolder::read_content(folder / "b.svg"), svg);
}

}  // namespace
}  // namespace vlp
