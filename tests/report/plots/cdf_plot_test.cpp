// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/evaluation_plots.h"

#include <gmock/gmock.h>

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

TEST(CdfPlot, HasStepForEachErrorAndMarksP50AndP90) {
  const CdfPlot plot{"a", {{"it's", {0.004, 0.001, 0.003, 0.002}, 0.002, 0.004}}};
  const Drawing drawing = draw_error_cdf(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("0 0 \n1 25 \n2 50 \n3 75 \n4 100 \n"));
  EXPECT_THAT(drawing.commands, HasSubstr("2 50 \n4 90 \n"));
  EXPECT_THAT(drawing.commands, Not(HasSubstr("outside the plot")));
  const std::string svg = render_plot_as_svg(drawing);
  EXPECT_THAT(svg, HasSubstr("<title>cdf</title>"));
  EXPECT_THAT(svg, HasSubstr("it's: p50 2 mm, p90 4 mm"));
}

TEST(CdfPlot, StatesLargestErrorThatIsOutsidePlot) {
  std::vector<double> errors_m(100, 0.001);
  errors_m[50] = 1;
  const CdfPlot plot{"a", {{"b", errors_m, 0.001, 0.001}}};
  EXPECT_THAT(draw_error_cdf(plot).commands,
              HasSubstr("the largest, 1000 mm, is outside the plot"));
}

TEST(CdfPlot, ThinsManyErrorsButKeepsLargest) {
  std::vector<double> errors_m;
  for (int i = 100'000; i > 0; --i) errors_m.push_back(1e-8 * i);
  const CdfPlot plot{"a", {{"b", errors_m, 0.0005, 0.0009}, {"c", errors_m, 0.0005, 0.0009}}};
  const Drawing drawing = draw_error_cdf(plot);
  EXPECT_THAT(drawing.commands, HasSubstr("\n1 100 \n"));
  EXPECT_LT(render_plot_as_svg(drawing).size(), 100'000u);
}

TEST(CdfPlot, RendersAllZeroErrors) {
  const Drawing drawing = draw_error_cdf(CdfPlot{"a", {{"b", {0, 0}, 0, 0}}});
  EXPECT_THAT(drawing.commands, HasSubstr("\n0 0 \n0 50 \n0 100 \n"));
  EXPECT_THAT(drawing.commands, HasSubstr("\n0 50 \n0 90 \n"));
  EXPECT_THAT(render_plot_as_svg(drawing),
              AllOf(HasSubstr("<svg"), HasSubstr("b: p50 0 mm, p90 0 mm")));
}

}  // namespace
}  // namespace vlp
