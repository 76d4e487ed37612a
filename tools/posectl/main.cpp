#include <iostream>
#include <string>
#include <unistd.h>
#include <vector>

#include "tools/posectl/posectl.h"

int main(int argc, char** argv) {
  const posed::Console console{std::cout, std::cerr, ::isatty(STDOUT_FILENO) == 1, ::isatty(STDERR_FILENO) == 1};
  return posed::run_posectl(std::vector<std::string>(argv + 1, argv + argc), console);
}
