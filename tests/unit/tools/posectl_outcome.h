#pragma once

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tools/posectl/posectl.h"

namespace posed {

struct Outcome {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// Runs posectl within the test, as without a terminal.
inline Outcome posectl(std::vector<std::string> arguments) {
  std::ostringstream out;
  std::ostringstream err;
  const int exit_code = run_posectl(std::move(arguments), {out, err, false, false});
  return {exit_code, out.str(), err.str()};
}

}  // namespace posed
