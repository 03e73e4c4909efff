// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report_picture.h"

#include <gmock/gmock.h>

#include <regex>

#include "report/plots/calibration_plots.h"
#include "report/plots/evaluation_plots.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ReadReportPlot, AssignsReportPartByTitleOfOwnPlots) {
  const TemporaryFolder folder;
  write_plot(folder / "a.svg", draw_rotation(RotationPlot{"", {}, {203, 198}, {210, 190}}));
  EXPECT_EQ(read_report_plot(folder / "a.svg").part, ReportPart::rotation);
  write_plot(folder / "b.svg",
             draw_dispersion(DispersionPlot{"", {{{0.01, 0}}, {{0, 0}, 0.01}}, {{}, {}}, {}}));
  const ReportPlot picture = read_report_plot(folder / "b.svg");
  EXPECT_EQ(picture.part, ReportPart::dispersion);
  EXPECT_EQ(picture.image, TemporaryFolder::read_content(folder / "b.svg"));
  EXPECT_THAT(picture.caption, HasSubstr("reference point"));
  EXPECT_THAT(picture.alt, HasSubstr("dispersion"));
}

TEST(ReadReportPlot, CaptionsUnknownImagesWithFileName) {
  const TemporaryFolder folder;
  const auto file = folder.file("my room.svg", "<?xml?><svg><title>else</title></svg>");
  EXPECT_EQ(read_report_plot(file).part, ReportPart::other);
  EXPECT_EQ(read_report_plot(file).caption, "my room.svg");
  EXPECT_EQ(read_report_plot(folder.file("a.png", "\x89PNG...IEND\xAE\x42\x60\x82")).part,
            ReportPart::other);
}

TEST(RenderPlotAsSvg, PrintsNoWarningsOfGnuplot) {
  testing::internal::CaptureStderr();
  const std::string svg = render_plot_as_svg(
      {"flat", 400, 300, "set size ratio -1\nset xrange [0:1]\nset yrange [0:1e-6]\nplot x\n"});
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(svg, HasSubstr("<svg"));
}

/// Removes the groups without content, in which gnuplot leaves the pen of the plot before.
std::string remove_empty_groups(const std::string& svg) {
  return std::regex_replace(svg, std::regex("<g [^>]*>\\n</g>\\n"), "");
}

/// Settings of one plot must not change the next one.
TEST(RenderPlots, RendersSameImagesTogetherAsOneByOne) {
  ErrorPlot errors{"Errors", {}, {{0.3, 0.3}}, {}};
  errors.lamps.lamps = {{17, {0.4, 0.2, 2}, {}, {}, {}}};
  for (int i = 0; i < 5; ++i) errors.fixes.push_back({{0.1 * i, 0}, {0.1 * i, 0.002}, "a"});
  const std::vector<Drawing> drawings{
      draw_fix_errors(errors),
      draw_error_cdf({"Distribution", {{"fixes", {0.001, 0.002, 0.004}, 0.002, 0.003}}}),
      draw_budget({"Budget", {"noise", "lens"}, {{1e-6, 2e-6}}}),
      draw_line_drive({"Drive",
                       {{{0, 0}, {1, 0}}},
                       {{0, 0.001}, {0.5, 0.002}, {1, 0}},
                       {{{0, 0.001}, {1, 0.001}}}}),
      draw_dispersion(DispersionPlot{"Offset", {{{0.01, 0}}, {{0, 0}, 0.01}}, {{}, {}}, {}}),
      draw_fix_errors(errors)};
  std::vector<ReportPlot> plots;
  for (const Drawing& drawing : drawings) plots.push_back(make_report_plot(drawing));
  plots.insert(plots.begin() + 1, {ReportPart::other, "image", "", ""});
  render_plots(plots);
  EXPECT_EQ(plots[1].image, "image");
  plots.erase(plots.begin() + 1);
  EXPECT_EQ(plots[1].part, ReportPart::distribution);
  ASSERT_EQ(plots.size(), drawings.size());
  for (std::size_t i = 0; i < plots.size(); ++i) {
    EXPECT_EQ(remove_empty_groups(plots[i].image),
              remove_empty_groups(render_plot_as_svg(drawings[i])))
        << i;
    EXPECT_THAT(plots[i].image, HasSubstr("</svg>"));
    EXPECT_FALSE(plots[i].drawing);
  }
}

TEST(ReadReportPlot, RejectsMissingEmptyTruncatedOrTooLongFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(rejection_message([&] { read_report_plot(folder / "none.svg"); }),
              HasSubstr("none.svg: cannot be opened"));
  EXPECT_THAT(rejection_message([&] { read_report_plot(folder.file("a.svg", "")); }),
              HasSubstr("a.svg: is neither an SVG nor a PNG"));
  EXPECT_THAT(rejection_message([&] { read_report_plot(folder.file("b.svg", "x,y\n")); }),
              HasSubstr("b.svg: is neither"));
  for (const char* cut : {"<?xml?><svg><title>else</title>", "<svg></svg>", "\x89PNG.."}) {
    EXPECT_THAT(rejection_message([&] { read_report_plot(folder.file("d.svg", cut)); }),
                HasSubstr("d.svg: is cut short"))
        << cut;
  }
  const std::string long_svg = "<svg>" + std::string((16u << 20) + 1, ' ');
  EXPECT_THAT(rejection_message([&] { read_report_plot(folder.file("c.svg", long_svg)); }),
              HasSubstr("c.svg: is longer than 16 MiB"));
}

}  // namespace
}  // namespace vlp
