#include "hal/record/tapped_link.hpp"

namespace moldloft::hal {

std::size_t TappedLink::read(std::span<std::byte> out) noexcept {
  const std::size_t count = link_.read(out);
  if (count > 0) recorder_.link_bytes(id_, Direction::received, clock_.now(), out.first(count));
  return count;
}

std::size_t TappedLink::write(std::span<const std::byte> in) noexcept {
  const std::size_t count = link_.write(in);
  if (count > 0) recorder_.link_bytes(id_, Direction::sent, clock_.now(), in.first(count));
  return count;
}

}  // namespace moldloft::hal
