#pragma once

#include <string>
#include <string_view>
#include <vector>

/// How the configuration and command lines name a network of the detector.
namespace posed {

/// Of the images that a network takes. [pixels]
struct InputSize {
  int width = 0;
  int height = 0;
  friend bool operator==(const InputSize&, const InputSize&) = default;
};

/// A network's file and the sizes of the images that it is to look at: "person.posednet@256x192", width before height, or
/// "person.posednet@384x288+320x256", which looks at each image twice. Reentrant.
struct ModelName {
  std::string file;
  std::vector<InputSize> sizes = {};  ///< none: as the file says, and as `{file}` alone means

  friend bool operator==(const ModelName&, const ModelName&) = default;
};

/// What does not end in `@WIDTHxHEIGHT`, or several sizes with a + between, all from 1 to 9999, is a file's name as a whole.
ModelName parse_model_name(std::string_view text);
std::string to_string(const ModelName& name);

}  // namespace posed
