// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulation/scene.h"
#include "support/refused.h"
#include "support/temporary_folder.h"

namespace vlp {

/// A scene with every key there is. Tests count on its lines.
extern const std::string kSceneYaml;

/// kSceneYaml with the first `from` replaced; throws when there is none.
std::string scene_with(const std::string& from, const std::string& to);

Scene scene_of(const std::string& yaml);

/// The message with which a scene is refused, as of scene.yaml in no folder; "" when it is not.
std::string scene_refusal(const std::string& yaml);

/// That of scene_with(from, to).
std::string refusal_with(const std::string& from, const std::string& to);

}  // namespace vlp
