// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "report/plots/dispersion_plot.h"

#include <gmock/gmock.h>

#include "support/refused.h"
#include "support/temporary_folder.h"

namespace vlp {
namespace {

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

  std::string drawn(const char* name) {
    draw(folder / name, drawing_of(plot));
    return TemporaryFolder::content_of(folder / name);
  }
};

TEST_F(DispersionPlotTest, RendersReproduciblePngOrSvgByExtension) {
  EXPECT_THAT(drawn("a.png"), StartsWith("\x89PNG"));
  EXPECT_EQ(drawn("a.png"), drawn("a.png"));
  EXPECT_THAT(drawn("a.svg"), HasSubstr("a 'title'"));
  EXPECT_THAT(refusal_of([&] { draw(folder / "a.gif", drawing_of(plot)); }),
              HasSubstr("a.gif: a picture's name should end in"));
}

TEST_F(DispersionPlotTest, MarksOutliersIfAny) {
  EXPECT_THAT(drawn("a.svg"), Not(HasSubstr("left out")));
  plot.outliers_m = {{0.05, 0.05}};
  EXPECT_THAT(drawn("a.svg"), HasSubstr("left out"));
}

TEST_F(DispersionPlotTest, RendersSingleFix) {
  plot.before = {{{0.01, 0}}, {{0.01, 0}, 0}};
  plot.after = {{{0, 0}}, {{0, 0}, 0}};
  EXPECT_THAT(drawn("a.svg"), HasSubstr("<svg"));
}

}  // namespace
}  // namespace vlp
