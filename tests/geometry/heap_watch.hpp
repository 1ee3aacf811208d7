// Counts every allocation and release of the test program, so that a test can say that a call made none.
#pragma once

#include <cstddef>

namespace moldloft::test {

std::size_t allocations() noexcept;  // since the program started
std::size_t releases() noexcept;

}  // namespace moldloft::test
