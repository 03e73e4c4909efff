// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/evaluation_plots.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(TrackPlot, DistancesToLeftOfCommandedLineArePositive) {
  // The line runs north; a fix 2 mm to the east is to the right.
  const TrackPlot plot{
      "north", {{{1, 0}, {1, 2}}}, {{1.002, 0.5}, {0.999, 1.5}}, {{{1.001, 0.7}, {1.001, 0.9}}}};
  const Drawing drawing = draw_line_drive(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("1.002 0.5 0.5 -2 \n"));
  EXPECT_THAT(drawing.commands, HasSubstr("0.999 1.5 1.5 1 \n"));
  // The fitted line is drawn from the first fix to the last, not along the whole commanded one.
  EXPECT_THAT(drawing.commands, HasSubstr("1.001 0.5 0.5 -1 \n1.001 1.5 1.5 -1 \n"));
  const std::string svg = render_plot_as_svg(drawing);
  for (const char* part : {"<title>track</title>", "commanded", "fitted line", "north"}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
}

TEST(TrackPlot, ThinsManyFixesAndStatesStep) {
  TrackPlot plot{"long", {{{0, 0}, {1, 1}}}, {}, {{{0, 0}, {1, 1}}}};
  for (int i = 0; i < 100'000; ++i) plot.fixes_m.emplace_back(1e-5 * i, 1e-5 * i);
  const Drawing drawing = draw_line_drive(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("every 50th of 100000 drawn"));
  EXPECT_LT(render_plot_as_svg(drawing).size(), 700'000u);
}

TEST(TrackPlot, RendersFixExactlyOnLine) {
  const TrackPlot plot{"", {{{0, 0}, {1, 0}}}, {{0.5, 0}}, {{{0, 0}, {1, 0}}}};
  const Drawing drawing = draw_line_drive(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("$fixes << END\n0.5 0 0.5 0 \nEND\n"));
  EXPECT_THAT(render_plot_as_svg(drawing),
              AllOf(HasSubstr("<svg"), HasSubstr("fixes"), HasSubstr("fitted line")));
}

}  // namespace
}  // namespace vlp
