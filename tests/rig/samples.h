// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "rig/board.h"
#include "rig/calibration.h"
#include "rig/input_error.h"
#include "rig/lamp_map.h"
#include "support/temporary_folder.h"

namespace vlp {

/// The three formats with every key that they have, as other programs write and read them, byte
/// for byte as the toolbox writes them. The values behind them are below.
extern const std::string kLampsYaml;
extern const std::string kBoardYaml;
extern const std::string kCalibrationYaml;

LampMap sample_lamps();
Board sample_board();
/// Every part, every optional key, and a history with inputs.
Calibration sample_calibration();
/// Only the required parts of a calibration.
Calibration bare_calibration();

void expect_same(const LampMap& found, const LampMap& expected);
void expect_same(const Board& found, const Board& expected);
void expect_same(const Calibration& found, const Calibration& expected);

/// Returns `text` with its first `from` replaced; fails the test if there is none.
std::string changed(std::string text, const std::string& from, const std::string& to);

/// Returns the message of the InputError that `read` throws for `file`, without the folder's name;
/// "" if it does not throw. Other exceptions fail the test.
template <typename Read>
std::string refusal(Read read, const std::filesystem::path& file) {
  try {
    read(file);
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const std::string folder = file.parent_path().string() + "/";
    return message.starts_with(folder) ? message.substr(folder.size()) : message;
  } catch (const std::exception& error) {
    ADD_FAILURE() << "not an InputError: " << error.what();
  }
  return "";
}

/// Returns the message for `yaml` as lamps.yaml.
inline std::string map_refusal(const std::string& yaml) {
  const TemporaryFolder folder;
  return refusal(read_lamp_map, folder.file("lamps.yaml", yaml));
}

}  // namespace vlp
