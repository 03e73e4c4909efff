// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "station/records/run_record.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "numbered_runs.h"
#include "support/rejection_message.h"

namespace vlp {
namespace {

using testing::SizeIs;

TEST(MakeRunId, ReturnsUniqueIdWithStartTime) {
  EXPECT_EQ(start_utc_of_run_id("20261121T134501Z-0123456789abcdef"), "2026-11-21T13:45:01Z");
  EXPECT_EQ(start_utc_of_run_id("run"), "");
  const std::string run = make_run_id();
  EXPECT_THAT(run, SizeIs(33));
  EXPECT_LE(start_utc_of_run_id(run), get_current_utc());
  EXPECT_NE(run, make_run_id());
  EXPECT_TRUE(is_run_id(run));
  for (const std::string& other : {std::string(), run + "0", "../../../" + run, "x" + run.substr(1),
                                   run.substr(0, 32) + "/"}) {
    EXPECT_FALSE(is_run_id(other)) << other;
  }
}

TEST(MakeRunId, SortsByTimeWithinSecond) {
  std::vector<std::string> runs;
  for (int i = 0; i < 50; ++i) {
    runs.push_back(make_run_id());
    std::this_thread::sleep_for(std::chrono::microseconds(2));
  }
  EXPECT_TRUE(std::ranges::is_sorted(runs)) << testing::PrintToString(runs);
}

TEST(EscapeRun, KeepsLineBreaksOnlyInCausesAndCalibration) {
  RunRecord run;
  run.operator_name = "J\xf6rg\n";
  run.causes = "first\nsecond\n";
  run.calibration = "camera:\n  id: 1\n";
  run.images = {{"boards", "a\n.png", "", "\x1b"}};
  run.events = {{"", "", "why\n", "who\n"}};
  const RunRecord printed = escape_run(run);
  EXPECT_EQ(printed.operator_name, "J\\xf6rg\\x0a");
  EXPECT_EQ(printed.causes, run.causes);
  EXPECT_EQ(printed.calibration, run.calibration);
  EXPECT_EQ(printed.images[0].name, "a\\x0a.png");
  EXPECT_EQ(printed.images[0].rejection, "\\x1b");
  EXPECT_EQ(printed.events[0].text, "why\\x0a");
  EXPECT_EQ(printed.events[0].author, "who\\x0a");
}

TEST(DescribeClockProblem, ReportsRunThatEndedBeforeItsStart) {
  RunRecord run;
  run.begun_utc = run.ended_utc = "2026-11-21T13:45:01Z";
  EXPECT_EQ(describe_clock_problem(run), "");
  run.ended_utc = "2026-11-21T13:45:00Z";
  EXPECT_EQ(describe_clock_problem(run),
            "the clock went back: the run ended 2026-11-21T13:45:00Z, before it began "
            "2026-11-21T13:45:01Z: set the clock, and measure again");
}

TEST(ParseRunDocument, ReturnsAllFieldsOfSerializedRun) {
  RunRecord run = numbered_run(1);
  for (const RunField& field : list_run_fields()) run.*field.text += "\"\\ \xc3\xbc{}";
  for (std::string* lines : {&run.causes, &run.calibration}) lines->append("\n\tof lines\n");
  run.images[0].name = "\xff\x1b[31m.png";
  run.images[1].rejection = "too dark";
  const std::string document = serialize_run(run);
  const RunRecord read = parse_run_document(document);
  EXPECT_EQ(serialize_run(read), document);
  for (const RunField& field : list_run_fields()) EXPECT_EQ(read.*field.text, run.*field.text);
  ASSERT_THAT(read.metrics, SizeIs(run.metrics.size()));
  for (std::size_t i = 0; i < run.metrics.size(); ++i) {
    EXPECT_EQ(read.metrics[i].name, run.metrics[i].name);
    EXPECT_EQ(read.metrics[i].unit, run.metrics[i].unit);
    EXPECT_EQ(read.metrics[i].value, run.metrics[i].value);  // to the last bit
    EXPECT_EQ(read.metrics[i].limit, run.metrics[i].limit);
    EXPECT_EQ(read.metrics[i].direction, run.metrics[i].direction);
    ASSERT_EQ(read.metrics[i].guard_band.has_value(), i == 0);
    if (!read.metrics[i].guard_band) continue;
    EXPECT_EQ(read.metrics[i].guard_band->standard_uncertainty, 0.01);
    EXPECT_EQ(read.metrics[i].guard_band->k, 1.645);
  }
  ASSERT_THAT(read.images, SizeIs(run.images.size()));
  EXPECT_EQ(read.images[0].name, "\\xff\\x1b[31m.png");
  EXPECT_EQ(read.images[1].rejection, "too dark");
  EXPECT_EQ(read.images[29].sha256, run.images[29].sha256);
}

TEST(ParseRunDocument, ThrowsWithCauseForInvalidDocument) {
  const std::string text = serialize_run(numbered_run(1));
  for (const auto& [bad, cause] : std::vector<std::pair<std::string, std::string>>{
           {"{}", "format"},
           {"[]", ""},
           {text.substr(0, text.size() / 2), ""},
           {std::string(text).replace(text.find("vlp-run/3"), 9, "vlp-run/2"), "another format"},
           {std::string(text).replace(text.find("\"metrics\""), 9, "\"metricz\""), "metrics"},
           {std::string(text).replace(text.find("FAIL"), 4, ""), "no run, or no verdict"},
           {std::string(1'000'000, '['), "it has more than 16 levels"}}) {
    EXPECT_THAT(
        rejection_message<std::runtime_error>([&, &text = bad] { parse_run_document(text); }),
        testing::AllOf(testing::StartsWith("is no run of a station: "), testing::HasSubstr(cause)));
  }
}

}  // namespace
}  // namespace vlp
