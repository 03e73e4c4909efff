// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/junit.h"

#include <gmock/gmock.h>

#include <pugixml.hpp>

namespace vlp {
namespace {

TEST(MakeGateTests, MarksOnlyGatesThatDidNotPassAsFailed) {
  const std::vector<CheckedMetric> gates{{"mean_mm", "mm", 1.25, 1, Direction::at_most},
                                         {"missing_fraction", "", 0, 0, Direction::at_most},
                                         {"split_half_px", "px", {}, 1, Direction::at_most}};
  const auto tests = make_gate_tests(gates);
  ASSERT_EQ(tests.size(), 3);
  EXPECT_EQ(tests[0].name, "mean_mm");
  EXPECT_EQ(tests[0].result, JUnitTest::Result::failed);
  EXPECT_EQ(
      tests[0].message,
      "the errors of the fixes exceed the limit (mean_mm is 1.25 mm, at most 1 mm is required)");
  EXPECT_EQ(tests[1].result, JUnitTest::Result::passed);
  EXPECT_EQ(tests[1].message, "");
  EXPECT_EQ(tests[2].result, JUnitTest::Result::failed);
  EXPECT_THAT(tests[2].message, testing::HasSubstr("split_half_px is not known, at most 1 px is"));
}

TEST(FormatJunitXml, WritesEachResultWithMessageAndWarnings) {
  const std::vector<JUnitTest> tests{
      {"lens", JUnitTest::Result::passed, "", "", {"one", "two & three"}},
      {"mean_mm", JUnitTest::Result::failed, "mean_mm is <2>"},
      {"rotation", JUnitTest::Result::error, "lamp 2 moved \x01\xff", "wrong_map"}};
  pugi::xml_document document;
  ASSERT_TRUE(document.load_string(format_junit_xml("vlp-calibrate", tests).c_str()));
  const pugi::xml_node suite = document.child("testsuites").child("testsuite");
  EXPECT_STREQ(suite.attribute("name").value(), "vlp-calibrate");
  EXPECT_EQ(suite.attribute("tests").as_int(), 3);
  EXPECT_EQ(suite.attribute("failures").as_int(), 1);
  EXPECT_EQ(suite.attribute("errors").as_int(), 1);
  const pugi::xml_node passed = suite.child("testcase");
  const pugi::xml_node failed = passed.next_sibling("testcase");
  const pugi::xml_node error = failed.next_sibling("testcase");
  ASSERT_TRUE(error);
  EXPECT_STREQ(passed.attribute("name").value(), "lens");
  EXPECT_FALSE(passed.child("failure"));
  EXPECT_FALSE(passed.child("error"));
  EXPECT_STREQ(passed.child("system-err").text().get(), "one\ntwo & three\n");
  EXPECT_STREQ(failed.child("failure").attribute("message").value(), "mean_mm is <2>");
  EXPECT_FALSE(failed.child("system-err"));
  EXPECT_STREQ(error.child("error").attribute("type").value(), "wrong_map");
  EXPECT_STREQ(error.child("error").attribute("message").value(), "lamp 2 moved \\x01\\xff");
}

}  // namespace
}  // namespace vlp
