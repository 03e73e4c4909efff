// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/floor_plot.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include "report/plots/gnuplot.h"
#include "report/plots/plot_parts.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class FloorPlotTest : public testing::Test {
 protected:
  TemporaryFolder folder;
  LampMap lamps{{{7, {0, 0, 2}, {}, {}, {}}}};
  FloorPlot plot{"a 'title'", "label (mm)", 0.5, {{{0, 0}, 1.0}, {{0.5, 0}, 2.0}, {{1, 0}, {}}}};
};

TEST_F(FloorPlotTest, RendersPngOrSvgByExtension) {
  write_floor_plot(folder / "a.png", plot, lamps);
  EXPECT_THAT(TemporaryFolder::read_content(folder / "a.png"), StartsWith("\x89PNG"));
  write_floor_plot(folder / "a.svg", plot, lamps);
  const std::string svg = TemporaryFolder::read_content(folder / "a.svg");
  EXPECT_THAT(svg, HasSubstr("<svg"));
  EXPECT_THAT(svg, HasSubstr("a 'title'"));
  EXPECT_THAT(svg, HasSubstr(">7<"));
}

TEST_F(FloorPlotTest, WritesIdenticalFilesOnRepeat) {
  for (const char* name : {"a.png", "a.svg"}) {
    write_floor_plot(folder / name, plot, lamps);
    const std::string first = TemporaryFolder::read_content(folder / name);
    ASSERT_FALSE(first.empty()) << name;
    write_floor_plot(folder / name, plot, lamps);
    EXPECT_EQ(TemporaryFolder::read_content(folder / name), first);
  }
}

TEST_F(FloorPlotTest, RejectsExtensionOtherThanPngOrSvg) {
  EXPECT_THAT(rejection_message([&] { write_floor_plot(folder / "a.gif", plot, lamps); }),
              HasSubstr("a.gif: a picture's name should end in .png or .svg"));
}

TEST_F(FloorPlotTest, KeepsExistingFileWhenGnuplotFails) {
  const auto file = folder.file("a.png", "old");
  EXPECT_THAT(rejection_message([&] {
                write_plot(file, {"a", 100, 100, "plot nonsense\n"});
              }),
              HasSubstr("a.png: cannot be drawn"));
  EXPECT_EQ(TemporaryFolder::read_content(file), "old");
}

TEST_F(FloorPlotTest, NamesSystemErrorWhenGnuplotScriptCannotBeCreated) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &before), 0);
  rlimit none = before;
  none.rlim_cur = 0;
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  const std::string refusal =
      rejection_message([&] { write_floor_plot(folder / "a.png", plot, lamps); });
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_THAT(refusal, HasSubstr("a.png: cannot be drawn: gnuplot cannot be started: "
                                 "Too many open files"));
}

TEST(QuoteForGnuplot, DoublesSingleQuotesAndKeepsOtherCharacters) {
  EXPECT_EQ(quote_for_gnuplot("it's `ls` $x"), "'it''s `ls` $x'");
}

}  // namespace
}  // namespace vlp
