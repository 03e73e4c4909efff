// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <span>

#include "rig/calibration.h"

namespace vlp {

/// Adds --readout rows|columns.
void add_readout_option(CLI::App& app, std::optional<Readout>& readout);

/// What the option says, or else the calibration, or else the images; says so when it is the
/// images, and warns and takes rows when not even they tell.
Readout readout_for(const std::optional<Readout>& option, const std::optional<Readout>& calibrated,
                    std::span<const std::filesystem::path> images);

}  // namespace vlp
