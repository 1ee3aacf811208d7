// A failure, told to a person: one line that says what, where, and what to do.
#pragma once

#include <string>

namespace moldloft::firmware_like {

struct Failure {
  std::string what;
};

}  // namespace moldloft::firmware_like
