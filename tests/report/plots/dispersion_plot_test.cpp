// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/calibration_plots.h"

#include <gmock/gmock.h>

#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class DispersionPlotTest : public testing::Test {
 protected:
  TemporaryFolder folder;
  DispersionPlot plot{"a 'title'",
                      {{{0.01, 0}, {0, 0.01}}, {{0, 0}, 0.01}},
                      {{{0.001, 0}, {0, 0.001}}, {{0, 0}, 0.001}},
                      {}};

  std::string rendered(const char* name) {
    write_plot(folder / name, draw_dispersion(plot));
    return TemporaryFolder::read_content(folder / name);
  }
};

TEST_F(DispersionPlotTest, RendersReproduciblePngOrSvgByExtension) {
  EXPECT_THAT(rendered("a.png"), StartsWith("\x89PNG"));
  EXPECT_EQ(rendered("a.png"), rendered("a.png"));
  EXPECT_THAT(rendered("a.svg"), HasSubstr("a 'title'"));
  EXPECT_THAT(rejection_message([&] { write_plot(folder / "a.gif", draw_dispersion(plot)); }),
              HasSubstr("a.gif: a picture's name should end in"));
}

TEST_F(DispersionPlotTest, LabelsOutliersOnlyIfThereAreAny) {
  EXPECT_THAT(rendered("a.svg"), Not(HasSubstr("rejected")));
  plot.outliers_m = {{0.05, 0.05}};
  EXPECT_THAT(rendered("a.svg"), HasSubstr("rejected"));
}

TEST_F(DispersionPlotTest, RendersSingleFixBeforeAndAfterCorrection) {
  plot.before = {{{0.01, 0}}, {{0.01, 0}, 0}};
  plot.after = {{{0, 0}}, {{0, 0}, 0}};
  EXPECT_THAT(draw_dispersion(plot).commands, AllOf(HasSubstr("$before << END\n10 0 \nEND\n"),
                                                    HasSubstr("$after << END\n0 0 \nEND\n")));
  EXPECT_THAT(rendered("a.svg"), AllOf(HasSubstr("<svg"), HasSubstr("before"), HasSubstr("after"),
                                       HasSubstr("reference point")));
}

}  // namespace
}  // namespace vlp
