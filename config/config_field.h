#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "config/toml_document.h"
#include "core/se3.h"

/// What one key of a configuration file may hold, and where it goes. Each kind of field points at the variable it fills, so it can
/// be read, written and described without knowing the struct around it. Limits are inclusive. Reentrant.
namespace posed {

struct BoolField {
  bool* value;
};

struct IntegerField {
  std::variant<int*, std::int64_t*> value;
  std::int64_t minimum;
  std::int64_t maximum;
};

/// In the file a whole number may be written without a point. NaN and infinities are never allowed.
struct RealField {
  double* value;
  double minimum;
  double maximum;
};

/// An array of as many numbers as there are variables.
struct RealListField {
  std::vector<double*> values;
  double minimum;  ///< of each
  double maximum;
};

struct IntegerListField {
  std::vector<int>* value;
  int minimum;  ///< of each
  int maximum;
  std::size_t max_size;
};

struct TextRule {
  std::string_view allowed;  ///< in words
  bool (*is_allowed)(std::string_view);
};

struct TextField {
  std::string* value;
  TextRule rule;
};

struct TextListField {
  std::vector<std::string>* value;
  TextRule rule;  ///< of each
  std::size_t max_size;
};

/// A name out of a few. An enumeration's, or a string's that holds the name itself.
struct ChoiceField {
  std::vector<std::string_view> names;
  std::function<std::string_view()> get;
  std::function<void(std::string_view)> set;
};

/// [x, y, z, qx, qy, qz, qw]: metres, then a quaternion whose norm is 1 within kQuaternionTolerance; it is normalised.
struct PoseField {
  Se3* value;
  static constexpr double kMaxTranslation_m = 1e7;  ///< room for map projections such as UTM
  static constexpr double kQuaternionTolerance = 1e-3;
};

using Field = std::variant<BoolField, IntegerField, RealField, RealListField, IntegerListField, TextField, TextListField,
                           ChoiceField, PoseField>;

/// Why a value was refused.
struct FieldProblem {
  TextPosition position;  ///< of the value, or of the array's element that is to blame
  std::string value;      ///< what was read
  std::string reason;     ///< what is wrong with it and what is allowed
};

/// Sets the field's variable, or leaves it as it is and says why.
std::optional<FieldProblem> assign(const Field& field, const TomlValue& value);

/// The variable's present value as TOML; `assign` reads it back to the same (a pose's quaternion to rounding).
std::string value_text(const Field& field);

/// For people: "integer" and "100 to 5000".
std::string type_text(const Field& field);
std::string allowed_text(const Field& field);

}  // namespace posed
