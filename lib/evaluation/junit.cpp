// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include "evaluation/junit.h"

#include <algorithm>
#include <pugixml.hpp>
#include <sstream>

#include "captures/printable.h"

namespace vlp {
namespace {

void append_test(pugi::xml_node suite, const std::string& suite_name, const JUnitTest& test) {
  pugi::xml_node node = suite.append_child("testcase");
  node.append_attribute("classname") = suite_name.c_str();
  node.append_attribute("name") = test.name.c_str();
  const std::string message = escape_for_terminal(test.message);  // XML has no control characters
  if (test.result == JUnitTest::Result::failed) {
    node.append_child("failure").append_attribute("message") = message.c_str();
  }
  if (test.result == JUnitTest::Result::error) {
    pugi::xml_node error = node.append_child("error");
    error.append_attribute("type") = test.error_type.c_str();
    error.append_attribute("message") = message.c_str();
  }
  std::string warnings;
  for (const std::string& warning : test.warnings)
    warnings.append(escape_for_terminal(warning)).append("\n");
  if (!warnings.empty()) node.append_child("system-err").text() = warnings.c_str();
}

}  // namespace

std::vector<JUnitTest> make_gate_tests(std::span<const CheckedMetric> gates) {
  std::vector<JUnitTest> tests;
  tests.reserve(gates.size());
  for (const CheckedMetric& gate : gates) {
    JUnitTest test{gate.name};
    if (!gate.has_passed_gate()) {
      test.result = JUnitTest::Result::failed;
      test.message = describe_failed_gate(gate);
    }
    tests.push_back(std::move(test));
  }
  return tests;
}

std::string format_junit_xml(const std::string& suite_name, std::span<const JUnitTest> tests) {
  const auto count = [&](JUnitTest::Result result) {
    return static_cast<long>(std::count_if(
        tests.begin(), tests.end(), [&](const JUnitTest& test) { return test.result == result; }));
  };
  pugi::xml_document document;
  pugi::xml_node suite = document.append_child("testsuites").append_child("testsuite");
  suite.append_attribute("name") = suite_name.c_str();
  suite.append_attribute("tests") = static_cast<unsigned long>(tests.size());
  suite.append_attribute("failures") = count(JUnitTest::Result::failed);
  suite.append_attribute("errors") = count(JUnitTest::Result::error);
  for (const JUnitTest& test : tests) append_test(suite, suite_name, test);
  std::ostringstream text;
  document.save(text, "  ");
  return text.str();
}

}  // namespace vlp
