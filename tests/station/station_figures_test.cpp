// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/station_figures.h"

#include <gmock/gmock.h>

#include <limits>
#include <set>

#include "station/run_record.h"

namespace vlp {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::SizeIs;

TEST(StationFigures, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const FigureKind& kind : station_figures()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_STRNE(kind.cause, "");
    EXPECT_STRNE(kind.meaning, "");
  }
}

TEST(StationFigures, AreMetUpToTheLimitOrFromItOn) {
  EXPECT_TRUE((StationFigure{"rms_px", 0.3, 0.3, false}).met());
  EXPECT_FALSE((StationFigure{"rms_px", 0.31, 0.3, false}).met());
  EXPECT_TRUE((StationFigure{"coverage", 0.7, 0.7, true}).met());
  EXPECT_FALSE((StationFigure{"coverage", 0.69, 0.7, true}).met());
  EXPECT_TRUE((StationFigure{"rms_px", 9, {}, false}).met());
  EXPECT_FALSE((StationFigure{"rms_px", {}, 0.3, false}).met());
}

TEST(StationFigures, OfAGateAreThereWithoutAValue) {
  const std::vector<Metric> values{{"tilt_deg", 1},
                                   {"rms_px", std::numeric_limits<double>::infinity()}};
  const std::vector<StationGate> gates{{"rms_px", 0.3}};
  const auto figures = with_gates(values, gates);
  ASSERT_THAT(figures, SizeIs(2));
  EXPECT_EQ(figures[0].name, "rms_px");
  EXPECT_FALSE(figures[0].value);
  EXPECT_FALSE(figures[0].met());
  EXPECT_EQ(figures[1].value, 1);
  EXPECT_THAT(cause_of(figures[0]), AllOf(HasSubstr("not known"), HasSubstr("0.3")));
}

TEST(LibraryVersions, NamesThoseThatTheResultRestsOn) {
  for (const char* library : {"OpenCV ", "AprilTag ", "mrcal ", "Ceres ", "Eigen "}) {
    EXPECT_THAT(library_versions(),
                testing::ContainsRegex(std::string(library) + "[0-9]+\\.[0-9]"));
  }
}

TEST(RunName, TellsWhenTheRunBegan) {
  EXPECT_EQ(begun_utc("20261121T134501Z-0123456789abcdef"), "2026-11-21T13:45:01Z");
  EXPECT_EQ(begun_utc("run"), "");
  const std::string run = new_run();
  EXPECT_THAT(run, SizeIs(33));
  EXPECT_LE(begun_utc(run), now_utc());
  EXPECT_NE(run, new_run());
}

}  // namespace
}  // namespace vlp
