#include "config/config_field.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace posed {

namespace {

using Problem = std::optional<FieldProblem>;

FieldProblem refuse(const TomlValue& value, std::string reason) {
  return {value.position, brief_text(value), std::move(reason)};
}

FieldProblem wrong_type(const TomlValue& value, std::string_view expected, std::string_view allowed) {
  return refuse(value, fmt::format("wrong type ({}), expected {}, allowed {}", type_name(value), expected, allowed));
}

/// The value as a number, where it is a float or an integer that a double holds exactly.
std::optional<double> as_real(const TomlValue& value) {
  constexpr std::int64_t kExact = std::int64_t{1} << 53;
  if (const auto* real = std::get_if<double>(&value.data)) {
    return *real;
  }
  if (const auto* integer = std::get_if<std::int64_t>(&value.data);
      integer != nullptr && *integer >= -kExact && *integer <= kExact) {
    return static_cast<double>(*integer);
  }
  return std::nullopt;
}

std::string range_text(double minimum, double maximum) {
  return fmt::format("{} to {}", real_text(minimum), real_text(maximum));
}

Problem check_real(const TomlValue& value, double minimum, double maximum, std::string_view allowed, double& out) {
  const std::optional<double> real = as_real(value);
  if (!real) {
    return std::holds_alternative<std::int64_t>(value.data) ? refuse(value, fmt::format("out of range, allowed {}", allowed))
                                                            : wrong_type(value, "number", allowed);
  }
  if (!std::isfinite(*real)) {
    return refuse(value, fmt::format("not a finite number, allowed {}", allowed));
  }
  if (*real < minimum || *real > maximum) {
    return refuse(value, fmt::format("out of range, allowed {}", allowed));
  }
  out = *real;
  return std::nullopt;
}

/// Reads an array of exactly `out.size()` numbers.
template <typename Limits>
Problem check_reals(const TomlValue& value, const Field& field, std::vector<double>& out, Limits limits) {
  const auto* elements = std::get_if<std::vector<TomlValue>>(&value.data);
  if (elements == nullptr) {
    return wrong_type(value, type_text(field), allowed_text(field));
  }
  if (elements->size() != out.size()) {
    return refuse(
        value, fmt::format("wrong length ({}), expected {}, allowed {}", elements->size(), type_text(field), allowed_text(field)));
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto [minimum, maximum] = limits(i);
    if (Problem problem = check_real((*elements)[i], minimum, maximum, range_text(minimum, maximum), out[i])) {
      problem->reason = fmt::format("element {} of {}: {}", i + 1, out.size(), problem->reason);
      return problem;
    }
  }
  return std::nullopt;
}

struct Assign {
  const TomlValue& value;
  const Field& field;

  Problem operator()(const BoolField& f) const {
    const auto* flag = std::get_if<bool>(&value.data);
    if (flag == nullptr) {
      return wrong_type(value, type_text(field), allowed_text(field));
    }
    *f.value = *flag;
    return std::nullopt;
  }

  Problem operator()(const IntegerField& f) const {
    const auto* integer = std::get_if<std::int64_t>(&value.data);
    if (integer == nullptr) {
      return wrong_type(value, type_text(field), allowed_text(field));
    }
    if (*integer < f.minimum || *integer > f.maximum) {
      return refuse(value, fmt::format("out of range, allowed {}", allowed_text(field)));
    }
    std::visit([&](auto* target) { *target = static_cast<std::remove_pointer_t<decltype(target)>>(*integer); }, f.value);
    return std::nullopt;
  }

  Problem operator()(const RealField& f) const { return check_real(value, f.minimum, f.maximum, allowed_text(field), *f.value); }

  Problem operator()(const RealListField& f) const {
    std::vector<double> read(f.values.size());
    if (Problem problem = check_reals(value, field, read, [&](std::size_t) { return std::pair(f.minimum, f.maximum); })) {
      return problem;
    }
    for (std::size_t i = 0; i < read.size(); ++i) {
      *f.values[i] = read[i];
    }
    return std::nullopt;
  }

  Problem operator()(const IntegerListField& f) const {
    return assign_list<int>(f, [&](int& element) { return IntegerField{&element, f.minimum, f.maximum}; });
  }

  Problem operator()(const TextField& f) const {
    const auto* text = std::get_if<std::string>(&value.data);
    if (text == nullptr) {
      return wrong_type(value, type_text(field), allowed_text(field));
    }
    if (!f.rule.is_allowed(*text)) {
      return refuse(value, fmt::format("not allowed, must be {}", allowed_text(field)));
    }
    *f.value = *text;
    return std::nullopt;
  }

  Problem operator()(const TextListField& f) const {
    return assign_list<std::string>(f, [&](std::string& element) { return TextField{&element, f.rule}; });
  }

  Problem operator()(const ChoiceField& f) const {
    const auto* text = std::get_if<std::string>(&value.data);
    if (text == nullptr) {
      return wrong_type(value, type_text(field), allowed_text(field));
    }
    if (std::find(f.names.begin(), f.names.end(), *text) == f.names.end()) {
      return refuse(value, fmt::format("unknown choice, allowed {}", allowed_text(field)));
    }
    f.set(*text);
    return std::nullopt;
  }

  Problem operator()(const PoseField& f) const {
    std::vector<double> v(7);
    const auto limits = [](std::size_t i) {
      const double limit = i < 3 ? PoseField::kMaxTranslation_m : 1.0 + PoseField::kQuaternionTolerance;
      return std::pair(-limit, limit);
    };
    if (Problem problem = check_reals(value, field, v, limits)) {
      return problem;
    }
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (std::abs(rotation.norm() - 1.0) > PoseField::kQuaternionTolerance) {
      return refuse(
          value, fmt::format("quaternion's norm is {:.6f}, allowed 1 within {}", rotation.norm(), PoseField::kQuaternionTolerance));
    }
    *f.value = Se3(rotation, {v[0], v[1], v[2]});
    return std::nullopt;
  }

 private:
  /// `element_field` makes the field of one element.
  template <typename Element, typename List, typename ElementField>
  Problem assign_list(const List& f, ElementField&& element_field) const {
    const auto* elements = std::get_if<std::vector<TomlValue>>(&value.data);
    if (elements == nullptr) {
      return wrong_type(value, type_text(field), allowed_text(field));
    }
    if (elements->size() > f.max_size) {
      return refuse(value, fmt::format("too long ({}), allowed {}", elements->size(), allowed_text(field)));
    }
    std::vector<Element> read;
    for (std::size_t i = 0; i < elements->size(); ++i) {
      Element element{};
      if (Problem problem = posed::assign(element_field(element), (*elements)[i])) {
        problem->reason = fmt::format("element {} of {}: {}", i + 1, elements->size(), problem->reason);
        return problem;
      }
      read.push_back(std::move(element));
    }
    *f.value = std::move(read);
    return std::nullopt;
  }
};

struct ValueText {
  std::string operator()(const BoolField& f) const { return *f.value ? "true" : "false"; }
  std::string operator()(const IntegerField& f) const {
    return std::visit([](const auto* target) { return fmt::format("{}", *target); }, f.value);
  }
  std::string operator()(const RealField& f) const { return real_text(*f.value); }
  std::string operator()(const RealListField& f) const {
    std::vector<std::string> texts;
    std::transform(f.values.begin(), f.values.end(), std::back_inserter(texts), [](const double* v) { return real_text(*v); });
    return fmt::format("[{}]", fmt::join(texts, ", "));
  }
  std::string operator()(const IntegerListField& f) const { return fmt::format("[{}]", fmt::join(*f.value, ", ")); }
  std::string operator()(const TextField& f) const { return quoted(*f.value); }
  std::string operator()(const TextListField& f) const {
    std::vector<std::string> texts;
    std::transform(f.value->begin(), f.value->end(), std::back_inserter(texts), [](const std::string& t) { return quoted(t); });
    return fmt::format("[{}]", fmt::join(texts, ", "));
  }
  std::string operator()(const ChoiceField& f) const { return quoted(f.get()); }
  std::string operator()(const PoseField& f) const {
    const Eigen::Vector3d& t = f.value->translation();
    const Eigen::Quaterniond& q = f.value->rotation();
    std::array<double, 7> v = {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
    std::vector<double*> pointers;
    std::transform(v.begin(), v.end(), std::back_inserter(pointers), [](double& x) { return &x; });
    return (*this)(RealListField{pointers, 0, 0});
  }
};

struct TypeText {
  std::string operator()(const BoolField&) const { return "boolean"; }
  std::string operator()(const IntegerField&) const { return "integer"; }
  std::string operator()(const RealField&) const { return "number"; }
  std::string operator()(const RealListField& f) const { return fmt::format("array of {} numbers", f.values.size()); }
  std::string operator()(const IntegerListField&) const { return "array of integers"; }
  std::string operator()(const TextField&) const { return "string"; }
  std::string operator()(const TextListField&) const { return "array of strings"; }
  std::string operator()(const ChoiceField&) const { return "string"; }
  std::string operator()(const PoseField&) const { return "array of 7 numbers"; }
};

struct AllowedText {
  std::string operator()(const BoolField&) const { return "true or false"; }
  std::string operator()(const IntegerField& f) const { return fmt::format("{} to {}", f.minimum, f.maximum); }
  std::string operator()(const RealField& f) const { return range_text(f.minimum, f.maximum); }
  std::string operator()(const RealListField& f) const { return "each " + range_text(f.minimum, f.maximum); }
  std::string operator()(const IntegerListField& f) const {
    return fmt::format("at most {}, each {} to {}", f.max_size, f.minimum, f.maximum);
  }
  std::string operator()(const TextField& f) const { return std::string(f.rule.allowed); }
  std::string operator()(const TextListField& f) const { return fmt::format("at most {}, each {}", f.max_size, f.rule.allowed); }
  std::string operator()(const ChoiceField& f) const {
    std::string text;
    for (std::size_t i = 0; i < f.names.size(); ++i) {
      text += (i == 0 ? "" : i + 1 < f.names.size() ? ", " : " or ") + quoted(f.names[i]);
    }
    return text;
  }
  std::string operator()(const PoseField&) const { return "x, y, z, then a unit quaternion qx, qy, qz, qw"; }
};

}  // namespace

std::optional<FieldProblem> assign(const Field& field, const TomlValue& value) {
  return std::visit(Assign{value, field}, field);
}

std::string value_text(const Field& field) {
  return std::visit(ValueText{}, field);
}

std::string type_text(const Field& field) {
  return std::visit(TypeText{}, field);
}

std::string allowed_text(const Field& field) {
  return std::visit(AllowedText{}, field);
}

}  // namespace posed
