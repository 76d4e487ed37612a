#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/result.h"

/// Logging for everything but the capture and tracking threads, which count events instead: the supervisor reports the counts.
/// Thread-safe. The sink (stderr, later the journal) and the level are set once, before threads start.
namespace posed {

enum class LogLevel { Debug, Info, Warning, Error, Off };

Result<LogLevel> parse_log_level(std::string_view name);
void set_log_level(LogLevel level);
void log_message(LogLevel level, std::string_view message);

template <typename... Args>
void log_debug(fmt::format_string<Args...> format, Args&&... args) {
  log_message(LogLevel::Debug, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_info(fmt::format_string<Args...> format, Args&&... args) {
  log_message(LogLevel::Info, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_warning(fmt::format_string<Args...> format, Args&&... args) {
  log_message(LogLevel::Warning, fmt::format(format, std::forward<Args>(args)...));
}
template <typename... Args>
void log_error(fmt::format_string<Args...> format, Args&&... args) {
  log_message(LogLevel::Error, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace posed
