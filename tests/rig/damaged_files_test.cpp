// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <random>

#include "rig/samples.h"

namespace vlp {
namespace {

template <typename Read>
void expect_refused_when_cut(const TemporaryFolder& folder, Read read, const std::string& whole) {
  const auto file = folder.file("cut.yaml", whole);
  for (std::size_t bytes = whole.size(); bytes-- > 0;) {
    std::filesystem::resize_file(file, bytes);
    EXPECT_NE(refusal(read, file), "") << "after " << bytes << " bytes";
  }
  std::filesystem::remove(file);
}

TEST(ReadBoard, RejectsFileTruncatedAtAnyByte) {
  const TemporaryFolder folder;
  expect_refused_when_cut(folder, read_board, kBoardYaml);
}

TEST(ReadCalibration, RejectsFileTruncatedAtAnyByte) {
  const TemporaryFolder folder;
  for (unsigned parts = 0; parts < 1U << 4; ++parts) {
    SCOPED_TRACE(parts);
    Calibration calibration = sample_calibration();
    if ((parts & 1U) != 0) calibration.intrinsics_report.reset();
    if ((parts & 2U) != 0) calibration.rotation_center.reset();
    if ((parts & 4U) != 0) calibration.history.clear();
    if ((parts & 8U) != 0) calibration.dispersion.reset(), calibration.history.resize(1);
    if (calibration.history.size() == 1) calibration.history = {{"camera", "p", "v", "o", {}}};
    write_calibration(folder / "whole.yaml", calibration);
    expect_refused_when_cut(folder, read_calibration, folder.read_content(folder / "whole.yaml"));
  }
}

// The format does not contain the number of lamps.
TEST(ReadLampMap, AcceptsTruncationOnlyAfterCompleteLampLine) {
  const TemporaryFolder folder;
  const auto file = folder.file("lamps.yaml", kLampsYaml);
  int maps = 0;
  for (std::size_t bytes = kLampsYaml.size(); bytes-- > 0;) {
    std::filesystem::resize_file(file, bytes);
    if (!refusal(read_lamp_map, file).empty()) continue;
    EXPECT_TRUE(kLampsYaml.substr(0, bytes).ends_with("}\n")) << bytes;
    EXPECT_EQ(read_lamp_map(file).lamps.size(), 1U);
    ++maps;
  }
  EXPECT_EQ(maps, 1);
}

class Damage {
 public:
  /// Damages one to four places: changes, inserts or removes a byte, or duplicates a piece.
  std::string done_to(std::string text) {
    for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
      const std::size_t at = below(text.size());
      switch (below(5)) {
        case 0:
          text[at] = byte();
          break;
        case 1:
          text.insert(at, 1, byte());
          break;
        case 2:
          text.erase(at, 1 + below(8));
          break;
        case 3:
          text.insert(below(text.size()), text.substr(at, below(40)));
          break;
        default:
          text[at] = text[below(text.size())];
      }
    }
    return text;
  }

 private:
  std::size_t below(std::size_t count) { return random_() % count; }
  char byte() {
    constexpr std::string_view special = "{}[]:,-#\"'&*!|>%@`?<~. \n\r\t0123456789eE+_\\x";
    return below(3) == 0 ? static_cast<char>(below(256)) : special[below(special.size())];
  }
  std::mt19937_64 random_{4};
};

/// Expects an InputError, or a result that can be written and read again.
template <typename Read, typename Write>
void expect_read_or_refused(const std::string& whole, Read read, Write write) {
  const TemporaryFolder folder;
  Damage damage;
  int times_read = 0;
  constexpr int times = 2000;
  for (int i = 0; i < times; ++i) {
    const std::string text = damage.done_to(whole);
    SCOPED_TRACE(text);
    const auto file = folder.file("damaged.yaml", text);
    const std::string refused = refusal(read, file);
    if (refused.empty() && ++times_read % 8 == 1) {  // to write takes long
      const auto found = read(file);
      write(folder / "again.yaml", found);
      expect_same(read(folder / "again.yaml"), found);
    }
    std::filesystem::remove(file);  // file systems are slow to overwrite
    if (testing::Test::HasFailure()) return;
  }
  // Both outcomes are frequent; otherwise little is tested.
  EXPECT_GT(times_read, 10);
  EXPECT_LT(times_read, times / 2);
}

TEST(ReadLampMap, RoundTripsOrRejectsRandomlyDamagedFile) {
  expect_read_or_refused(kLampsYaml, read_lamp_map, write_lamp_map);
}

TEST(ReadBoard, RoundTripsOrRejectsRandomlyDamagedFile) {
  expect_read_or_refused(kBoardYaml, read_board, write_board);
}

TEST(ReadCalibration, RoundTripsOrRejectsRandomlyDamagedFile) {
  expect_read_or_refused(kCalibrationYaml, read_calibration, write_calibration);
}

}  // namespace
}  // namespace vlp
