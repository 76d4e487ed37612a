#pragma once

#include "core/result.h"

namespace posed {

/// Moves the calling thread, and the processes it starts from then on, into a network namespace of its own in which multicast works
/// over the loopback device, so that tests neither disturb each other nor depend on the machine's routes. Needs the right to make
/// namespaces (root, or user namespaces). Error: Unavailable; the thread's network is then as it was.
Status enter_multicast_namespace();

}  // namespace posed
