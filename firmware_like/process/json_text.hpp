// JSON as text, the only place that writes it. The library's dump() throws when a string is not UTF-8, and
// would do so while a run is being saved. Here such bytes become U+FFFD, and the file is still JSON.
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
