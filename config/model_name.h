#pragma once

#include <string>
#include <string_view>

/// How the configuration and command lines name a network of the detector.
namespace posed {

/// A network's file and the size of the images that it is to look at: "person.posednet@256x192", width before height. Reentrant.
struct ModelName {
  std::string file;
  int width = 0;   ///< [pixels]; 0: as the file says
  int height = 0;  ///< [pixels]; 0: as the file says

  bool has_size() const { return width > 0; }
  friend bool operator==(const ModelName&, const ModelName&) = default;
};

/// What does not end in `@WIDTHxHEIGHT`, both from 1 to 9999, is a file's name as a whole.
ModelName parse_model_name(std::string_view text);
std::string to_string(const ModelName& name);

}  // namespace posed
