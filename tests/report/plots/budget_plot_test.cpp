// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/evaluation_plots.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(BudgetPlot, StacksBudgetsInOrderOfTotalVariance) {
  const BudgetPlot plot{"a", {"noise", "lens", "it's"}, {{1e-6, 0, 3e-6}, {2e-6, 0, 2.5e-7}}};
  EXPECT_THAT(plot.compute_fractions(),
              ElementsAre(testing::DoubleEq(0.48), 0, testing::DoubleEq(0.52)));
  const Drawing drawing = draw_budget(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("<< END\n2 0 0.25 \n1 0 3 \nEND"));
  EXPECT_THAT(drawing.commands, Not(HasSubstr("lens")));
  const std::string svg = render_plot_as_svg(drawing);
  EXPECT_THAT(svg, HasSubstr("<title>budget</title>"));
  EXPECT_THAT(svg, HasSubstr("noise, 48 %"));
  EXPECT_THAT(svg, HasSubstr("it's, 52 %"));
  EXPECT_EQ(svg, render_plot_as_svg(drawing));
}

TEST(BudgetPlot, ThinsManyFixesButKeepsLargest) {
  BudgetPlot plot{"a", {"noise"}, {}};
  for (int i = 5000; i > 0; --i) plot.variances_m2.push_back({1e-6 * i});
  const std::string commands = draw_budget(plot).commands;
  EXPECT_THAT(commands, HasSubstr("\n5000 \nEND"));
  EXPECT_THAT(commands, HasSubstr("<< END\n25 \n50 \n"));
}

}  // namespace
}  // namespace vlp
