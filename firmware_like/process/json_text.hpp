// JSON as text, the only place that writes it: dump() of the library throws where a string is no UTF-8, in the
// middle of what ends a run. Here such bytes become U+FFFD, and the file is JSON all the same.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace moldloft::firmware_like {

using Json = nlohmann::ordered_json;

// On one line, or with this many blanks of indent a level.
inline std::string json_text(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace moldloft::firmware_like
