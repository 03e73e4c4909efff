// SPDX-FileCopyrightText: The VLP calibration toolbox authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/stat.h>

namespace vlp {

/// Gives an open file the mode, the owner and the group of the file that it replaces, owner and
/// group as far as this process may set them. If the group is another one, it has no permissions.
/// Returns false, and sets errno, if the mode cannot be set.
[[gnu::visibility("hidden")]] bool keep_mode_and_owner(int descriptor, const struct stat& former);

}  // namespace vlp
