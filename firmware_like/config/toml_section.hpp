// One table of a TOML file, read key by key. Each getter notes what is wrong with its key; finish() notes the
// keys that nobody asked for. Values keep their defaults where the key is absent.
//
// Setup time only: allocates. All errors of a file are collected, each with its line and key.
#pragma once

#include "firmware_like/config/config_rules.hpp"

#include <toml++/toml.h>

#include <array>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace moldloft::firmware_like {

class TomlSection {
 public:
  // `table` may be null: then every key is absent. `findings` is shared by all sections of a file.
  TomlSection(const toml::table* table, std::string name, std::vector<ConfigFinding>& findings);
  ~TomlSection() = default;

  void number(std::string_view key, double& value, double min, double max);
  void integer(std::string_view key, int& value, int min, int max);
  void flag(std::string_view key, bool& value);
  void text(std::string_view key, std::string& value);
  void label(std::string_view key, std::string& value);  // for people: what cannot be shown is replaced
  void choice(std::string_view key, std::string& value, const std::vector<std::string>& allowed);
  void numbers(std::string_view key, std::span<double> values, double min,
               double max);  // an array of that length
  void range(std::string_view key, std::array<double, 2>& values, double min,
             double max);  // the smaller number first
  TomlSection section(std::string_view key);
  void finish();  // unknown keys are an error

 private:
  const toml::node* node(std::string_view key);
  void wrong(const toml::node& at, std::string_view key, std::string_view what);

  const toml::table* table_;
  std::string name_;
  std::vector<ConfigFinding>& findings_;
  std::set<std::string, std::less<>> known_;
};

}  // namespace moldloft::firmware_like
