// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/calibration_plots.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class IntrinsicsPlotTest : public testing::Test {
 protected:
  /// gnuplot's stderr is passed through to the user; it has to be empty.
  std::string render_plot_as_svg(const IntrinsicsPlot& intrinsics_plot) const {
    testing::internal::CaptureStderr();
    write_plot(folder / "a.svg", draw_intrinsics(intrinsics_plot));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
    return TemporaryFolder::read_content(folder / "a.svg");
  }

  TemporaryFolder folder;
  /// RMS per axis: 0.1 px.
  IntrinsicsPlot plot{"a 'title'",
                      {800, 600},
                      {{{100, 50}, {0.1, 0.1}, false},
                       {{400, 300}, {-0.1, 0.1}, false},
                       {{700, 500}, {3, 0}, true}},
                      3,
                      {0.4, 0.3, 0.4, 0.2, 0.03, 0.2, 0.4, 0.3, 0.4}};
};

TEST_F(IntrinsicsPlotTest, ShowsCornerCountArrowScaleAndSdLevels) {
  const std::string svg = render_plot_as_svg(plot);
  for (const char* text : {"a 'title'", "2 corners", "1 outliers", "200 times as long",
                           "standard deviation (px)", "0.05", "0.1", "0.2", "0.5"}) {
    EXPECT_THAT(svg, HasSubstr(text));
  }
  EXPECT_THAT(svg, AllOf(HasSubstr("u (px)"), HasSubstr("v (px)")));
  plot.corners.pop_back();
  EXPECT_THAT(render_plot_as_svg(plot), Not(HasSubstr("outliers")));
}

TEST_F(IntrinsicsPlotTest, RendersReproduciblePngOrSvgByExtension) {
  write_plot(folder / "a.png", draw_intrinsics(plot));
  const std::string first = TemporaryFolder::read_content(folder / "a.png");
  EXPECT_THAT(first, StartsWith("\x89PNG"));
  write_plot(folder / "a.png", draw_intrinsics(plot));
  EXPECT_EQ(TemporaryFolder::read_content(folder / "a.png"), first);
  const std::string svg = render_plot_as_svg(plot);
  ASSERT_FALSE(svg.empty());
  EXPECT_EQ(render_plot_as_svg(plot), svg);
  EXPECT_THAT(rejection_message([&] { write_plot(folder / "a.gif", draw_intrinsics(plot)); }),
              HasSubstr("a.gif: a picture's name should end in .png or .svg"));
}

TEST_F(IntrinsicsPlotTest, LeavesUnknownSdsBlankAndStatesWhenAllAreUnknown) {
  const std::string whole = render_plot_as_svg(plot);
  plot.sd_px[0] = std::numeric_limits<double>::infinity();
  const std::string part = render_plot_as_svg(plot);
  EXPECT_NE(part, whole);
  EXPECT_THAT(draw_intrinsics(plot).commands, HasSubstr("$map << END\n0 0 NaN\n"));
  EXPECT_THAT(part, HasSubstr("0.05"));
  plot.sd_px.assign(9, std::nan(""));
  EXPECT_THAT(render_plot_as_svg(plot), AllOf(HasSubstr("not determined"), HasSubstr("2 corners")));
}

TEST_F(IntrinsicsPlotTest, RendersConstantSdMapAndZeroResiduals) {
  plot.sd_px.assign(9, 0.2);
  for (auto& corner : plot.corners) corner = {corner.detected_px, {0, 0}, false};
  EXPECT_THAT(render_plot_as_svg(plot),
              AllOf(HasSubstr("3 corners"), HasSubstr("1 times as long")));
}

TEST(ChooseResidualScale, ReturnsRoundNumberThatScalesRmsTo1To2Point5PercentOfWidth) {
  EXPECT_DOUBLE_EQ(choose_residual_scale(0.1, 800), 200);
  EXPECT_DOUBLE_EQ(choose_residual_scale(0.11, 800), 100);
  EXPECT_DOUBLE_EQ(choose_residual_scale(1, 4000), 100);
  EXPECT_DOUBLE_EQ(choose_residual_scale(40, 800), 0.5);
  EXPECT_DOUBLE_EQ(choose_residual_scale(0, 800), 1);
  for (const double rms_px : {0.013, 0.05, 0.17, 0.48, 1.3}) {
    const double length_px = rms_px * choose_residual_scale(rms_px, 800);
    EXPECT_LE(length_px, 800 / 40.0);
    EXPECT_GE(length_px, 800 / 100.0);
  }
}

}  // namespace
}  // namespace vlp
