// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulation/scene.h"
#include "support/rejection_message.h"
#include "support/temporary_folder.h"

namespace vlp {

/// Scene that contains every key. Tests depend on its line numbers.
extern const std::string kSceneYaml;

/// Returns kSceneYaml with the first `from` replaced; throws if there is none.
std::string scene_with(const std::string& from, const std::string& to);

Scene read_scene_text(const std::string& yaml);

/// Returns the error message for a scene, as from scene.yaml in no folder; "" if it is valid.
std::string scene_refusal(const std::string& yaml);

/// Returns the error message for scene_with(from, to).
std::string refusal_with(const std::string& from, const std::string& to);

}  // namespace vlp
