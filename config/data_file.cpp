#include "config/data_file.h"

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "config/config_loader.h"

namespace posed {

namespace {

bool is_file(const std::filesystem::path& path) {
  std::error_code ignored;  // what cannot be looked at is not there for us
  return std::filesystem::is_regular_file(path, ignored);
}

/// The folders of an environment variable, separated by colons, then those of the source tree and of the installation.
std::vector<std::filesystem::path> data_folders(const char* variable_name, const char* source, const char* installed) {
  std::vector<std::filesystem::path> folders;
  if (const char* variable = std::getenv(variable_name); variable != nullptr) {
    std::string_view rest = variable;
    while (!rest.empty()) {
      const std::string_view folder = rest.substr(0, rest.find(':'));
      if (!folder.empty()) {
        folders.emplace_back(folder);
      }
      rest.remove_prefix(std::min(rest.size(), folder.size() + 1));
    }
  }
  folders.emplace_back(source);
  folders.emplace_back(installed);
  return folders;
}

}  // namespace

std::vector<std::filesystem::path> calibration_folders() {
  return data_folders("POSED_CAMERA_PATH", POSED_SOURCE_CAMERAS, POSED_INSTALLED_CAMERAS);
}

std::vector<std::filesystem::path> model_folders() {
  return data_folders("POSED_MODEL_PATH", POSED_SOURCE_MODELS, POSED_INSTALLED_MODELS);
}

Result<std::filesystem::path> find_file(const std::filesystem::path& name, std::vector<std::filesystem::path> folders,
                                        std::vector<std::filesystem::path> shipped) {
  if (name.is_absolute()) {
    return is_file(name) ? Result<std::filesystem::path>(name) : make_error(ErrorCode::Io, "there is no such file");
  }
  std::move(shipped.begin(), shipped.end(), std::back_inserter(folders));
  std::string tried;
  for (const std::filesystem::path& folder : folders) {
    std::filesystem::path candidate = (folder / name).lexically_normal();
    if (is_file(candidate)) {
      return candidate;
    }
    tried += (tried.empty() ? "" : ", ") + candidate.string();
  }
  return make_error(ErrorCode::Io, fmt::format("there is no such file; looked for {}", tried));
}

}  // namespace posed
