// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/evaluation_plots.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Plot of a floor one meter wide with errors of 1 mm along x.
ErrorPlot grid(int fixes) {
  ErrorPlot plot{"a <floor>", {}, {}, {}};
  for (int i = 0; i < fixes; ++i) {
    const Eigen::Vector2d truth_m(double(i) / (fixes - 1), 0.1 * (i % 3));
    plot.fixes.push_back({truth_m, truth_m + Eigen::Vector2d(0.001, 0)});
  }
  return plot;
}

TEST(ChooseErrorScale, ScalesP90To4To10PercentOfWidthUnlessLarger) {
  EXPECT_DOUBLE_EQ(choose_error_scale(0.001, 1), 100);
  EXPECT_DOUBLE_EQ(choose_error_scale(0.0011, 1), 50);
  EXPECT_DOUBLE_EQ(choose_error_scale(0.5, 1), 1) << "never smaller than they are";
  EXPECT_DOUBLE_EQ(choose_error_scale(0, 1), 1);
}

TEST(ErrorPlot, EnlargesArrowsAndStatesScale) {
  const Drawing drawing = draw_fix_errors(grid(11));
  EXPECT_THAT(drawing.commands, HasSubstr("errors drawn 100 times as long"));
  EXPECT_THAT(drawing.commands, HasSubstr("0.5 0.2 0.1 0 \n"));
  EXPECT_THAT(drawing.commands, HasSubstr("'1 mm'"));
  EXPECT_THAT(drawing.commands, Not(HasSubstr("cut short")));
  const std::string svg = render_plot_as_svg(drawing);
  EXPECT_THAT(svg, HasSubstr("<title>errors</title>"));
  EXPECT_THAT(svg, HasSubstr("a &lt;floor>"));
  EXPECT_EQ(render_plot_as_svg(drawing), svg);
}

TEST(ErrorPlot, TruncatesAndCountsLongArrows) {
  ErrorPlot plot = grid(31);
  plot.fixes[3].fix_m.x() += 5;
  plot.fixes[7].fix_m.y() += 5;
  const std::string commands = draw_fix_errors(plot).commands;
  EXPECT_THAT(commands, HasSubstr("2 beyond 2.5 mm, cut short"));
  EXPECT_THAT(commands, HasSubstr("0.1 0 0.25 0 \n"));
}

TEST(ErrorPlot, ShowsNumberOfMissingFixesAndLampIds) {
  ErrorPlot plot = grid(5);
  plot.missing_m = {{0.3, 0.3}};
  plot.lamps.lamps = {{17, {0.4, 0.2, 2}, {}, {}, {}}};
  const std::string svg = render_plot_as_svg(draw_fix_errors(plot));
  EXPECT_THAT(svg, HasSubstr("no fix: 1"));
  EXPECT_THAT(svg, HasSubstr(">17<"));
}

TEST(ErrorPlot, ReportsThinningOfMissingFixes) {
  ErrorPlot plot = grid(5);
  for (int i = 0; i < 1000; ++i) plot.missing_m.emplace_back(0.001 * i, 0);
  EXPECT_THAT(draw_fix_errors(plot).commands, HasSubstr("no fix: every 5th of 1000 drawn"));
}

TEST(ErrorPlot, TableListsTenLargestErrors) {
  ErrorPlot plot = grid(31);
  plot.fixes[7].fix_m.y() += 0.002;
  plot.fixes[7].image = "0007.png";
  const auto table = draw_fix_errors(plot).table;
  ASSERT_EQ(table.size(), 11U);
  EXPECT_EQ(table[0].back(), "error (mm)");
  EXPECT_EQ(table[1], (std::vector<std::string>{"0007.png", "0.233, 0.100", "1.00, 2.00", "2.24"}));
  EXPECT_EQ(table[2].back(), "1.00");
  EXPECT_TRUE(draw_fix_errors(ErrorPlot{"none", {}, {}, {}}).table.empty());
}

TEST(ErrorPlot, ThinsManyFixesAndKeepsLargestErrors) {
  ErrorPlot plot = grid(100'000);
  plot.fixes[12'345].fix_m.y() += 0.0013;
  const Drawing drawing = draw_fix_errors(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("every 200th of 100000 drawn, and the 20 largest"));
  EXPECT_THAT(drawing.commands, HasSubstr("0.1234512 0 0.1 0.13 \n"));
  EXPECT_LT(render_plot_as_svg(drawing).size(), 350'000u);  // half a kilobyte an arrow
}

TEST(ErrorPlot, RendersOneFixOrNone) {
  ErrorPlot plot = grid(2);
  plot.fixes.pop_back();
  EXPECT_THAT(render_plot_as_svg(draw_fix_errors(plot)), HasSubstr("<svg"));
  plot.fixes.clear();
  plot.missing_m = {{0, 0}};
  EXPECT_THAT(render_plot_as_svg(draw_fix_errors(plot)), HasSubstr("no fix: 1"));
}

}  // namespace
}  // namespace vlp
