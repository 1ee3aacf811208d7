// Must not compile: a byte link that reads a descriptor without a word on why it comes back at once.
#include "hal/links/byte_link.hpp"

#include <unistd.h>

namespace {

using namespace moldloft::hal;

class Waits final : public ByteLink {
 public:
  void open() override {}
  void close() noexcept override {}
  std::size_t read(std::span<std::byte> out) noexcept override {
    const auto count = ::read(0, out.data(), out.size());
    return count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  std::size_t write(std::span<const std::byte>) noexcept override { return 0; }
  LinkState state() noexcept override { return LinkState::open; }
  std::string_view why() const noexcept override { return {}; }
};

[[maybe_unused]] Waits link;

}  // namespace
