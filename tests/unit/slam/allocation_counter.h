#pragma once

namespace posed::test {

/// Calls of the global operator new so far, by all threads. Linking allocation_counter.cpp into a program replaces that operator;
/// it is a file of its own because a compiler that sees both sides takes the pairing of new with free for a mistake. Thread-safe.
long allocation_count();

}  // namespace posed::test
