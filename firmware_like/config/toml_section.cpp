#include "firmware_like/config/toml_section.hpp"

#include "hal/base/printable_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace moldloft::firmware_like {
namespace {

// A device's path, a host, a name: longer than any path may be (PATH_MAX), and a message of ours still fits a screen.
constexpr std::size_t longest_text = 4095;

constexpr std::size_t longest_label = 100;  // of a name: as much as a plate may be called by

// A key or value as a message shows it, cut so that the complaint behind it is seen.
std::string shown(std::string_view text) { return hal::printable(text, 60); }

}  // namespace

TomlSection::TomlSection(const toml::table* table, std::string name, std::vector<ConfigFinding>& findings)
    : table_{table}, name_{std::move(name)}, findings_{findings} {}

const toml::node* TomlSection::node(std::string_view key) {
  known_.emplace(key);
  return table_ == nullptr ? nullptr : table_->get(key);
}

void TomlSection::wrong(const toml::node& at, std::string_view key, std::string_view what) {
  const std::string section = name_.empty() ? "" : fmt::format("[{}] ", name_);
  findings_.push_back({Severity::error,
                       static_cast<int>(at.source().begin.line),
                       hal::printable(fmt::format("{}{}: {}", section, shown(key), what)),
                       {name_.empty() ? std::string{key} : fmt::format("{}.{}", name_, key)}});
}

void TomlSection::number(std::string_view key, double& value, double min, double max) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  const auto v = n->value<double>();
  if (!v || !n->is_number()) return wrong(*n, key, "a number is wanted");
  if (!std::isfinite(*v) || *v < min || *v > max)
    return wrong(*n, key, fmt::format("{} is outside {} to {}", *v, min, max));
  value = *v;
}

void TomlSection::integer(std::string_view key, int& value, int min, int max) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  if (!n->is_integer()) return wrong(*n, key, "a whole number is wanted");
  const auto v = *n->value<std::int64_t>();
  if (v < min || v > max) return wrong(*n, key, fmt::format("{} is outside {} to {}", v, min, max));
  value = static_cast<int>(v);
}

void TomlSection::flag(std::string_view key, bool& value) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  if (!n->is_boolean()) return wrong(*n, key, "true or false is wanted");
  value = *n->value<bool>();
}

void TomlSection::text(std::string_view key, std::string& value) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  if (!n->is_string()) return wrong(*n, key, "a text in quotes is wanted");
  const auto given = *n->value<std::string>();
  if (given.size() > longest_text)
    return wrong(*n, key, fmt::format("{} bytes long; {} at most", given.size(), longest_text));
  if (hal::printable(given) != given) return wrong(*n, key, "holds a control character: write it without");
  value = given;
}

void TomlSection::label(std::string_view key, std::string& value) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  if (!n->is_string()) return wrong(*n, key, "a text in quotes is wanted");
  value = hal::printable(*n->value<std::string>(), longest_label);
}

void TomlSection::choice(std::string_view key, std::string& value, const std::vector<std::string>& allowed) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  if (!n->is_string()) return text(key, value);
  text(key, value);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    wrong(*n, key, fmt::format("'{}' is not one of: {}", shown(value), fmt::join(allowed, ", ")));
  }
}

void TomlSection::numbers(std::string_view key, std::span<double> values, double min, double max) {
  const toml::node* n = node(key);
  if (n == nullptr) return;
  const toml::array* array = n->as_array();
  if (array == nullptr || array->size() != values.size()) {
    return wrong(*n, key, fmt::format("an array of {} numbers is wanted", values.size()));
  }
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto v = array->get(i)->value<double>();
    if (!v || !array->get(i)->is_number())
      return wrong(*n, key, fmt::format("an array of {} numbers is wanted", values.size()));
    if (!std::isfinite(*v) || *v < min || *v > max)
      return wrong(*n, key, fmt::format("{} is outside {} to {}", *v, min, max));
    values[i] = *v;
  }
}

void TomlSection::range(std::string_view key, std::array<double, 2>& values, double min, double max) {
  const auto known = findings_.size();
  numbers(key, values, min, max);
  if (findings_.size() > known) return;
  if (const toml::node* n = node(key); n != nullptr && values[0] > values[1]) {
    wrong(*n, key,
          fmt::format("from {} to {} is no range: the smaller number comes first", values[0], values[1]));
  }
}

TomlSection TomlSection::section(std::string_view key) {
  const toml::node* n = node(key);
  const toml::table* table = n == nullptr ? nullptr : n->as_table();
  if (n != nullptr && table == nullptr) wrong(*n, key, "a table is wanted");
  return {table, name_.empty() ? std::string{key} : fmt::format("{}.{}", name_, key), findings_};
}

void TomlSection::finish() {
  if (table_ == nullptr) return;
  for (const auto& [key, value] : *table_) {
    if (!known_.contains(key.str())) {
      wrong(value, key.str(), fmt::format("unknown key; known here: {}", fmt::join(known_, ", ")));
    }
  }
}

}  // namespace moldloft::firmware_like
