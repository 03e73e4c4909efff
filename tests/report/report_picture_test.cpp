// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/report_picture.h"

#include <gmock/gmock.h>

#include "report/plots/calibration_plots.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(ReadReportPlot, AssignsReportPartByTitleOfOwnPlots) {
  const TemporaryFolder folder;
  write_plot(folder / "a.svg",
             make_rotation_plot_drawing(RotationPlot{"", {}, {203, 198}, {210, 190}}));
  EXPECT_EQ(read_report_plot(folder / "a.svg").part, ReportPart::rotation);
  write_plot(folder / "b.svg", make_dispersion_plot_drawing(DispersionPlot{
                                   "", {{{0.01, 0}}, {{0, 0}, 0.01}}, {{}, {}}, {}}));
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
